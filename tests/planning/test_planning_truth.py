"""What a plan is called true for: its end, its bounds between nodes, its energy, by other means."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import BPoly

import serpentail as st
from serpentail.planning.nlp.coordinates import attitude
from serpentail.planning.nlp.rules import collocation_rule
from serpentail.planning.result.full_state import full_state
from tests.support.models import model_folder
from tests.support.tumbling import DURATION, FUNCTIONS, planned, rat, rate, start

WEAK = st.Bounds(angle=np.pi / 3, torque=1.5e-3)  # N m: an eighth of what the plan would like


def dense(plan, count=4001):
    """Times and torques of a plan, far more than it has nodes."""
    times = np.linspace(0, plan.duration, count)
    return times, plan.torque(times)


@pytest.mark.parametrize("name", ["radau", "lobatto", "hermite-simpson", "trapezoidal"])
def test_bernstein_coefficients_are_those_of_scipy_and_bound_the_polynomial(name):
    rule = collocation_rule(name)
    values = np.random.default_rng(0).normal(size=len(rule.nodes))
    coefficients = rule.bernstein() @ values
    s = np.linspace(0, 1, 201)
    np.testing.assert_allclose(
        BPoly(coefficients[:, None], [0, 1])(s), rule.basis(s) @ values, atol=1e-13
    )
    assert np.abs(rule.basis(s) @ values).max() <= np.abs(coefficients).max() + 1e-13


def test_energy_and_power_are_those_of_an_independent_flight():
    model, plan = rat(), planned()
    y_dot, energy, peak = rate(model, plan), 0.0, 0.0
    y = np.concatenate([plan.problem.q0, plan.problem.v0, [0.0]])

    def power(t, y):
        return np.abs(plan.torque(t)[0] * y[model.nq + 6 : -1]).sum()

    for ends in zip(plan.curve.ends[:-1], plan.curve.ends[1:] - 1e-13, strict=True):
        motion = solve_ivp(
            lambda t, y: np.append(y_dot(t, y[:-1]), power(t, y)),
            ends,
            y,
            method="DOP853",
            rtol=1e-10,
            atol=1e-12,
            max_step=1e-3,
        )
        y, energy = motion.y[:, -1], motion.y[-1, -1]
        peak = max(peak, *map(power, motion.t, motion.y.T))
    assert plan.report["energy_J"] == pytest.approx(energy, rel=1e-5)
    assert plan.report["peak_power_W"] == pytest.approx(peak, rel=1e-3)


def test_bounds_hold_between_nodes():
    """The first round goes beyond the torque's bound, and says so; the last does not."""
    settings = {"start": start(rat()), "duration": DURATION, "bounds": WEAK, "track": False}
    goal = st.Goal(torso_rate=None)
    first = st.plan(rat(), goal=goal, rounds=0, **settings)
    beyond = np.abs(dense(first)[1]).max() / 1.5e-3 - 1
    assert beyond > 0.01 and not first.success
    assert first.report["bound_excess"] == pytest.approx(beyond, rel=0.02)
    assert first.report["bound_excess_of"] == "torque"

    plan = st.plan(rat(), goal=goal, **settings)
    assert plan.success and plan.report["bound_excess"] <= 1e-3
    times, torques = dense(plan)
    assert np.abs(torques).max() / 1.5e-3 - 1 <= 1e-3
    assert np.abs(plan.curve.at(times)["tail"]).max() / (np.pi / 3) - 1 <= 1e-3


@pytest.mark.parametrize(("rule", "degree"), [("radau", 3), ("radau", 1), ("lobatto", 3)])
def test_torques_are_never_steeper_than_their_bound(rule, degree):
    """Between nodes, and from interval to interval."""
    bounds = st.Bounds(angle=np.pi / 3, torque_rate=0.04)
    plan = st.plan(
        rat(),
        start=start(rat()),
        duration=DURATION,
        bounds=bounds,
        rule=rule,
        degree=degree,
        intervals=30 if degree == 1 else 12,
        tolerance=None,
        track=False,
    )
    times, torques = dense(plan)
    if degree == 1:  # steps, each over an interval
        times, torques = plan.curve.ends[1:], plan.curve.nodes["torque"][:, 0]
    steepest = np.abs(np.diff(torques, axis=0) / np.diff(times)[:, None]).max()
    assert plan.report["converged"] and 0.039 < steepest <= 0.04 * (1 + 1e-5)
    assert plan.report["bound_excess"] < 1e-5


def test_path_constraints_are_judged_between_nodes():
    rows = ((_first_rate, -3.7, 9.0),)
    coarse = planned(path=rows, rounds=0, intervals=8)
    rates = coarse.curve.at(np.linspace(0, DURATION, 4001))["tail_rate"][:, 0]
    beyond = (-3.7 - rates.min()) / 9
    assert beyond > 1e-3 and not coarse.success
    assert coarse.report["bound_excess"] == pytest.approx(beyond, rel=0.02)
    assert coarse.report["bound_excess_of"] == "path"
    fine = planned(path=rows, intervals=8)
    assert fine.success and fine.report["bound_excess"] <= 1e-3


@pytest.mark.parametrize("name", ["tail_tolerance", "rate_tolerance"])
def test_success_asks_for_tail_and_rates_too(name):
    settings = {"intervals": 40, "rounds": 0}
    assert planned(**settings).success
    assert not planned(**settings, **{name: 1e-9}).success
    report = planned(**settings, **{name: None}).report
    assert report["success"] and report["open_loop_tail_error_deg"] > 1e-9


def _first_rate(point):
    return point.tail_rate[0]


def test_errors_of_tracking_are_those_of_a_simulation_that_tracks():
    """From the first sample to the last, by Tsit5 where the report has SciPy's DOP853."""
    model, bounds = rat(), st.Bounds(angle=np.pi / 3)
    begin = {"start": start(model), "duration": DURATION}
    plan = st.plan(model, **begin, bounds=bounds, intervals=8, tolerance=None)
    law = st.Pfl(model, plan, torque=plan.problem.bounds.torque)
    how = {"t_span": DURATION, "method": "tsit5", "rtol": 1e-9, "output_step": 1e-4}
    run = st.simulate(model, *start(model), controller=law, **how)
    tail = np.column_stack([np.interp(plan.trajectory.t, run.t, angle) for angle in run.tail.T])
    error = np.abs(tail - plan.trajectory.tail).max()
    assert plan.report["tracked_tail_error_rad"] == pytest.approx(error, rel=0.01)


def test_arcs_are_bent_as_far_as_their_range_at_most():
    model = st.load(model_folder(1, None, bend_range=1.0, functions=FUNCTIONS))
    at_rest, tail = start(model), np.array([[0.3, 0.4], [0.9, 1.2], [0.0, 0.0]])
    blocks = {
        "tail": tail,
        "tail_rate": np.zeros((3, 2)),
        "torso_rate": np.zeros((3, 3)),
        "attitude": np.tile([1.0, 0.0, 0.0, 0.0], (3, 1)),
    }
    q, _ = full_state(model, at_rest, attitude("quaternion"), np.zeros(3), blocks)
    np.testing.assert_allclose(q[:, 7:], [[0.3, 0.4], [0.6, 0.8], [0.0, 0.0]], rtol=1e-11)
    model.energy(q, np.zeros((3, model.nv)))  # takes them


def test_a_guess_that_leaves_the_range_serves_until_there():
    model = st.load(model_folder(1, None, bend_range=1.0, functions=FUNCTIONS))
    q, v = start(model)
    v[6], damping = 20.0, 1e-5  # rad/s, N m s/rad
    with pytest.raises(st.SimulationError, match="bend_range"):
        st.simulate(model, q, v, t_span=0.4, controller=st.Damping(damping))
    settings = {"bounds": st.Bounds(angle=0.7, torque=0.05), "guess_damping": damping}
    plan = st.plan(model, start=(q, v), duration=(0.3, 1.0), track=False, **settings)
    assert plan.success and np.hypot(*plan.trajectory.tail.T).max() < 1
