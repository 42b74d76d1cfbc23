"""The paper's program: its laws by other means, its optimum beside `st.plan`, what it refuses."""

import signal
import threading
import time
from dataclasses import replace
from functools import cache, partial

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import BarycentricInterpolator, CubicSpline
from scipy.spatial.transform import Rotation

import serpentail as st
from examples.paper import truth
from examples.paper.collocation import RULES, UNITS, paper_plan
from tests.support import zoo
from tests.support.rows import row
from tests.support.tumbling import DURATION, rat, start

LIMITS = st.Bounds(angle=np.pi / 3, torque=0.02)
STEPS = {"trapezoidal": 1, "hermite-simpson": 2}  # of an interval
ORDERS = {"trapezoidal": 2, "hermite-simpson": 4}


@cache
def paper(rule="trapezoidal", nodes=61):
    return paper_plan(rat(), start(rat()), DURATION, LIMITS, rule, nodes)


def block(plan, name):
    return plan.states[:, plan.places[name]]


def attitude(angles):
    """R = Rz Rx Ry by SciPy."""
    return Rotation.from_euler("ZXY", np.asarray(angles)[..., [2, 0, 1]])


def integrated(model, plan, steps):
    """q, v at the end, the torques' polynomials through the nodes applied, by SciPy's DOP853."""
    y = np.concatenate(plan.start)

    def y_dot(t, y):
        q, v = y[: model.nq], y[model.nq :]
        w, e, omega = q[3], q[4:7], v[3:6]
        turn = [-e @ omega / 2, *(w * omega + np.cross(e, omega)) / 2]
        return np.concatenate([v[:3], turn, v[6:], model.forward_dynamics(q, v, tau(t))])

    for k in range(0, len(plan.times) - 1, steps):
        t = plan.times[k : k + steps + 1]
        powers = np.polyfit(t - t[0], plan.torques[k : k + steps + 1], steps)
        tau = partial(np.polyval, powers)
        y = solve_ivp(y_dot, (0, t[-1] - t[0]), y, "DOP853", rtol=1e-9, atol=1e-10).y[:, -1]
    return y[: model.nq], y[model.nq :]


def missed(model, plan, rule):
    """Distances of the plan's end from the truth, by block; the angles' is a rotation."""
    q, v = integrated(model, plan, STEPS[rule])
    end = {name: plan.states[-1, at] for name, at in plan.places.items()}
    turn = attitude(end["angles"]).inv() * Rotation.from_quat(q[3:7], scalar_first=True)
    off = {"angles": turn.as_rotvec(), "tail": q[7:] - end["tail"]}
    off |= {"torso_rate": v[3:6] - end["torso_rate"], "tail_rate": v[6:] - end["tail_rate"]}
    off |= {"position": q[:3] - end["position"], "velocity": v[:3] - end["velocity"]}
    return {name: np.linalg.norm(x) for name, x in off.items()}


def test_states_converge_to_the_true_ones_in_the_order_of_the_rule():
    for rule, order in ORDERS.items():
        coarse, fine = (missed(rat(), paper(rule, nodes), rule) for nodes in (31, 61))
        assert set(coarse) == set(UNITS)
        total = [sum(errors.values()) for errors in (coarse, fine)]
        with row(rule, total):
            assert 2 ** (order - 0.5) < total[0] / total[1] < 2 ** (order + 1)
            assert max(fine.values()) < {2: 0.3, 4: 1e-3}[order]


def test_ends_are_upright_and_at_rest_within_the_bounds():
    q, v = start(rat())
    for rule in RULES:
        plan = paper(rule, 61)
        with row(rule):
            assert plan.stats["converged"] and plan.stats["status"] == "Solve_Succeeded"
            assert set(plan.places) == set(UNITS)
            np.testing.assert_allclose(plan.times, np.linspace(0, DURATION, 61))
            up = attitude(block(plan, "angles")[-1]).apply([0, 0, 1])
            np.testing.assert_allclose(up, [0, 0, 1], atol=1e-12)
            np.testing.assert_allclose(block(plan, "torso_rate")[-1], 0, atol=1e-12)
            first = attitude(block(plan, "angles")[0]).as_quat(scalar_first=True)
            assert abs(first @ q[3:7]) == pytest.approx(1, abs=1e-12)
            np.testing.assert_allclose(block(plan, "tail")[0], q[7:], atol=1e-12)
            np.testing.assert_allclose(block(plan, "tail_rate")[0], v[6:], atol=1e-12)
            assert np.abs(block(plan, "tail")).max() <= np.pi / 3
            assert np.abs(plan.torques).max() <= 0.02


@pytest.mark.slow
def test_the_optimum_is_that_of_st_plan():
    """Where both find the same; on a fine mesh, and from the paper's flight, to many digits."""
    here = start(rat(), 6)
    task = {"start": here, "duration": DURATION, "bounds": LIMITS, "solver": st.Solver(track=False)}
    for settings, near in (({}, 0.02), ({"smoothing": 0.0}, 2e-3)):
        ours = st.plan(rat(), **task, **settings).report["effort"]
        for rule in RULES:
            with row(settings, rule):
                plan = paper_plan(rat(), here, DURATION, LIMITS, rule, 121)
                assert plan.stats["effort"] == pytest.approx(ours, rel=near)
    plan = paper("hermite-simpson", 121)
    flight = st.simulate(rat(), *plan.start, controller=plan.law, t_span=DURATION)
    task |= {"start": start(rat()), "smoothing": 0.0, "guess": flight}
    ours = st.plan(rat(), **task).report
    assert ours["success"] and ours["guesses"] == 1
    assert plan.stats["effort"] == pytest.approx(ours["effort"], rel=2e-5)


def test_the_effort_is_the_rule_s_integral_of_the_torques_it_applies():
    """In SI, also where each coordinate has a bound of its own, which it keeps."""
    bounds = st.Bounds(torque=(0.02, 0.002))
    times = np.linspace(0, DURATION, 4001)
    for rule in RULES:
        plan = paper_plan(rat(), start(rat()), DURATION, bounds, rule, 61)
        steps = STEPS[rule]
        applied, nodes = plan.law.torques.at(times)[0], plan.torques
        with row(rule):
            assert plan.stats["converged"]
            assert (np.abs(nodes).max(axis=0) <= [0.02, 0.002]).all()
            assert np.abs(nodes[:, 1]).max() > 0.0019  # the bound acts
            np.testing.assert_allclose(plan.law.torques.at(plan.times)[0], nodes, atol=1e-12)
            for k in range(0, 60, steps):
                through = BarycentricInterpolator(
                    plan.times[k : k + steps + 1], nodes[k : k + steps + 1]
                )
                inside = (times >= plan.times[k]) & (times <= plan.times[k + steps])
                np.testing.assert_allclose(applied[inside], through(times[inside]), atol=1e-12)
            squares, h = np.sum(nodes**2, axis=1), DURATION / 60
            weights = {1: np.ones(61), 2: 4 / 3 * np.ones(61)}[steps]
            weights[::steps] = {1: 1, 2: 2 / 3}[steps]
            weights[[0, -1]] /= 2
            assert plan.stats["effort"] == pytest.approx(h * weights @ squares, rel=1e-9)


def test_wrong_tasks_are_refused():
    q, v = start(rat())
    good = {"start": (q, v), "duration": DURATION, "bounds": LIMITS}
    for name, given, field in (
        ("rule", {"rule": "simpson"}, "rule: value 'simpson'"),
        ("few nodes", {"nodes": 2}, "nodes: value 2"),
        ("many nodes", {"nodes": 2001}, "nodes: value 2001"),
        ("half an interval", {"rule": "hermite-simpson", "nodes": 60}, "nodes: value 60"),
        ("duration", {"duration": (0.4, 0.3)}, r"duration: value \(0.4, 0.3\)"),
        ("no bounds", {"bounds": 0.02}, "bounds: value 0.02"),
        ("no torque", {"bounds": st.Bounds(torque=None)}, "bounds.torque: value None"),
        ("zero torque", {"bounds": st.Bounds(torque=(0.02, 0))}, "bounds.torque"),
        ("rates", {"bounds": st.Bounds(rate=20)}, "bounds.rate: value 20"),
        ("torque rates", {"bounds": st.Bounds(torque_rate=1)}, "bounds.torque_rate: value 1"),
        ("start", {"start": q}, "start: value"),
        ("bent start", {"bounds": st.Bounds(angle=0.01)}, "start: value"),
    ):
        with row(name), pytest.raises(st.PlanningError, match=field):
            paper_plan(rat(), **good | given)
    with pytest.raises(st.StateError, match="q0"):
        paper_plan(rat(), **good | {"start": (q[:-1], v)})
    for name in ("fixed", "ground"):
        with row(name), pytest.raises(st.ModelError, match="paper_plan"):
            paper_plan(zoo.model(name), **good)


def test_ctrl_c_ends_a_search_without_a_plan():
    """It comes while IPOPT runs, which cannot stop a torso at 60 rad/s, and would return a plan."""
    q, v = start(rat())
    v[3:6] = 60.0, 1.0, 2.0
    paper()
    threading.Timer(0.7, signal.raise_signal, [signal.SIGINT]).start()
    begun = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        paper_plan(rat(), (q, v), DURATION, LIMITS, nodes=201)
    assert time.monotonic() - begun < 20


# What the righting study reports.


def test_rows_have_the_true_flight():
    for rule, nodes in (("trapezoidal", 31), ("hermite-simpson", 61)):
        plan = paper(rule, nodes)
        found = truth.row(rat(), plan)
        off = np.degrees(missed(rat(), plan, rule)["angles"])
        with row(rule):
            assert found["open_loop_attitude_error_deg"] == pytest.approx(off, rel=1e-3, abs=1e-5)
            assert found["objective"] == found["effort"] == plan.stats["effort"]
            assert found["duration_s"] == pytest.approx(DURATION)
    task = {"start": plan.start, "duration": DURATION, "bounds": LIMITS, "smoothing": 0.0}
    flight = st.simulate(rat(), *plan.start, controller=plan.law, t_span=DURATION)
    ours = st.plan(rat(), **task, guess=flight, solver=st.Solver(track=False)).report
    assert found["energy_J"] == pytest.approx(ours["energy_J"], rel=1e-3)
    assert found["peak_power_W"] == pytest.approx(ours["peak_power_W"], rel=0.02)


def test_errors_of_tracking_are_those_of_a_tail_on_its_planned_path():
    """The torso misses what the mesh gets wrong; "dyn_err" is Eq. 50."""
    plan = paper("trapezoidal", 31)
    found = truth.tracked(rat(), plan)
    path = CubicSpline(plan.times, block(plan, "tail"))

    def law(t, q, v):  # Eq. 46 as it was used: without accelerations, and without a bound
        return rat().pfl(q, v, 400 * (path(t, 1) - v[6:]) + 4e4 * (path(t) - q[7:]))

    how = {"t_span": DURATION, "output_step": DURATION / 300, "method": "dop853"}
    flight = st.simulate(rat(), *plan.start, controller=law, **how)
    q, v = flight.q[::10], flight.v[::10]
    turns = Rotation.from_quat(q[:, 3:7], scalar_first=True)
    phi = turns.as_euler("ZXY")[:, [1, 2, 0]]
    off = np.column_stack([q[:, :3], phi, q[:, 7:], v]) - plan.states
    error = np.sqrt(np.trapezoid(np.sum(off**2, axis=1), plan.times))
    turn = attitude(block(plan, "angles")[-1]).inv() * turns[-1]
    assert found["dyn_err"] == pytest.approx(error, rel=1e-3) and error > 0.01
    missed = np.degrees(np.linalg.norm(turn.as_rotvec()))
    assert found["tracked_attitude_error_deg"] == pytest.approx(missed, rel=1e-3)
    most = np.abs(q[:, 7:] - block(plan, "tail")).max()
    assert found["tracked_tail_error_rad"] == pytest.approx(most, rel=0.01) and 1e-4 < most < 0.1


def test_a_flight_that_diverges_has_no_numbers():
    """A tail that turns a hundred times is beyond the model's range."""
    plan = paper("trapezoidal", 31)
    wild = replace(plan, law=st.TorqueTable([0, DURATION], np.full((2, 2), 5.0)))
    found = truth.row(rat(), wild)
    assert all(np.isnan(found[name]) for name in truth.TRUE) and found["converged"]
