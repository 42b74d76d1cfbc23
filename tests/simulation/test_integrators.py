"""Integration methods: coefficients fulfil their order conditions, and the generated loops keep
what these promise.
"""

import os
import signal
import subprocess
import sys
import time
from functools import cache
from itertools import combinations_with_replacement

import numpy as np
import pytest

import serpentail as st
from serpentail_codegen.targets.c.tableaux import RK4, ROS34PW2, TSIT5, transformed
from tests.support.models import model_folder

WANTED = ["forward_dynamics", "energy", "momentum", "rollout", "implicit", "pfl"]
ROUNDING = 3e-14  # coefficients of up to 88, printed with 16 digits


# Coefficients: order conditions by rooted trees (Butcher), and those of W-methods.


@cache
def trees(order):
    """Rooted trees of an order, as sorted tuples of their branches."""
    if order == 1:
        return [()]
    found = set()
    for count in range(1, order):
        smaller = [(size, tree) for size in range(1, order) for tree in trees(size)]
        for branches in combinations_with_replacement(smaller, count):
            if sum(size for size, _ in branches) == order - 1:
                found.add(tuple(sorted(tree for _, tree in branches)))
    return sorted(found)


def weight(tree, A):
    """Elementary weight of every stage of a tree, and its density."""
    stages, density, size = np.ones(len(A)), 1, 1
    for branch in tree:
        inner, inner_density, inner_size = weight(branch, A)
        stages, density, size = stages * (A @ inner), density * inner_density, size + inner_size
    return stages, density * size, size


def square(rows):
    return np.array([[*row, *[0.0] * (len(rows) - len(row))] for row in rows])


def residuals(method, weights, order):
    A = square(method.rows)
    for tree in (tree for size in range(1, order + 1) for tree in trees(size)):
        stages, density, _ = weight(tree, A)
        yield abs(np.dot(weights, stages) - 1 / density)


def test_trees_are_as_many_as_there_are():
    assert [len(trees(order)) for order in range(1, 6)] == [1, 1, 2, 4, 9]


@pytest.mark.parametrize(("method", "order"), [(RK4, 4), (TSIT5, 5)], ids=["rk4", "tsit5"])
def test_explicit_methods_have_their_order(method, order):
    assert max(residuals(method, method.weights, order)) < ROUNDING
    assert max(residuals(method, method.weights, order + 1)) > 1e-5
    np.testing.assert_allclose(square(method.rows).sum(axis=1), method.nodes, rtol=0, atol=1e-14)


def test_tsit5_embeds_order_four():
    embedded = np.subtract(TSIT5.weights, TSIT5.error)
    assert max(residuals(TSIT5, embedded, 4)) < ROUNDING
    assert max(residuals(TSIT5, embedded, 5)) > 1e-4


@pytest.mark.parametrize("x", [0.1, 0.5, 0.9, 1.0])
def test_tsit5_interpolant_has_order_four(x):
    weights = np.array(TSIT5.dense) @ [x, x**2, x**3, x**4]
    for tree in (tree for size in range(1, 5) for tree in trees(size)):
        stages, density, size = weight(tree, square(TSIT5.rows))
        assert np.dot(weights, stages) == pytest.approx(x**size / density, abs=ROUNDING)


def test_ros34pw2_has_order_three_with_any_jacobian():
    """Rang and Angermann 2005: alpha and gamma each fulfil the conditions, whatever J is."""
    method = ROS34PW2
    alpha, gamma = square(method.alpha), square(method.below) + method.gamma * np.eye(4)
    one, b, e = np.ones(4), np.array(method.weights), np.array(method.embedded)
    a, g = alpha @ one, gamma @ one
    expected = [(b @ one, 1), (b @ a, 1 / 2), (b @ g, 0), (b @ a**2, 1 / 3), (b @ alpha @ a, 1 / 6)]
    expected += [(b @ alpha @ g, 0), (b @ gamma @ a, 0), (b @ gamma @ g, 0)]
    expected += [(e @ one, 1), (e @ a, 1 / 2), (e @ g, 0)]
    np.testing.assert_allclose(*zip(*expected, strict=True), rtol=0, atol=1e-14)
    assert abs(e @ a**2 - 1 / 3) > 1e-2
    np.testing.assert_allclose(alpha[3] + gamma[3], [*b[:3], b[3]], atol=1e-15)  # stiffly accurate


def rosenbrock_step(method, f, J, y, h):
    """One step as Tableau.Rosenbrock states it."""
    u, W = [], np.eye(len(y)) - h * method.gamma * J
    for row, coupling in zip(method.rows, method.couplings, strict=True):
        at = y + sum((a * x for a, x in zip(row, u, strict=True)), np.zeros_like(y))
        right = h * method.gamma * f(at) + method.gamma * sum(
            (c * x for c, x in zip(coupling, u, strict=True)), 0 * y
        )
        u.append(np.linalg.solve(W, right))
    return y + np.array(method.weights) @ u


@pytest.mark.parametrize("matrix", ["exact", "wrong"])
def test_transformed_method_converges(matrix):
    """On a pendulum, with its Jacobian and with any matrix."""
    J = (
        np.array([[0, 1], [-np.cos(0.7), -0.2]])
        if matrix == "exact"
        else np.array([[1.0, -2], [3, -1]])
    )

    def f(y):
        return np.array([y[1], -np.sin(y[0]) - 0.2 * y[1]])

    ends = []
    for steps in (20, 40, 80, 4000):
        y = np.array([0.7, 1.0])
        for _ in range(steps):
            y = rosenbrock_step(transformed(ROS34PW2), f, J, y, 1 / steps)
        ends.append(y)
    errors = np.linalg.norm(np.subtract(ends[:3], ends[3]), axis=1)
    assert (np.log2(errors[:2] / errors[1:]) > 2.8).all()


# The generated loops.


@cache
def model(segments=2, links=2):
    return st.load(model_folder(segments, links, functions=WANTED))


def start(m, seed=0):
    random = np.random.default_rng(seed)
    q, v = np.zeros(m.nq), np.zeros(m.nv)
    q[2], q[3:7] = 0.4, random.normal(size=4)
    q[7:] = random.uniform(-0.5, 0.5, m.nq - 7)
    v[:6] = random.uniform(-3, 3, 6)
    v[6:] = random.uniform(-4, 4, m.nv - 6)
    return q, v


def fly(m=None, **settings):
    m = m or model()
    return st.simulate(m, *start(m), **{"controller": st.Damping(1e-5), "t_span": 0.2} | settings)


@cache
def exact():
    return fly(method="dop853", rtol=1e-13, atol=1e-14)


def apart(flight, reference):
    return max(np.abs(flight.q - reference.q).max(), np.abs(flight.v - reference.v).max() / 10)


ONE_LENGTH = {"rtol": 1e6, "atol": 1e6}  # whatever the error, the step is the longest allowed


@pytest.mark.parametrize(
    ("method", "order", "steps"),
    [
        ("tsit5", 4, (50, 100, 200)),
        ("ros34pw2", 3, (100, 200, 400)),
        ("implicit_euler", 1, (400, 800, 1600)),
    ],
)
def test_error_falls_with_the_order(method, order, steps):
    """At the ends of steps Tsit5 has order 5; between them, samples included here, its interpolant
    has 4.
    """
    errors = []
    for count in steps:
        h = 0.2 / count
        own = (
            {"step": h}
            if method == "implicit_euler"
            else {"first_step": h, "most_step": h} | ONE_LENGTH
        )
        errors.append(apart(fly(method=method, output_step=0.2 / 150, **own), exact_on(151)))
    orders = np.log2(np.divide(errors[:-1], errors[1:]))
    assert (orders > order - 0.3).all() and (orders < order + 1.3).all(), (errors, orders)


@cache
def exact_on(samples):
    return fly(method="dop853", rtol=1e-13, atol=1e-14, output_step=0.2 / (samples - 1))


def test_tsit5_has_order_five_at_the_ends_of_steps():
    last = exact()
    ends = [
        fly(first_step=h, most_step=h, method="tsit5", output_step=0.2, **ONE_LENGTH)
        for h in (4e-3, 2e-3, 1e-3)
    ]
    errors = [np.abs(flight.q[-1] - last.q[-1]).max() for flight in ends]
    assert (np.log2(np.divide(errors[:-1], errors[1:])) > 4.6).all(), errors


@pytest.mark.parametrize("method", ["tsit5", "ros34pw2"])
def test_error_follows_the_tolerance(method):
    tolerances = [1e-4, 1e-6, 1e-8]
    errors = [apart(fly(method=method, rtol=tolerance), exact()) for tolerance in tolerances]
    assert all(
        0.01 < error / tolerance < 100 for error, tolerance in zip(errors, tolerances, strict=True)
    ), errors


def test_energy_drifts_by_rounding():
    m = st.load(model_folder(3, 4, functions=WANTED, emission="loops"))
    q, v = np.zeros(m.nq), np.zeros(m.nv)
    q[3], q[7:], v[3:6] = 1, 0.1, [3, 2, 1]
    flight = st.simulate(m.with_parameters(gravity=0), q, v, t_span=10, rtol=1e-8)
    assert flight.info["method"] == "tsit5"
    assert np.abs(flight.energy - flight.energy[0]).max() < 1e-8 * flight.energy[0]


KINKS = st.TorqueTable(
    [0.031, 0.057, 0.093], np.array([[1, -2, 0, 3], [-3, 1, 2, -1], [2, 2, -1, 0]]) * 1e-4
)


def test_kinks_cost_no_accuracy():
    """Steps end at kinks: a table is as accurate as a smooth motion, and so are phases."""
    reference = fly(controller=KINKS, method="dop853", rtol=1e-13, atol=1e-14)
    error = apart(fly(controller=KINKS, rtol=1e-9), reference)
    blind = apart(fly(controller=lambda t, q, v: st_interp(t), rtol=1e-9), reference)
    assert error < 3e-8 < blind * 1e3 and error < blind * 3
    phases = st.Phases([(0.0, None), (0.05, st.Damping(2e-5)), (0.1, KINKS)])
    assert apart(fly(controller=phases, rtol=1e-9), fly(controller=phases, method="dop853")) < 3e-8


def st_interp(t):
    return np.array([np.interp(t, KINKS.times, column) for column in KINKS.torques.T])


def test_phases_act_one_after_another():
    damping = st.Damping(3e-5)
    flight = fly(
        controller=st.Phases([(0.0, None), (0.05, damping), (0.15, None)]), output_step=1e-3
    )
    t, acts = flight.t, np.abs(flight.tau).max(axis=1) > 0
    assert (
        not acts[t < 0.0495].any()
        and acts[(t > 0.0505) & (t < 0.1495)].all()
        and not acts[t > 0.1505].any()
    )
    np.testing.assert_allclose(flight.tau[acts], -3e-5 * flight.v[acts, 6:], rtol=1e-12)


@pytest.mark.parametrize("links", [2, None], ids=["articulated", "continuum"])
def test_stiff_damping_chooses_the_implicit_method(links):
    m = model(2, links)
    stiff = fly(m, controller=st.Damping(2e-2))
    assert (stiff.info["method"], fly(m).info["method"]) == ("ros34pw2", "tsit5")
    assert "stiff" in stiff.info["reason"] and stiff.info["steps"] < 1000
    explicit = fly(m, controller=st.Damping(2e-2), method="tsit5")
    assert explicit.info["steps"] > 5 * stiff.info["steps"]
    assert apart(stiff, explicit) < 3e-3


def test_tracking_in_c_is_tracking_in_python():
    m = model()
    reference = st.Reference(
        [0.0, 0.05, 0.1, 0.2],
        [[0, 0, 0, 0], [0.3, -0.2, 0.1, 0.4], [0.3, -0.2, 0.1, 0.4], [0.0] * 4],
    )
    law = st.Pfl(m, reference)
    flight, checked = fly(controller=law, rtol=1e-9), fly(controller=law.__call__, method="dop853")
    assert apart(flight, checked) < 1e-6
    np.testing.assert_allclose(flight.tau[5], law(flight.t[5], flight.q[5], flight.v[5]), rtol=1e-9)


def test_implicit_methods_track_too():
    m = model()
    law = st.Pfl(m, st.Reference([0.0, 0.1], [[0.0] * 4, [0.3, -0.2, 0.1, 0.4]]))
    assert (
        apart(fly(controller=law, method="ros34pw2", rtol=1e-6), fly(controller=law, rtol=1e-9))
        < 1e-4
    )


def test_two_runs_are_bit_for_bit_the_same():
    for method in ("tsit5", "ros34pw2", "implicit_euler", "rk4"):
        first, second = (fly(method=method, controller=KINKS) for _ in range(2))
        for name in ("q", "v", "tau"):
            np.testing.assert_array_equal(getattr(first, name), getattr(second, name))


# What ends a run early keeps the motion up to there.


def push(t, q, v):
    return 1e-3 * v[6:]


def test_failed_run_keeps_its_trajectory():
    with pytest.raises(st.SimulationError, match=r"^at t = 0.*: is the ") as caught:
        fly(controller=push, t_span=10, output_step=1e-4, method="rk4", step=1e-4)
    kept = caught.value.trajectory
    assert 10 < len(kept.t) < 10_001 and kept.t[0] == 0 and np.isfinite(kept.q).all()


def test_steps_that_do_not_suffice_are_told():
    with pytest.raises(st.SimulationError, match="most_steps were not enough") as caught:
        fly(most_steps=5, output_step=1e-4)
    assert caught.value.trajectory.t[-1] < 0.2
    with pytest.raises(st.SimulationError, match="steps that are too short"):
        fly(rtol=1e-10, least_step=0.01)


def test_exception_in_a_function_is_itself():
    def law(t, q, v):
        if t > 0.1:
            raise KeyError("mine")
        return np.zeros(4)

    with pytest.raises(KeyError, match="mine"):
        fly(controller=law)


def test_interrupt_ends_a_long_run():
    """Ctrl-C is heard though no Python runs in the loop."""
    script = (
        "import sys, serpentail as st\nm = st.load(sys.argv[1])\nq = [0, 0, 0, 1] + [0] * (m.nq - "
        "4)\n"
        "print('ready', flush=True)\n"
        "st.simulate(m, q, [1.0] * m.nv, t_span=1e5, output_step=1e4, method='rk4', step=1e-5)"
    )
    command = [sys.executable, "-c", script, str(model().folder)]
    run = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert run.stdout.readline() == "ready\n"
    time.sleep(0.5)
    os.kill(run.pid, signal.SIGINT)
    _, errors = run.communicate(timeout=20)
    assert run.returncode != 0 and "KeyboardInterrupt" in errors


@pytest.mark.parametrize(
    ("controller", "words"),
    [
        (lambda: st.Phases([]), "needs one or more"),
        (lambda: st.Phases([(0, None), (0, None)]), "needs one or more increasing times"),
        (lambda: st.Phases([(1, None), (0, None)]), "needs one or more increasing times"),
        (lambda: st.Phases([(0, st.Phases([(0, None)]))]), "put all pairs in one list"),
        (lambda: st.Phases(3), "needs pairs"),
        (lambda: st.Phases([(0, 3)]), "controller: value 3: needs"),
        (lambda: st.TorqueCurve(3), "needs a Piecewise of 4 channels"),
        (lambda: st.NativeTorque("f"), "needs a ctypes function or an address"),
        (
            lambda: st.Reference([0, 1], [[0] * 4] * 2, "cubic"),
            "blend: value 'cubic': needs 'linear' or 'quintic' or 'spline'",
        ),
        (lambda: st.Reference([1, 0], [[0] * 4] * 2), "needs increasing times"),
        (lambda: st.Reference([0], [[0] * 4]), "one node only"),
        (lambda: st.Pfl(model(), st.Reference([0, 1], [[0] * 2] * 2)), "has 2 angles, the tail 4"),
    ],
)
def test_misuse_is_named(controller, words):
    with pytest.raises(st.SimulationError) as caught:
        fly(controller=controller())
    assert words in str(caught.value)


@pytest.mark.parametrize("name", ["legs", "bristles0", "stop_at"])
def test_flight_has_no_ground(name):
    with pytest.raises(
        st.SimulationError, match=f"^{name} .* touches nothing: leave it out, or add `contacts`"
    ):
        fly(**{name: [1]})


# Functions of time.


def test_quintic_blends_rest_at_nodes():
    curve = st.Reference([0.0, 0.5, 0.7, 1.0], [[0.0], [1.0], [1.0], [-2.0]]).curve
    values, rates, accelerations = curve.at(np.array([-1.0, 0.0, 0.5, 0.6, 0.7, 1.0, 3.0]))
    np.testing.assert_allclose(values[:, 0], [0, 0, 1, 1, 1, -2, -2], atol=1e-14)
    np.testing.assert_allclose([rates, accelerations], 0, atol=1e-12)
    s = 0.3
    value, rate, acceleration = (x[0] for x in curve.at(0.5 * s))
    assert value == pytest.approx(10 * s**3 - 15 * s**4 + 6 * s**5)
    assert rate == pytest.approx((30 * s**2 - 60 * s**3 + 30 * s**4) / 0.5)
    assert acceleration == pytest.approx((60 * s - 180 * s**2 + 120 * s**3) / 0.25)
    assert curve.kinks(3).size == 0


def test_only_jumps_and_kinks_are_stops():
    table = st.TorqueTable([0, 1, 2, 3], [[0.0], [1.0], [2.0], [0.0]])
    assert table.parts(1).kinks() == [0, 2, 3]
    assert st.Reference([0, 1, 2], [[0.0], [1], [0]], "spline").curve.kinks(2).tolist() == [0, 2]
    jump = st.Piecewise(np.array([0.0, 1, 2]), np.array([[[0.0, 0]], [[1.0, 0]]]))
    assert jump.kinks(1).tolist() == [1]
