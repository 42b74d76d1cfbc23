"""Plans: formulations agree, laws hold, and the truth that a report tells is that of an independent
integration.
"""

import re
import shutil
import signal
import threading
import time
from dataclasses import replace
from pathlib import Path

import casadi
import numpy as np
import pytest
from scipy.integrate import solve_ivp

import serpentail as st
from serpentail.attitude import angle_deg, from_angles, rotation_matrix
from serpentail.planning import rounds
from serpentail.planning.nlp import interrupt, solver, transcription
from serpentail.planning.nlp.blas_threads import _blas, one_thread
from serpentail.planning.nlp.coordinates import Attitude
from serpentail.planning.nlp.multipliers import carried
from serpentail.planning.nlp.node import dynamics
from serpentail.planning.nlp.transcription import program_of
from serpentail.planning.result.full_state import full_state
from serpentail.planning.result.truth import local_errors, open_loop
from serpentail_codegen.scene.parse import load_scene
from tests.support.models import folder_of, model_folder
from tests.support.tumbling import DURATION, FUNCTIONS, planned, rat, start

FORMS = [
    ("airborne", "quaternion"),
    ("translation-free", "quaternion"),
    ("full", "quaternion"),
    ("full", "euler"),
]
every_form = pytest.mark.parametrize(("formulation", "attitude"), FORMS)


def rate(model, plan):
    """y -> y_dot of (q, v) under the plan's torques, by NumPy."""

    def y_dot(t, y):
        q, v = y[: model.nq], y[model.nq :]
        w, x, y_, z = q[3:7]
        a, b, c = v[3:6]
        turn = [
            -x * a - y_ * b - z * c,
            w * a + y_ * c - z * b,
            w * b - x * c + z * a,
            w * c + x * b - y_ * a,
        ]
        tau = plan.torque(t)[0] - plan.problem.damping * v[6:]
        return np.concatenate([v[:3], np.array(turn) / 2, v[6:], model.forward_dynamics(q, v, tau)])

    return y_dot


def integrated(model, plan):
    """The state at the end, by SciPy's DOP853 from interval to interval."""
    y = np.concatenate([plan.problem.q0, plan.problem.v0])
    for a, b in zip(plan.curve.ends[:-1], plan.curve.ends[1:], strict=True):
        inside = np.nextafter(b, a)  # torques may jump at the ends
        y = solve_ivp(rate(model, plan), (a, inside), y, "DOP853", rtol=1e-11, atol=1e-12).y[:, -1]
    return y[: model.nq], y[model.nq :]


@every_form
def test_plans_of_all_formulations_reach_the_goal_in_truth(formulation, attitude):
    plan = planned(
        formulation=formulation, attitude=attitude, guess=planned()
    )  # one of several optima
    report = plan.report
    assert plan.success and report["converged"] and report["dynamics"] == "compiled"
    assert report["open_loop_attitude_error_deg"] <= 0.01
    end = plan.trajectory
    assert st.pitch_roll_yaw(end.q[-1])[:2] == pytest.approx([0, 0], abs=1e-6)
    np.testing.assert_allclose(end.v[-1, 3:6], 0, atol=1e-6)
    assert np.abs(end.tail).max() <= np.pi / 3 + 1e-3 and np.abs(end.tau).max() <= 0.02 + 1e-6
    assert report["objective"] == pytest.approx(planned().report["objective"], rel=2e-3)


@every_form
def test_truth_is_that_of_an_independent_integration(formulation, attitude):
    plan = planned(formulation=formulation, attitude=attitude)
    q, v = integrated(rat(), plan)
    end = plan.trajectory.attitude[-1]
    assert plan.report["open_loop_attitude_error_deg"] == pytest.approx(
        angle_deg(q[3:7] / np.linalg.norm(q[3:7]), end), abs=1e-5
    )
    assert plan.report["open_loop_rate_error"] == pytest.approx(
        np.abs(v[3:] - plan.trajectory.v[-1, 3:]).max(), abs=1e-5
    )
    np.testing.assert_allclose(q[:3], plan.trajectory.q[-1, :3], atol=1e-4)


def test_airborne_plans_conserve_momentum_between_their_nodes_too():
    flight = planned().trajectory
    assert np.ptp(flight.angular_momentum, axis=0).max() < 1e-15
    fall = flight.linear_momentum - flight.linear_momentum[0]
    np.testing.assert_allclose(
        fall, flight.t[:, None] * [0, 0, -9.8 * (0.10572 + 0.00351)], atol=1e-12
    )


def test_planned_positions_have_the_planned_velocities():
    flight = planned().trajectory
    dense = planned().curve
    times = np.linspace(0.01, DURATION - 0.01, 7)
    problem, step = planned().problem, 1e-6
    ends = [
        full_state(rat(), (problem.q0, problem.v0), Attitude("quaternion"), t, dense.at(t))
        for t in (times - step, times, times + step)
    ]
    slope = (ends[2][0][:, :3] - ends[0][0][:, :3]) / (2 * step)
    np.testing.assert_allclose(slope, ends[1][1][:, :3], atol=2e-3)
    assert flight.t[-1] == pytest.approx(DURATION)


def test_symbolic_and_compiled_dynamics_give_the_same_plan():
    one, other = (
        planned(dynamics=source, tolerance=None, intervals=8) for source in ("compiled", "symbolic")
    )
    assert (one.report["dynamics"], other.report["dynamics"]) == ("compiled", "symbolic")
    assert one.report["objective"] == pytest.approx(other.report["objective"], rel=1e-7)
    np.testing.assert_allclose(one.solution.w, other.solution.w, atol=1e-5)


def test_scene_without_derivatives_takes_the_symbolic_dynamics():
    model = rat(exact=False)
    plan = st.plan(
        model, start=start(model), duration=DURATION, intervals=6, tolerance=None, track=False
    )
    assert plan.report["dynamics"] == "symbolic" and plan.report["converged"]
    with pytest.raises(st.ModelError, match="generated without"):
        st.plan(model, start=start(model), duration=DURATION, dynamics="compiled")


def test_refinement_reduces_the_true_error():
    coarse = planned(intervals=4, tolerance=None).report
    fine = planned(intervals=4, tolerance=1e-3).report
    assert fine["rounds"] > 1 and fine["intervals"] > 4
    assert fine["open_loop_attitude_error_deg"] <= 1e-3 < coarse["open_loop_attitude_error_deg"]


def test_multipliers_are_carried_to_another_mesh():
    """The solver, given none, finds the same ones there; on the mesh itself they stay."""
    settings = AGAIN | {"start": start(rat()), "bounds": st.Bounds(angle=0.45)}
    programs, solutions, plan = [], [], None
    for intervals in (24, 36):
        # One of several optima: the other mesh begins at the first one's.
        plan = st.plan(rat(), intervals=intervals, guess=plan, **settings)
        programs.append(program_of(rat(), plan.problem, plan.mesh, plan.rule, dynamics(rat())))
        solutions.append(plan.solution.multipliers)
    assert np.abs(solutions[0][0]).max() > 1e-3  # a bound is active
    for kept, given in zip(
        carried(solutions[0], programs[0], programs[0]), solutions[0], strict=True
    ):
        np.testing.assert_allclose(kept, given, atol=1e-12)
    for found, wanted in zip(carried(solutions[0], *programs), solutions[1], strict=True):
        assert np.linalg.norm(found - wanted) < 1e-3 * np.linalg.norm(wanted)


def test_refinement_goes_on_from_the_multipliers(monkeypatch):
    model, settings = rat(), AGAIN | {"intervals": 8, "tolerance": 1e-4}
    iterations = []
    for carry in (carried, lambda *_: None):
        monkeypatch.setattr(rounds, "carried", carry)
        plan = st.plan(model, start=start(model), **settings)
        assert plan.success and plan.report["rounds"] > 1
        iterations.append(plan.report["iterations"])
    assert iterations[0] < iterations[1]


def test_what_cannot_be_refined_is_flagged():
    plan = planned(rule="trapezoidal", intervals=10, tolerance=1e-6, rounds=1)
    assert not plan.success and plan.report["converged"] and not plan.report["success"]
    assert plan.report["open_loop_attitude_error_deg"] > 1e-6


def test_planning_again_from_a_plan_takes_fewer_iterations():
    fresh, again = planned(tolerance=None), planned(tolerance=None, guess=planned(tolerance=None))
    assert again.report["converged"] and again.report["iterations"] < fresh.report["iterations"] / 2
    assert again.report["objective"] == pytest.approx(fresh.report["objective"], rel=1e-4)


def test_plans_are_the_same_in_two_runs():
    model, settings = (
        rat(),
        {"duration": DURATION, "intervals": 6, "tolerance": None, "track": False},
    )
    one, two = (st.plan(model, start=start(model), **settings) for _ in range(2))
    np.testing.assert_array_equal(one.solution.w, two.solution.w)


# What a problem may ask for.


def test_damping_is_part_of_the_motion():
    plan = planned(damping=1e-4)
    assert plan.success
    q, _ = integrated(rat(), plan)
    assert angle_deg(q[3:7] / np.linalg.norm(q[3:7]), plan.trajectory.attitude[-1]) < 0.011


def test_free_duration_least_time_is_shorter_and_at_its_bounds():
    model = rat()
    settings = {
        "start": start(model),
        "bounds": st.Bounds(angle=np.pi / 3, torque=0.005),
        "track": False,
    }
    plan = st.plan(model, duration=(0.05, 0.6), objective="time", tolerance=None, **settings)
    assert plan.report["converged"] and plan.duration < 0.9 * DURATION
    assert plan.report["objective"] == pytest.approx(plan.duration, rel=1e-6)
    assert np.abs(plan.trajectory.tau).max() > 0.9 * 0.005


def test_energy_plans_take_less_energy():
    coarse = {"tolerance": None, "intervals": 20}
    effort = planned(**coarse)
    least = planned(objective="energy", guess=effort, **coarse)
    assert least.report["converged"]
    assert least.report["energy_J"] < effort.report["energy_J"]


def test_rate_and_torque_rate_bounds_hold_at_the_nodes():
    model = rat()
    bounds = st.Bounds(angle=np.pi / 3, rate=4.0, torque_rate=0.04)
    plan = st.plan(
        model, start=start(model), duration=DURATION, bounds=bounds, tolerance=None, track=False
    )
    assert plan.report["converged"]
    assert np.abs(plan.curve.at(plan.curve.ends)["tail_rate"]).max() <= 4.0 + 1e-6
    nodes = plan.curve.nodes["torque"].reshape(-1, 2)
    times = (
        plan.curve.ends[:-1, None] + np.diff(plan.curve.ends)[:, None] * plan.rule.nodes
    ).ravel()
    steepest = np.max(np.abs(np.diff(nodes, axis=0)) / np.diff(times)[:, None])
    assert 0.039 < steepest <= 0.04 * (1 + 1e-6)


def test_goals_of_the_tail_and_of_a_whole_attitude():
    model, wanted = rat(), from_angles(np.array([0.1, -0.05, 0.2]))
    goal = st.Goal(attitude=wanted, torso_rate=None, tail=(0.1, None), tail_rate=(None, 0.0))
    plan = st.plan(
        model, start=start(model), goal=goal, duration=DURATION, tolerance=None, track=False
    )
    assert plan.report["converged"]
    end = plan.trajectory
    assert angle_deg(end.attitude[-1], wanted) < 1e-5
    assert end.tail[-1, 0] == pytest.approx(0.1, abs=1e-7) and end.v[-1, 7] == pytest.approx(
        0, abs=1e-6
    )


def test_effort_counts_rates_as_torques_of_a_damper():
    fine = {"tolerance": None, "intervals": 20}
    # Of several optima, which one is found from afar hangs on rounding: compare two of one valley.
    for plan in (planned(**fine), planned(**fine, smoothing=0.0, guess=planned(**fine))):
        flight, c = plan.trajectory, plan.problem.smoothing
        integrand = np.sum(flight.tau**2 + (c * flight.v[:, 6:]) ** 2, axis=1)
        assert plan.report["objective"] == pytest.approx(
            np.trapezoid(integrand, flight.t), rel=1e-2
        )
    assert plan.report["objective"] == pytest.approx(plan.report["effort"], rel=1e-12)
    assert plan.report["effort"] < planned(**fine).report["effort"]


def test_own_objective_and_path_constraint():
    settings = {"tolerance": None, "intervals": 8}
    plan = planned(objective=_bend, path=((_first_rate, -4.0, 9.0),), **settings)
    assert plan.report["converged"]
    assert plan.curve.at(plan.curve.ends)["tail_rate"][1:, 0].min() >= -4.0 - 1e-5
    bend = [
        np.trapezoid(np.sum(p.trajectory.tail**2, axis=1), p.trajectory.t)
        for p in (plan, planned(**settings))
    ]
    assert bend[0] < bend[1]


def _bend(point):
    return casadi.sumsqr(point.tail) + 1e-3 * casadi.sumsqr(point.torque / 1e-3)


def _first_rate(point):
    return point.tail_rate[0]


def test_solver_uses_one_thread_and_gives_back_the_others():
    blas = _blas()
    before = blas.openblas_get_num_threads()
    with one_thread():
        assert blas.openblas_get_num_threads() == 1
    assert blas.openblas_get_num_threads() == before


def test_several_guesses_are_at_least_as_good_as_one():
    one, many = (
        planned(tolerance=None, intervals=8),
        planned(tolerance=None, intervals=8, multi_start=3),
    )
    assert many.report["guesses"] >= 3 and many.report["objective"] <= one.report["objective"] * (
        1 + 1e-6
    )


@pytest.mark.slow
@pytest.mark.parametrize("size", [(1, None), (2, 3)])
def test_other_tails_reach_their_goal_in_truth(size):
    model = rat(*size)
    bounds = st.Bounds(angle=np.pi / 3, rate=30.0)
    plan = st.plan(
        model,
        start=start(model),
        duration=DURATION,
        bounds=bounds,
        damping=1e-5,
        tolerance=0.1,
        most_intervals=120,
    )
    assert plan.success and plan.report["tracked_attitude_error_deg"] < 0.2


def test_attitude_coordinates_agree():
    """Rates of both coordinates turn the same matrix."""
    random = np.random.default_rng(0)
    angles, omega, step = random.uniform(-1, 1, 3), random.normal(size=3), 1e-6
    for kind, c in (("euler", angles), ("quaternion", from_angles(angles))):
        coordinates = Attitude(kind)
        slope = np.array(coordinates.rate(casadi.DM(c), casadi.DM(omega))).ravel()
        R = [rotation_matrix(coordinates.as_quaternion(c + s * slope)) for s in (-step, step)]
        turn = rotation_matrix(from_angles(angles)).T @ (R[1] - R[0]) / (2 * step)
        np.testing.assert_allclose([turn[2, 1], turn[0, 2], turn[1, 0]], omega, atol=1e-9)
        np.testing.assert_allclose(
            np.array(coordinates.quaternion(casadi.DM(c))).ravel(), from_angles(angles)
        )


def test_torques_that_no_model_survives_are_an_infinite_error():
    """A motion that leaves what the model describes has no truth: nan from there on, never an
    exception.
    """
    plan, model = planned(tolerance=None), rat()
    wild = replace(
        plan.curve, nodes=plan.curve.nodes | {"torque": 1e9 + 0 * plan.curve.nodes["torque"]}
    )
    start = (plan.problem.q0, plan.problem.v0)
    assert np.isnan(np.concatenate(open_loop(model, wild, 0.0, start))).all()
    errors = local_errors(model, wild, 0.0, *(np.tile(x, (len(wild.ends), 1)) for x in start))
    assert np.isfinite(errors).all()


def test_example_of_the_document_runs(tmp_path, monkeypatch, capsys):
    root = Path(__file__).parents[2]
    folder = folder_of(load_scene(root / "scenes" / "righting_m1_n3.toml"))
    shutil.copytree(folder, tmp_path / "generated" / folder.name)
    monkeypatch.chdir(tmp_path)
    text = (root / "docs" / "planning.md").read_text()
    exec(re.search(r"```python\n(.*?)```", text, re.DOTALL)[1], {})
    good, error, _ = capsys.readouterr().out.split()
    assert good == "True" and float(error) <= 0.01


# Planning again, and being told to stop.

AGAIN = {
    "duration": DURATION,
    "bounds": st.Bounds(angle=np.pi / 3),
    "tolerance": None,
    "track": False,
}


def test_planning_again_from_neighbouring_states_derives_nothing(monkeypatch):
    model, (q, v) = rat(), start(rat())
    plan = st.plan(model, start=(q, v), **AGAIN)
    once = st.plan(model, start=(q, 1.005 * v), guess=plan, **AGAIN)
    for module, name in ((transcription, "transcribe"), (solver, "_engine")):
        monkeypatch.setattr(module, name, lambda *_: pytest.fail("derived again"))
    again = st.plan(model, start=(q, 1.01 * v), guess=once, **AGAIN)
    assert again.report["converged"] and again.report["iterations"] <= 8
    np.testing.assert_allclose(again.trajectory.v[0, 3:], 1.01 * v[3:], atol=1e-9)


def test_other_problems_and_models_share_no_program():
    """A kept program answers for its own problem only: damping, goal and model all matter."""
    model, coarse = rat(), {"intervals": 4}
    tilted = st.Goal(attitude=from_angles(np.array([0.1, 0, 0])))
    found = [
        st.plan(model, start=start(model), **AGAIN, **coarse, **own)
        for own in ({}, {"damping": 1e-3})
    ]
    found += [st.plan(model, start=start(model), goal=tilted, **AGAIN, **coarse)]
    heavy = st.load(
        model_folder(1, 3, functions=list(dict.fromkeys(FUNCTIONS))),
        parameters={"tail_mass": 0.005},
    )
    found += [st.plan(heavy, start=start(model), **AGAIN, **coarse)]
    assert len({plan.report["objective"] for plan in found}) == 4
    again = st.plan(model, start=start(model), **AGAIN, **coarse)
    np.testing.assert_array_equal(again.solution.w, found[0].solution.w)


ENDLESS = {"ipopt.tol": 1e-300, "ipopt.acceptable_iter": 0, "ipopt.max_iter": 10**6}


def test_interrupt_in_the_first_solve_returns_its_iterate():
    """Ctrl-C in a solve that would take a million iterations."""
    model, common = rat(), AGAIN | {"start": start(rat()), "intervals": 40, "options": ENDLESS}
    st.plan(model, **common, time_limit=0.01)  # derives before signals are heeded
    before = signal.getsignal(signal.SIGINT)
    timer = threading.Timer(0.3, signal.raise_signal, (signal.SIGINT,))
    timer.start()
    plan = st.plan(model, **common)
    timer.join()
    assert not plan.success and np.isfinite(plan.solution.w).all()
    assert (plan.report["stopped"], plan.report["status"]) == ("interrupt", "User_Requested_Stop")
    assert signal.getsignal(signal.SIGINT) is before


def test_interrupt_in_a_later_round_returns_the_round_before(monkeypatch):
    split = rounds.Run._split

    def interrupted(run, last):
        signal.raise_signal(signal.SIGINT)
        return split(run, last)

    monkeypatch.setattr(rounds.Run, "_split", interrupted)
    plan = st.plan(
        rat(), start=start(rat()), intervals=6, **AGAIN | {"tolerance": 1e-9, "rounds": 30}
    )
    assert not plan.success and plan.report["converged"]
    assert (plan.report["stopped"], plan.report["intervals"]) == ("interrupt", 6)


def test_time_limit_ends_a_solve_inside_and_returns_its_iterate():
    """A solve that would take a million iterations; a limit that is not reached changes nothing."""
    model = rat()
    common = AGAIN | {"start": start(model), "intervals": 40, "options": ENDLESS}
    st.plan(model, **common, time_limit=0.01)  # derives
    begun = time.perf_counter()
    cut = st.plan(model, **common, time_limit=0.5)
    assert 0.5 <= time.perf_counter() - begun < 30.0
    assert (cut.success, cut.report["stopped"], cut.report["guesses"]) == (False, "time limit", 1)
    assert cut.report["status"] == "User_Requested_Stop" and cut.report["iterations"] > 1
    free, limited = (
        st.plan(model, start=start(model), intervals=6, **AGAIN, **own)
        for own in ({}, {"time_limit": 60})
    )
    assert limited.report["stopped"] is None and limited.success
    np.testing.assert_array_equal(free.solution.w, limited.solution.w)


def test_time_limit_ends_refinement_with_the_best_round(monkeypatch):
    """Between rounds: what was solved before is kept, and is good for all but the tolerance."""
    model, settings = rat(), AGAIN | {"intervals": 6, "tolerance": 1e-12}
    monkeypatch.setattr(rounds, "asked", lambda: "time limit")
    cut = st.plan(model, start=start(model), **settings)
    assert not cut.success and cut.report["converged"]
    assert (cut.report["stopped"], cut.report["rounds"]) == ("time limit", 1)


def test_time_limits_are_of_one_thread():
    found = {}

    def other():
        with interrupt.heeded(3600.0):
            found["other"] = interrupt.asked()

    with interrupt.heeded(1e-9):
        thread = threading.Thread(target=other)
        thread.start()
        thread.join()
        assert (interrupt.asked(), found["other"]) == ("time limit", None)


def test_second_interrupt_is_the_usual_one():
    with pytest.raises(KeyboardInterrupt), interrupt.heeded():
        signal.raise_signal(signal.SIGINT)
        assert interrupt.asked()
        signal.raise_signal(signal.SIGINT)
    with interrupt.heeded():
        assert not interrupt.asked()
