"""What a plan is called true for, by other means: its end, laws, bounds between nodes, energy."""

import time
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicHermiteSpline

import serpentail as st
from serpentail.basics.attitude import angle_deg
from serpentail.planning.result import report as result_report
from serpentail.planning.result.full_state import full_state
from serpentail.planning.result.truth import local_errors, open_loop
from tests.support import zoo
from tests.support.rows import row
from tests.support.tumbling import AGAIN, DURATION, integrated, keyed, planned, rat, rate, start


def dense(plan, count=4001):
    times = np.linspace(0, plan.duration, count)
    return times, plan.torque(times)


def test_plans_reach_the_goal_in_truth():
    """Compiled dynamics and that of CasADi's operations: one optimum, and its end by an independent
    integration.
    """
    tail = start(rat())[0][7:]
    free = {"free_start": {"tail": (tail - 1e-6, tail + 1e-6)}}
    for solver, asked in (("fatrop", {}), ("ipopt", {}), ("fatrop", free)):
        given = AGAIN | {"start": start(rat()), "tolerance": 0.01, "guess": planned()}
        plan = keyed(rat(), **given, solver=solver, **asked)
        report, end, (q, v) = plan.report, plan.trajectory, integrated(rat(), plan)
        with row(solver, *asked):
            assert plan.success and report["converged"] and report["solver"] == solver
            assert report["dynamics"] == ("symbolic" if asked else "compiled")
            assert report["open_loop_attitude_error_deg"] <= 0.01
            assert st.pitch_roll_yaw(end.q[-1])[:2] == pytest.approx([0, 0], abs=1e-6)
            np.testing.assert_allclose(end.v[-1, 3:6], 0, atol=1e-6)
            assert np.abs(end.tail).max() <= np.pi / 3 + 1e-3
            assert np.abs(end.tau).max() <= 0.02 + 1e-6
            assert report["objective"] == pytest.approx(planned().report["objective"], rel=2e-3)
            off = angle_deg(q[3:7] / np.linalg.norm(q[3:7]), end.attitude[-1])
            assert report["open_loop_attitude_error_deg"] == pytest.approx(off, abs=1e-5)
            worst = np.abs(v[3:] - end.v[-1, 3:]).max()
            assert report["open_loop_rate_error"] == pytest.approx(worst, abs=1e-5)
            np.testing.assert_allclose(q[:3], end.q[-1, :3], atol=1e-4)


def test_airborne_plans_conserve_momentum_and_move_as_fast_as_they_say():
    flight, curve, problem, h = planned().trajectory, planned().curve, planned().problem, 1e-6
    assert np.ptp(flight.angular_momentum, axis=0).max() < 1e-15
    fall = flight.linear_momentum - flight.linear_momentum[0]
    weight = 9.8 * (0.10572 + 0.00351)
    np.testing.assert_allclose(fall, flight.t[:, None] * [0, 0, -weight], atol=1e-12)
    times, origin = np.linspace(0.01, DURATION - 0.01, 7), (problem.q0, problem.v0)
    (behind, _), (_, v), (ahead, _) = (
        full_state(rat(), origin, t, curve.at(t)) for t in (times - h, times, times + h)
    )
    np.testing.assert_allclose((ahead - behind)[:, :3] / (2 * h), v[:, :3], atol=2e-3)
    assert flight.t[-1] == pytest.approx(DURATION)


def test_energy_and_power_are_those_of_an_independent_flight():
    model, plan = rat(), planned(tolerance=None, intervals=8)
    y_dot, peak = rate(model, plan), 0.0
    y = np.concatenate([plan.problem.q0, plan.problem.v0, [0.0]])

    def power(t, y):
        return np.abs(plan.torque(t)[0] * y[model.nq + 6 : -1]).sum()

    def slope(t, y):
        return np.append(y_dot(t, y[:-1]), power(t, y))

    how = {"method": "DOP853", "rtol": 1e-9, "atol": 1e-11, "max_step": 2e-3}
    for ends in zip(plan.curve.ends[:-1], plan.curve.ends[1:] - 1e-13, strict=True):
        motion = solve_ivp(slope, ends, y, **how)
        y = motion.y[:, -1]
        peak = max(peak, *map(power, motion.t, motion.y.T))
    assert plan.report["energy_J"] == pytest.approx(y[-1], rel=1e-5)
    assert plan.report["peak_power_W"] == pytest.approx(peak, rel=2e-3)


def test_errors_of_tracking_are_those_of_a_simulation_that_tracks(monkeypatch):
    """By SciPy's DOP853, which calls Python: a plan's own flights are compiled, and nearly free."""
    model, tracked, spent = rat(), result_report.tracked, []

    def timed(*arguments):
        begun = time.process_time()
        motion = tracked(*arguments)
        spent.append(time.process_time() - begun)
        return motion

    monkeypatch.setattr(result_report, "tracked", timed)
    # so weak that tracking needs more, on a coarse mesh
    given = {"bounds": st.Bounds(np.pi / 3, torque=2e-3), "goal": st.Goal(torso_rate=None)}
    given = AGAIN | {"start": start(model), "intervals": 4, "track": True} | given
    told = keyed(model, **given).report
    assert told["solve_cpu_s"] < told["call_cpu_s"]
    flight = result_report.flight
    by_scipy = {"method": "dop853"}
    monkeypatch.setattr(result_report, "flight", lambda *of, **how: flight(*of, **how | by_scipy))
    plan = keyed(model, **given)
    assert spent[0] < 0.2 * spent[1]
    for name in ("tracked_attitude_error_deg", "tracked_tail_error_rad", "dyn_err"):
        assert told[name] == pytest.approx(plan.report[name], rel=0.03), name
    law = st.Pfl(model, plan.trajectory, torque=plan.problem.bounds.torque)
    how = {"t_span": DURATION, "method": "dop853", "rtol": 1e-9, "output_step": 1e-3}
    run = st.simulate(model, *start(model), controller=law, **how)
    tail = CubicHermiteSpline(run.t, run.tail, run.v[:, 6:])(plan.trajectory.t)
    error = np.abs(tail - plan.trajectory.tail).max()
    assert told["tracked_tail_error_rad"] == pytest.approx(error, rel=0.01)


def test_bounds_and_paths_hold_between_nodes():
    """Torques in every round; of others the first goes beyond, and says so; the last does not."""
    given = AGAIN | {"start": start(rat()), "tolerance": 0.01, "intervals": 8}
    # an eighth of the torque that the plan would like
    weak = {"bounds": st.Bounds(np.pi / 3, torque=1.5e-3), "goal": st.Goal(torso_rate=None)}
    for rounds in (0, 6):
        plan = keyed(rat(), **given | weak, rounds=rounds)
        largest = np.abs(dense(plan)[1]).max() / 1.5e-3 - 1
        assert plan.report["converged"] and -1e-3 < largest <= 1e-6

    def rate(plan):
        return plan.curve.at(dense(plan)[0])["tail_rate"][:, 0]

    slow = {"bounds": st.Bounds(np.pi / 3, rate=2.5), "goal": st.Goal(torso_rate=None)}
    path = {"path": ((lambda point: point.tail_rate[0], -3.7, 9.0),)}
    for name, asked, beyond in (
        (
            "rate",
            slow,
            lambda plan: np.abs(plan.curve.at(dense(plan)[0])["tail_rate"]).max() / 2.5 - 1,
        ),
        ("path", path, lambda plan: (-3.7 - rate(plan).min()) / 9),
    ):
        first, plan = (keyed(rat(), **given | asked | more) for more in ({"rounds": 0}, {}))
        off, report = beyond(first), first.report
        with row(name):
            assert off > 1e-3 and not first.success and report["bound_excess_of"] == name
            assert report["bound_excess"] == pytest.approx(off, rel=0.02)
            assert plan.success and plan.report["bound_excess"] <= 1e-3
            assert beyond(plan) <= 1e-3
            assert np.abs(plan.curve.at(dense(plan)[0])["tail"]).max() <= np.pi / 3 * 1.001


def test_torques_are_never_steeper_than_their_bound():
    given = AGAIN | {"start": start(rat())}
    given |= {"bounds": st.Bounds(angle=np.pi / 3, torque_rate=0.04)}
    for degree, intervals in ((3, 12), (1, 30), (2, 20)):
        plan = keyed(rat(), **given, degree=degree, intervals=intervals)
        times, torques = dense(plan)
        if degree == 1:  # steps, each over an interval
            times, torques = plan.curve.ends[1:], plan.curve.nodes["torque"][:, 0]
        steepest = np.abs(np.diff(torques, axis=0) / np.diff(times)[:, None]).max()
        with row(degree):
            assert plan.report["converged"] and 0.039 < steepest <= 0.04 * (1 + 1e-5)
            assert plan.report["bound_excess"] < 1e-5


def test_refinement_reduces_the_true_error_and_each_round_is_watched():
    plans, given = [], {"intervals": 4}
    found = planned(**given, tolerance=1e-3, watch=plans.append)
    rough, fine = planned(**given, tolerance=None).report, found.report
    assert len(plans) == fine["rounds"] > 1
    assert fine["open_loop_attitude_error_deg"] <= 1e-3 < rough["open_loop_attitude_error_deg"]
    assert [plan.report["rounds"] for plan in plans] == [k + 1 for k in range(len(plans))]
    sizes = [plan.mesh.intervals for plan in plans]
    assert sizes == sorted(set(sizes)) and sizes[0] == 4
    same = plans[sizes.index(found.mesh.intervals)].trajectory
    np.testing.assert_array_equal(same.q, found.trajectory.q)
    twin = planned(**given, tolerance=1e-3).solution.samples
    np.testing.assert_array_equal(twin.states, found.solution.samples.states)
    with pytest.raises(ZeroDivisionError):
        planned(**given, tolerance=None, watch=lambda _: 1 / 0)

    # without refinement a plan is flagged where it is not as true as was asked
    again = {"guess": planned(), "rounds": 0}
    assert planned(**again).success
    for name in ("tolerance", "tail_tolerance", "rate_tolerance"):
        plan = planned(**again, **{name: 1e-12})
        assert not plan.success and plan.report["converged"] and not plan.report["success"], name
        assert planned(**again, **{name: None}).success
    assert planned(**again).report["open_loop_tail_error_deg"] > 1e-12


def test_arcs_have_no_truth_beyond_their_range_and_are_bent_no_further():
    """Torques that no model survives are an infinite error, nan from there on: never raised."""
    plan, model = planned(tolerance=None, intervals=4), zoo.model("arcs1")
    torque = 1.0 + 0 * plan.curve.nodes["torque"]
    wild = replace(plan.curve, nodes=plan.curve.nodes | {"torque": torque})
    origin = (plan.problem.q0, plan.problem.v0)
    assert np.isnan(np.concatenate(open_loop(model, wild, 0.0, origin))).all()
    errors = local_errors(model, wild, 0.0, *(np.tile(x, (len(wild.ends), 1)) for x in origin))
    assert np.isfinite(errors).all() and errors.max() == np.pi

    most = model.manifest["scene"]["bend_range"]
    tail = most * np.array([[0.3, 0.4], [0.9, 1.2], [0.0, 0.0]])
    blocks = {"tail": tail, "tail_rate": np.zeros((3, 2)), "torso_rate": np.zeros((3, 3))}
    blocks["attitude"] = np.tile([1.0, 0.0, 0.0, 0.0], (3, 1))
    q, _ = full_state(model, start(model), np.zeros(3), blocks)
    kept = most * np.array([[0.3, 0.4], [0.6, 0.8], [0.0, 0.0]])
    np.testing.assert_allclose(q[:, 7:], kept, rtol=1e-11)
    model.energy(q, np.zeros((3, model.nv)))  # takes them


def test_a_guess_that_leaves_the_range_of_arcs_serves_until_there():
    model = zoo.model("arcs1")
    most = model.manifest["scene"]["bend_range"]
    (q, v), damping = start(model), 1e-5  # N m s/rad
    v[6] = 20.0 * most  # rad/s
    with pytest.raises(st.SimulationError, match="bend_range"):
        st.simulate(model, q, v, t_span=0.4, controller=st.Damping(damping))
    settings = {"bounds": st.Bounds(angle=0.7 * most, torque=0.05), "guess_damping": damping}
    plan = keyed(model, start=(q, v), duration=(0.3, 1.0), track=False, **settings)
    assert plan.success and np.hypot(*plan.trajectory.tail.T).max() < most
