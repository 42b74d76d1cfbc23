"""What a REPL shows of anything that a user can hold: six lines, with what matters in them."""

import dataclasses
from functools import cache

import numpy as np
import pytest

import serpentail as st
from tests.support import zoo
from tests.support.rows import row

MOST_LINES, MOST_CHARACTERS = 6, 600  # a terminal of 100 columns wraps what is one line


def flown(runs=None, **settings):
    """Drops of a rat from 0.3 m, or of many."""
    q = np.array([0, 0, 0.3, 1, 0, 0, 0, 0.1, 0])
    q = q if runs is None else np.tile(q, (runs, 1))
    settings = {"legs": st.Legs.fixed(3.6, -0.3), "t_span": 0.05, "rtol": 1e-6} | settings
    return st.simulate(zoo.model("feet"), q, np.zeros(8), **settings)


def tired(t, q, v):
    """A controller that gives up at 0.02 s, above 0.29 m."""
    if 0.02 < t < 0.022 and q[2] > 0.29:
        raise st.SimulationError("it is tired")
    return np.zeros(2)


@cache
def planned():
    start = np.array([0, 0, 0, 1, 0.1, 0, 0, 0, 0]), np.zeros(8)
    free = st.Goal(attitude=None, torso_rate=None)
    settings = {"tolerance": None, "intervals": 4, "track": False}
    return st.plan(zoo.model("m1_n3"), start=start, goal=free, duration=0.1, **settings)


def held():
    """Everything that the package gives."""
    rat, motion, runs, plan = zoo.model("feet"), flown(), flown(300), planned()
    times = np.linspace(0, 1, 500)
    table = st.TorqueTable(times, np.zeros((500, 2)))
    reference = st.Reference(times, np.zeros((500, 2)))
    legs = st.Legs(times, 3 + 0 * times, -0.3 + 0 * times)
    scenario = st.Scenario(rat, motion.q[0], motion.v[0], 1.0, table, legs, {"rtol": 1e-6})
    phases = st.Phases([(0.0, table), (0.5, table), (0.7, None)])
    things = [motion, motion.contact, runs, runs.audit, plan, table, reference, legs, scenario]
    things += [plan.trajectory, plan.problem, plan.curve, plan.mesh, plan.rule, plan.solution]
    things += [rat, rat.casadi, reference.curve, st.Damping(), st.Goal(), st.Bounds(), phases]
    return [*things, st.Pfl(rat, reference)]


def test_nothing_fills_the_screen():
    for thing in held():
        with row(type(thing).__name__):
            text = repr(thing)
            assert text.count("\n") < MOST_LINES and len(text) <= MOST_CHARACTERS
            assert max(map(len, text.splitlines())) <= 100 or "\n" not in text


def test_a_motion_says_what_it_is(tmp_path):
    motion = flown(output_step=0.001)
    lines = repr(motion).splitlines()
    assert lines[0].startswith("<Trajectory of ") and "articulated, 1 x 3 links" in lines[0]
    assert lines[0].endswith("51 samples, 0 to 0.05 s")
    assert lines[1] == "  q (51, 9), v (51, 8), tau (51, 2); SI: s, m, rad, kg, N"
    assert lines[2] == "  on the ground by points: 6 of the feet; 0 events"
    assert lines[3].startswith("  by ros34pw2: ") and "steps" in lines[3]
    loaded = st.Trajectory.load(motion.save(tmp_path / "run.npz"))
    assert "without its model" in repr(loaded).splitlines()[0]
    warned = dataclasses.replace(motion, info=motion.info | {"warnings": ["word " * 99, "b"]})
    last = repr(warned).splitlines()[-1]
    assert last.startswith("  2 warnings, the first: word word") and len(last) <= 100
    assert last.endswith("...>")


def test_what_failed_says_why():
    with pytest.raises(st.SimulationError) as caught:
        flown(controller=tired)
    text = repr(caught.value.trajectory)
    assert "failed: it is tired" in text and text.count("\n") == 4
    runs = flown(3, parameters={"gravity": [90.0, 90.0, 9.8]}, controller=tired)
    lines = repr(runs).splitlines()
    assert ": 3 runs of 201 samples, 0 to 0.05 s" in lines[0]
    assert lines[3] == "  1 failed, the first run 2: it is tired>"


def test_a_plan_says_whether_it_succeeded():
    plan = planned()
    lines = repr(plan).splitlines()
    assert lines[0].endswith(": success") and f"{plan.mesh.intervals} intervals" in lines[1]
    report = plan.report | {"status": "Infeasible", "effort": None}
    failed = repr(dataclasses.replace(plan, success=False, report=report))
    assert "no success (Infeasible)" in failed and "effort no finite" in failed


def test_arrays_are_told_by_their_shapes_and_functions_by_their_names():
    assert repr(flown(output_step=0.01).contact) == (
        "Contact(points=array of 6 x 6 x 3, forces=array of 6 x 6 x 3, "
        "bristles=array of 6 x 6 x 2, groups={feet: 6}, legs=array of 6 x 4)"
    )
    assert repr(st.Legs([0.0], 3.5, -0.25)).startswith("Legs(times=[0.0], gamma=3.5, delta=-0.25,")
    functions = repr(zoo.model("feet").casadi)
    assert functions.startswith("<CasadiFunctions of feet, SX and compiled:\n  ")
    assert "mass_matrix, " in functions
