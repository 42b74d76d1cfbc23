"""Plans by FATROP on stages: the optima of IPOPT on the transcription, which shares nothing with
the stages but the model, and what ends a search early.
"""

import signal
import threading
import time
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import serpentail as st
from examples import righting
from serpentail.attitude import tilt_deg
from serpentail.checks import Refusals
from serpentail.planning.condensed import fatrop
from serpentail.planning.condensed.stages import stages_of
from serpentail.planning.nlp.bounds import limits
from serpentail.planning.nlp.equations import equations_of_motion
from serpentail.planning.nlp.mesh import uniform
from serpentail.planning.nlp.rules import collocation_rule
from serpentail.planning.nlp.solver import solve, solver
from serpentail.planning.nlp.transcription import transcription_of
from serpentail.planning.problem import checked_problem
from serpentail.planning.ways import STAGED
from tests.support.models import model_folder
from tests.support.tumbling import DURATION, FUNCTIONS, integrated, rat, start

PROBLEMS = {
    "upright": {},
    "free duration": {"duration": (0.3, 0.5)},
    "any rate": {"goal": st.Goal(torso_rate=None)},
    "any attitude": {"goal": st.Goal(attitude=None)},
    "given attitude": {"goal": st.Goal(attitude=(1.0, 0.0, 0.0, 0.1), torso_rate=None)},
    "tail": {"goal": st.Goal(torso_rate=None, tail=(0.1, None), tail_rate=(None, 0.0))},
    "rates": {"bounds": st.Bounds(angle=np.pi / 3, rate=(12.0, 15.0))},
    "no bounds": {"bounds": st.Bounds(torque=None)},
    "damping": {"damping": 1e-4},
    "no smoothing": {"smoothing": 0.0},
}
SLOW_SEEDS = [pytest.param(k, marks=pytest.mark.slow) for k in range(1, 5)]
# of the 50, the one that IPOPT does not solve: bounds have multipliers of 400 and more
HARD = {("given attitude", 1)}
# one round
COARSE = {"tolerance": None, "track": False, "intervals": 12}


def planned(problem: dict, seed: int = 0, **settings) -> st.Plan:
    """Return FATROP's plan of a problem for a start."""
    model = rat()
    common = {"duration": DURATION, "bounds": st.Bounds(angle=np.pi / 3)} | COARSE
    given = common | {"solver": "fatrop"} | problem | settings
    return st.plan(model, start=start(model, seed), **given)


def of_ipopt(near: st.Plan):
    """What IPOPT makes of a plan's problem to a tolerance of 1e-11, torques guarded everywhere."""
    mesh = replace(near.mesh, guarded=np.ones(near.mesh.intervals, bool))
    nlp = transcription_of(rat(), near.problem, mesh, near.rule, equations_of_motion(rat()))
    engine = solver(nlp, "ipopt", {"ipopt.tol": 1e-11}, "close")
    return solve(engine, limits(nlp, blocks(near), np.zeros(3)), near.solution.w, conserved(near))


def blocks(plan: st.Plan) -> dict:
    q, v = plan.problem.q0, plan.problem.v0
    return {"attitude": q[3:7], "tail": q[7:], "tail_rate": v[6:]}


def conserved(plan: st.Plan) -> np.ndarray:
    h = rat().momentum(plan.problem.q0, plan.problem.v0)[1]
    return np.concatenate([h, np.zeros(7)])


@pytest.mark.parametrize("name", PROBLEMS)
@pytest.mark.parametrize("seed", [0, *SLOW_SEEDS])
def test_optima_are_those_of_ipopt(name, seed):
    """One of several: FATROP goes on from it, a little away, and comes back."""
    near = planned(PROBLEMS[name], seed, solver="ipopt")
    wanted = of_ipopt(near)
    if (name, seed) in HARD and not (near.report["converged"] and wanted.success):
        return
    assert near.report["converged"] and wanted.success
    stages = stages_of(rat(), near.problem, near.mesh, near.rule)
    w = wanted.w * (1 + 1e-6 * np.random.default_rng(seed).normal(size=wanted.w.size))
    engine = fatrop.engine_of({}, "close")
    found = fatrop.solve_stages(stages, blocks(near), w, conserved(near), engine)
    assert found.success, found.status
    assert found.value == pytest.approx(wanted.value, rel=1e-8)
    np.testing.assert_allclose(found.w, wanted.w, atol=1e-4)


def test_least_time_is_found():
    settings = {"objective": "time", "duration": (0.2, 0.5), "intervals": 12, "tolerance": 0.01}
    plan, other = planned(settings), planned(settings, solver="ipopt")
    assert plan.success and other.success
    assert plan.report["objective"] <= 1.05 * other.report["objective"]


def test_least_energy_goes_on_from_an_optimum():
    settings = {"objective": "energy"}
    near = planned(settings, solver="ipopt")
    plan = planned(settings, guess=near)
    assert plan.report["converged"], plan.report["status"]


def test_plans_are_true_and_keep_their_bounds_between_nodes():
    plan = planned({}, intervals=12, tolerance=0.01, track=True)
    report = plan.report
    assert plan.success and report["open_loop_attitude_error_deg"] <= 0.01
    assert report["status"] == "Solve_Succeeded" and report["bound_excess"] <= 1e-3
    q, v = integrated(rat(), plan)
    assert tilt_deg(q[3:7]) <= 0.02 and np.abs(v[3:6]).max() <= 0.1


def test_control_intervals_share_their_polynomial():
    plan = planned({}, intervals=12, controls=4)
    assert plan.report["converged"] and plan.mesh.controls.tolist() == sorted([*range(4)] * 3)
    for k in range(4):
        inside = plan.torque(np.linspace(0.1 * k + 0.001, 0.1 * k + 0.099, 9))
        assert np.abs(np.diff(inside, n=3, axis=0)).max() < 1e-12
    assert plan.report["objective"] == pytest.approx(
        planned({}, solver="ipopt", intervals=12, controls=4, guess=plan).report["objective"],
        rel=1e-5,
    )


def test_states_have_a_finer_mesh_than_torques():
    plan = planned({}, intervals=12, tolerance=1e-4)
    assert plan.success and plan.report["rounds"] > 1 and plan.mesh.intervals > 12
    assert sorted(set(plan.mesh.controls)) == [*range(12)]


FIRST_MESHES = [  # segments, what is given, intervals of each first mesh, control intervals
    (1, {}, (12, 144), 12),
    (1, {"intervals": 6}, (6,), 6),
    (1, {"controls": 5}, (5, 60), 5),
    (1, {"most_intervals": 100}, (12,), 12),
    (1, {"intervals": 24}, (24,), 12),
    (3, {}, (48, 144), 12),
    (3, {"controls": 5}, (20, 60), 5),
    (3, {"controls": 5, "intervals": 10}, (10,), 5),
    (6, {}, (144,), 12),
]


@pytest.mark.parametrize(("segments", "given", "intervals", "controls"), FIRST_MESHES)
def test_first_meshes_are_finer_for_longer_tails(segments, given, intervals, controls):
    settings = {"intervals": None, "controls": None, "most_intervals": None} | given
    model = SimpleNamespace(segments=segments)
    meshes = STAGED.meshes(SimpleNamespace(model=model, settings=SimpleNamespace(**settings)))
    assert tuple(mesh.intervals for mesh in meshes) == intervals
    assert {mesh.controls[-1] + 1 for mesh in meshes} == {controls}


@pytest.mark.slow
def test_a_search_that_fails_begins_again_from_a_finer_mesh():
    model, found = rat(2), []
    settings = {"start": righting.tumbling(model, 22), "duration": (0.3, 0.58), "track": False}
    settings |= {"solver": "fatrop", "bounds": righting.bounds(model, 2 * np.pi)}
    assert not st.plan(model, **settings, most_intervals=100).success  # too few for a second mesh
    plan = st.plan(model, **settings, watch=lambda each: found.append(each.mesh.intervals))
    assert plan.success and found[0] == 12 and 144 in found[1:]


def test_planning_again_from_a_plan_takes_fewer_iterations():
    fresh = planned({})
    again = planned({}, guess=fresh)
    assert again.report["converged"] and again.report["iterations"] < fresh.report["iterations"]
    assert again.report["objective"] == pytest.approx(fresh.report["objective"], rel=1e-6)
    other = planned({}, guess=fresh, solver="ipopt")  # takes what FATROP made, too
    assert other.report["converged"]


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"formulation": "full"}, "formulation is 'full': it takes 'airborne'"),
        ({"attitude": "euler"}, "attitude is 'euler': it takes 'quaternion'"),
        ({"rule": "lobatto"}, "rule is 'lobatto': it takes 'radau'"),
        ({"objective": lambda point: point.tail[0] ** 2}, "objective is a function"),
        ({"path": ((lambda point: point.height, 0.0, np.inf),)}, "path or clearance is given"),
        ({"bounds": st.Bounds(torque_rate=1.0)}, "bounds.torque_rate is given: leave it out"),
        ({"options": {"fatrop.max_itr": 5}}, "'fatrop.max_itr': FATROP has no such setting"),
        ({"options": {"ipopt.max_iter": 5}}, "'ipopt.max_iter': FATROP has no such setting"),
        ({"options": {"fatrop.max_iter": "5"}}, "fatrop.max_iter: value '5': needs a number"),
        ({"options": {"fatrop.mu_init": np.nan}}, "fatrop.mu_init: value nan: needs a number"),
    ],
)
def test_what_stages_do_not_take_is_refused(settings, words):
    with pytest.raises(st.PlanningError) as caught:
        planned(settings)
    assert words in str(caught.value)


def test_models_without_functions_of_nodes_are_refused():
    lacking = st.load(model_folder(1, 3, functions=list(dict.fromkeys(FUNCTIONS))))
    with pytest.raises(st.PlanningError) as caught:
        st.plan(lacking, start=start(lacking), duration=DURATION, solver="fatrop")
    for words in ("lacks airborne_rates, ", "scene's functions, or take solver='ipopt'"):
        assert words in str(caught.value)


ENDLESS = {"fatrop.tolerance": 1e-300, "fatrop.max_iter": 10**6, "fatrop.print_level": 0}


def test_interrupt_in_a_solve_returns_its_iterate():
    """Ctrl-C in a solve that would take a million iterations."""
    before = signal.getsignal(signal.SIGINT)
    timer = threading.Timer(0.5, signal.raise_signal, (signal.SIGINT,))
    timer.start()
    plan = planned({}, intervals=40, options=ENDLESS)
    timer.join()
    assert not plan.success and np.isfinite(plan.solution.w).all()
    assert (plan.report["stopped"], plan.report["status"]) == ("interrupt", "User_Requested_Stop")
    assert signal.getsignal(signal.SIGINT) is before


def test_time_limit_ends_a_solve_inside():
    begun = time.perf_counter()
    plan = planned({}, intervals=40, options=ENDLESS, time_limit=0.5)
    assert 0.5 <= time.perf_counter() - begun < 30.0
    assert (plan.success, plan.report["stopped"], plan.report["guesses"]) == (
        False,
        "time limit",
        1,
    )


def test_what_is_raised_while_a_solve_goes_on_is_raised_after_it(monkeypatch):
    def interrupted():
        raise KeyboardInterrupt

    monkeypatch.setattr(fatrop, "stop_reason", interrupted)
    with pytest.raises(KeyboardInterrupt):
        planned({})


def _run(**changes):
    """FATROP's status of a problem, some of whose task has been changed, from rest."""
    model = rat()
    refused = Refusals(st.PlanningError)
    task = (start(model), st.Goal(), DURATION, st.Bounds(angle=np.pi / 3))
    settings = {
        "objective": "effort",
        "smoothing": 3e-4,
        "damping": 0.0,
        "path": (),
        "legs": None,
        "clearance": None,
    }
    forms = {"formulation": "airborne", "attitude": "quaternion"}
    problem = checked_problem(model, task, settings | forms, refused)
    stages = stages_of(model, problem, uniform(6), collocation_rule("radau", 3))
    first = np.concatenate([problem.q0[3:], problem.v0[6:] / 10])
    w = np.zeros(stages.indices.size)
    w[0] = DURATION
    w[stages.indices.states] = first
    owned = fatrop.task_of(stages, first, np.zeros(10), 1.0)
    for name, value in changes.items():
        owned.arrays[name] = value
        setattr(owned.task, name, value.ctypes.data)
    variables, states = fatrop.packed(stages, w)
    outcome, found, *_ = fatrop._run(owned, variables, states, fatrop.options_of({}, "far"))
    return outcome.status, found, variables


def test_bounds_that_exclude_each_other_are_told_before_anything_is_solved():
    """Magnitudes below zero, which ``Bounds`` refuses, make least limits above the largest."""
    for name in ("most_torque", "most_angle"):
        status, found, variables = _run(**{name: np.array([-1.0, 1.0])})
        assert fatrop.STATUSES[status] == "No_Room_Between_Bounds"
        np.testing.assert_array_equal(found, variables)


def test_a_guess_without_collocation_is_told():
    status, *_ = _run(momentum=np.full(3, 1e6))
    assert fatrop.STATUSES[status] == "No_Collocation_Of_Guess"


def test_a_guess_without_collocation_is_returned():
    plan = planned({})
    stages, p = stages_of(rat(), plan.problem, plan.mesh, plan.rule), conserved(plan)
    p[:3] = 1e6
    engine = fatrop.engine_of({}, "close")
    found = fatrop.solve_stages(stages, blocks(plan), plan.solution.w, p, engine)
    assert (found.success, found.status) == (False, "No_Collocation_Of_Guess")
    np.testing.assert_array_equal(found.w, plan.solution.w)


def test_headers_are_those_of_the_library():
    """The structures of FATROP's interface are compiled from the headers beside its library."""
    import casadi

    assert fatrop.library()._name.startswith(str(casadi.GlobalOptions.getCasadiPath()))
    settings = fatrop.options_of({"fatrop.max_iter": 7}, "far")
    assert {option.name: option.kind for option in settings}[b"max_iter"] == 1
