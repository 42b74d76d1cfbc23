"""What a REPL shows of anything that a user can hold: six lines, with what matters in them."""

import dataclasses
from functools import cache

import numpy as np
import pytest

import serpentail as st
from tests.support.models import model_folder

MOST_LINES, MOST_CHARACTERS = 6, 600  # a terminal of 100 columns wraps what is one line
FUNCTIONS = ["energy", "momentum", "rollout", "mass_matrix", "inverse_dynamics"]


@cache
def rat():
    return st.load(model_folder(1, 3, contacts=["feet"], functions=[*FUNCTIONS, "implicit"]))


def flown(runs=None, **settings):
    """Drops of a rat from 0.3 m, or of many."""
    q = np.array([0, 0, 0.3, 1, 0, 0, 0, 0.1, 0])
    q = q if runs is None else np.tile(q, (runs, 1))
    legs = st.Legs.fixed(3.6, -0.3)
    return st.simulate(rat(), q, np.zeros(8), legs=legs, t_span=0.05, rtol=1e-6, **settings)


def tired(t, q, v):
    """A controller that gives up at 0.02 s, above 0.29 m."""
    if 0.02 < t < 0.022 and q[2] > 0.29:
        raise st.SimulationError("it is tired")
    return np.zeros(2)


@cache
def planned():
    model = st.load(model_folder(1, 3, functions=FUNCTIONS))
    start = np.array([0, 0, 0, 1, 0.1, 0, 0, 0, 0]), np.zeros(8)
    free = st.Goal(attitude=None, torso_rate=None)
    settings = {"tolerance": None, "intervals": 4, "track": False}
    return st.plan(model, start=start, goal=free, duration=0.1, **settings)


def held():
    """Everything that the package gives, by name."""
    motion, runs, plan = flown(), flown(300), planned()
    times = np.linspace(0, 1, 500)
    table = st.TorqueTable(times, np.zeros((500, 2)))
    reference = st.Reference(times, np.zeros((500, 2)))
    legs = st.Legs(times, 3 + 0 * times, -0.3 + 0 * times)
    things = [motion, motion.contact, runs, runs.audit, plan, table, reference, legs]
    things += [plan.trajectory, plan.problem, plan.curve, plan.mesh, plan.rule, plan.solution]
    things += [rat(), rat().casadi, reference.curve, st.Damping(), st.Goal(), st.Bounds()]
    things += [st.Phases([(0.0, table), (0.5, table), (0.7, None)]), st.Pfl(rat(), reference)]
    things.append(st.Scenario(rat(), motion.q[0], motion.v[0], 1.0, table, legs, {"rtol": 1e-6}))
    return {type(thing).__name__ + str(k): thing for k, thing in enumerate(things)}


def test_nothing_fills_the_screen():
    for name, thing in held().items():
        text = repr(thing)
        assert text.count("\n") < MOST_LINES and len(text) <= MOST_CHARACTERS, (name, text)
        assert max(map(len, text.splitlines())) <= 100 or "\n" not in text


def test_a_motion_says_what_it_is():
    lines = repr(flown(output_step=0.001)).splitlines()
    assert lines[0].startswith("<Trajectory of ") and "articulated, 1 x 3 links" in lines[0]
    assert lines[0].endswith("51 samples, 0 to 0.05 s")
    assert lines[1] == "  q (51, 9), v (51, 8), tau (51, 2); SI: s, m, rad, kg, N"
    assert lines[2] == "  on the ground by points: 6 of the feet; 0 events"
    assert lines[3].startswith("  by ros34pw2: ") and "steps" in lines[3]


def test_a_motion_from_a_file_says_that_it_has_no_model(tmp_path):
    loaded = st.Trajectory.load(flown().save(tmp_path / "run.npz"))
    assert "without its model" in repr(loaded).splitlines()[0]


def test_a_motion_that_failed_says_why():
    with pytest.raises(st.SimulationError) as caught:
        flown(controller=tired)
    text = repr(caught.value.trajectory)
    assert "failed: it is tired" in text and text.count("\n") == 4


def test_warnings_are_counted_and_long_words_cut():
    motion = flown()
    motion = dataclasses.replace(motion, info=motion.info | {"warnings": ["word " * 99, "b"]})
    last = repr(motion).splitlines()[-1]
    assert last.startswith("  2 warnings, the first: word word") and len(last) <= 100
    assert last.endswith("...>")


def test_runs_say_how_many_failed():
    gravity = {"gravity": [90.0, 90.0, 9.8]}
    runs = flown(3, parameters=gravity, controller=tired)
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


def test_arrays_are_told_by_their_shapes():
    contact = flown(output_step=0.01).contact
    assert repr(contact) == (
        "Contact(points=array of 6 x 6 x 3, forces=array of 6 x 6 x 3, "
        "bristles=array of 6 x 6 x 2, groups={feet: 6}, legs=array of 6 x 4)"
    )
    assert repr(st.Legs([0.0], 3.5, -0.25)).startswith("Legs(times=[0.0], gamma=3.5, delta=-0.25,")


def test_functions_are_named():
    assert repr(rat().casadi).startswith(f"<CasadiFunctions of {rat().name}, SX and compiled:\n  ")
    assert "mass_matrix, " in repr(rat().casadi)
