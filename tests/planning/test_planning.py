"""Plans: formulations agree, laws hold, and what reports say is true is so by other means."""

from dataclasses import replace

import casadi
import numpy as np
import pytest

import serpentail as st
from serpentail.attitude import angle_deg, from_angles, rotation_matrix
from serpentail.planning import ways
from serpentail.planning.nlp.blas_threads import _blas, one_thread
from serpentail.planning.nlp.coordinates import Attitude
from serpentail.planning.nlp.equations import equations_of_motion
from serpentail.planning.nlp.multipliers import carried
from serpentail.planning.nlp.transcription import transcription_of
from serpentail.planning.result.full_state import full_state
from serpentail.planning.result.truth import local_errors, open_loop
from tests.support.tumbling import AGAIN, DURATION, integrated, planned, rat, start

FORMS = [
    ("airborne", "quaternion"),
    ("translation-free", "quaternion"),
    ("full", "quaternion"),
    ("full", "euler"),
]


every_form = pytest.mark.parametrize(("formulation", "attitude"), FORMS)


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
        programs.append(
            transcription_of(rat(), plan.problem, plan.mesh, plan.rule, equations_of_motion(rat()))
        )
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
        monkeypatch.setattr(ways, "SPARSE", replace(ways.SPARSE, carried=carry))
        plan = st.plan(model, start=start(model), **settings)
        assert plan.success and plan.report["rounds"] > 1
        iterations.append(plan.report["iterations"])
    assert iterations[0] < iterations[1]


def test_what_cannot_be_refined_is_flagged():
    plan = planned(rule="trapezoidal", intervals=10, tolerance=1e-6, rounds=1)
    assert not plan.success and plan.report["converged"] and not plan.report["success"]
    assert plan.report["open_loop_attitude_error_deg"] > 1e-6


def test_plans_are_the_same_in_two_runs():
    model, settings = (
        rat(),
        {"duration": DURATION, "intervals": 6, "tolerance": None, "track": False},
    )
    one, two = (st.plan(model, start=start(model), **settings) for _ in range(2))
    np.testing.assert_array_equal(one.solution.w, two.solution.w)


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
