"""Coefficients fulfil the order conditions, by rooted trees (Butcher) and those of W-methods, and
the generated loops keep what they promise: order, tolerance, steps, the same bits.
"""

from functools import cache

import numpy as np
import pytest

import serpentail as st
from serpentail_codegen.targets.c.tableaux import DP8, RK4, ROS34PW2, TSIT5
from tests.support import zoo
from tests.support.rows import row

from ..runs import TABLE, V0, fly

ROUNDING = 3e-14  # coefficients of up to 88, printed with 16 digits


@cache
def trees(order):
    """Rooted trees of an order, as sorted tuples of their branches."""
    if order == 1:
        return [()]
    found = {
        tuple(sorted((*tree, branch)))
        for size in range(1, order)
        for tree in trees(order - size)
        for branch in trees(size)
    }
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


def test_explicit_methods_have_their_order():
    for method, order in ((RK4, 4), (TSIT5, 5), (DP8, 8)):
        assert max(residuals(method, method.weights, order)) < ROUNDING
        assert max(residuals(method, method.weights, order + 1)) > 1e-5
        rows = square(method.rows).sum(axis=1)
        np.testing.assert_allclose(rows, method.nodes, rtol=0, atol=1e-14)


def test_dp8_embeds_orders_five_and_three():
    for estimate, order in ((DP8.error, 5), (DP8.coarse, 3)):
        embedded = np.subtract(DP8.weights, estimate)
        assert max(residuals(DP8, embedded, order)) < ROUNDING
        assert max(residuals(DP8, embedded, order + 1)) > 1e-5


def test_tsit5_embeds_order_four_and_interpolates_with_it():
    embedded = np.subtract(TSIT5.weights, TSIT5.error)
    assert max(residuals(TSIT5, embedded, 4)) < ROUNDING
    assert max(residuals(TSIT5, embedded, 5)) > 1e-4
    for x in (0.1, 0.5, 0.9, 1.0):
        weights = np.array(TSIT5.dense) @ [x, x**2, x**3, x**4]
        for tree in (tree for size in range(1, 5) for tree in trees(size)):
            stages, density, size = weight(tree, square(TSIT5.rows))
            assert np.dot(weights, stages) == pytest.approx(x**size / density, abs=ROUNDING)


def test_ros34pw2_has_order_three_with_any_jacobian():
    """Rang and Angermann 2005: alpha and gamma each fulfil the conditions, whatever J is."""
    method = ROS34PW2  # in u = gamma k
    gamma = np.linalg.inv(np.eye(4) / method.gamma - square(method.couplings))
    np.testing.assert_allclose(np.diag(gamma), method.gamma, atol=1e-15)
    alpha, b, off = (
        np.array(x) @ gamma for x in (square(method.rows), method.weights, method.error)
    )
    np.testing.assert_allclose(alpha.sum(axis=1), method.nodes, atol=1e-15)
    one, e = np.ones(4), b - off
    a, g = alpha @ one, gamma @ one
    expected = [(b @ one, 1), (b @ a, 1 / 2), (b @ g, 0), (b @ a**2, 1 / 3), (b @ alpha @ a, 1 / 6)]
    expected += [(b @ alpha @ g, 0), (b @ gamma @ a, 0), (b @ gamma @ g, 0)]
    expected += [(e @ one, 1), (e @ a, 1 / 2), (e @ g, 0)]
    np.testing.assert_allclose(*zip(*expected, strict=True), rtol=0, atol=1e-14)
    assert abs(e @ a**2 - 1 / 3) > 1e-2
    np.testing.assert_allclose(alpha[3] + gamma[3], [*b[:3], b[3]], atol=1e-15)  # stiffly accurate


SAMPLED = 0.2 / 150
ONE_LENGTH = {"rtol": 1e6, "atol": 1e6}  # whatever the error, the step is the longest allowed
ORDERS = {
    "rk4": (4, (150, 300, 600)),  # of 150 samples
    "tsit5": (4, (50, 100, 200)),
    "ros34pw2": (3, (100, 200, 400)),
    "implicit_euler": (1, (400, 800, 1600)),
    "dp8": (8, (12, 24, 48)),
}


@cache
def exact(output_step=1e-3):
    return fly(method="dop853", rtol=1e-13, atol=1e-15, output_step=output_step)


def apart(flight, reference):
    """Largest difference of states."""
    q, v = (np.abs(a - b).max() for a, b in ((flight.q, reference.q), (flight.v, reference.v)))
    return max(q, v / np.abs(V0).max())


def steps_of(method, h):
    """Settings that make all steps h long."""
    if method in ("rk4", "implicit_euler"):
        return {"method": method, "step": h}
    return {"method": method, "first_step": h, "most_step": h} | ONE_LENGTH


@pytest.mark.parametrize("method", ORDERS)
def test_the_error_falls_with_the_order(method):
    """At the ends of steps Tsit5 has order 5; between them, samples included here, its interpolant
    has 4.
    """
    order, counts = ORDERS[method]
    reference = exact(SAMPLED)
    flights = [fly(output_step=SAMPLED, **steps_of(method, 0.2 / n)) for n in counts]
    errors = [apart(flight, reference) for flight in flights]
    orders = np.log2(np.divide(errors[:-1], errors[1:]))
    assert (orders > order - 0.3).all() and (orders < order + 1.3).all(), (errors, orders)
    if method == "tsit5":
        flights = [fly(output_step=0.2, **steps_of(method, h)) for h in (4e-3, 2e-3, 1e-3)]
        errors = [np.abs(flight.q[-1] - reference.q[-1]).max() for flight in flights]
        assert (np.log2(np.divide(errors[:-1], errors[1:])) > 4.6).all(), errors


def test_methods_agree_and_errors_follow_the_tolerance():
    rows = [
        ({"method": "rk4", "step": 1e-5}, 0, 1e-11),
        ({"method": "rk4"}, 0, 1e-7),
        ({"method": "lsoda"}, 0, 1e-6),
        ({"method": "dop853"}, 0, 1e-7),
        ({"rtol": 1e-10}, 0, 1e-8),
        ({"method": "dp8"}, 0, 1e-11),
    ]
    for method in ("tsit5", "ros34pw2", "dp8"):
        rows += [({"method": method, "rtol": r}, 0.01 * r, 100 * r) for r in (1e-4, 1e-6, 1e-8)]
    for settings, least, most in rows:
        with row(settings):
            error = apart(fly(output_step=1e-3, **settings), exact())
            assert least < error < most


def test_one_tolerance_is_one_accuracy():
    """Typical errors of all methods are within a factor of ten, from 1e-2 to 1e-9."""
    logs = {}
    for name in ("m1_n3", "m2_n2", "arcs2"):
        model, rng = zoo.model(name), np.random.default_rng(3)
        q, v = np.eye(1, model.nq, 3)[0], rng.uniform(-5, 5, model.nv)
        q[7:], v[3] = rng.uniform(-0.3, 0.3, model.nq - 7), 15
        how = {"t_span": 0.3, "output_step": 0.3}
        end = st.simulate(model, q, v, method="tsit5", rtol=1e-12, **how).q[-1]
        for method in ("tsit5", "ros34pw2", "dp8", "dop853", "lsoda"):
            for rtol in 10.0 ** -np.arange(2, 10):
                run = st.simulate(model, q, v, method=method, rtol=rtol, atol=rtol, **how)
                error = np.abs(run.q[-1] - end).max() / rtol
                logs.setdefault(method, []).append(np.log10(error))
    typical = {method: np.mean(each) for method, each in logs.items()}
    assert max(typical.values()) - min(typical.values()) < 1, typical


def test_rejected_steps_of_dop853_are_counted():
    """By the evaluations of each: 12 of an attempt, 3 of an interpolant, 2 of the first step."""
    for rtol, least in ((1e-3, 0), (1e-10, 1)):
        info = fly(method="dop853", rtol=rtol, controller=TABLE).info
        parts = 12 * (info["steps"] + info["rejected"]) + 3 * info["steps"]
        assert 0 < info["evaluations"] - parts <= 8 and info["rejected"] >= least


def test_a_wild_run_ends_after_steps_that_follow_its_duration():
    for span, most in ((2e-3, 300_000), (2.0, 600_000), (10.0, 1_000_000)):
        info = fly(t_span=span, output_step=span, rtol=1e-3).info
        assert info["most_steps"] == most and info["steps"] < 10_000


def test_the_last_two_steps_are_equal():
    """14 ms in steps of 10 ms or less: rates are asked for in the middle, and never beyond."""
    times, h = [], 0.01

    def law(t, q, v):
        times.append(t)
        return np.zeros(4)

    for method in ("tsit5", "ros34pw2"):
        times.clear()
        how = steps_of(method, h) | {"t_span": 1.4 * h, "output_step": 1.4 * h}
        flight = fly(controller=law, **how)
        assert flight.info["steps"] == 2 and max(times) == 1.4 * h, method
        assert np.abs(np.array(times) - 0.7 * h).min() < 1e-12


def test_stiff_damping_chooses_the_implicit_method():
    stiff = {"controller": st.Damping(2e-2)}
    for name in ("m2_n2", "arcs2"):
        model = zoo.model(name)
        chosen, mild = fly(model, rtol=1e-4, **stiff), fly(model, controller=st.Damping(1e-5))
        assert (chosen.info["method"], mild.info["method"]) == ("ros34pw2", "tsit5")
        assert "stiff" in chosen.info["reason"] and chosen.info["steps"] < 1000
        explicit = fly(model, method="tsit5", **stiff)
        assert explicit.info["steps"] > 5 * chosen.info["steps"]
        assert apart(chosen, explicit) < 3e-3


def test_torques_of_a_long_tail_spoil_no_factors():
    """Laws of 8 joints need more scratch than a solution with the factors, which lie behind it."""
    model = zoo.model("mixed")
    q, v, rng = np.eye(1, model.nq, 3)[0], np.zeros(model.nv), np.random.default_rng(2)
    q[7:], v[3:] = rng.uniform(-0.5, 0.5, 8), rng.uniform(-4, 4, 11)
    table = st.TorqueTable([0.0, 0.2], 1e-5 * rng.normal(size=(2, 8)), 1e-2)
    how = {"controller": table, "t_span": 0.2}
    flight = st.simulate(model, q, v, method="ros34pw2", rtol=1e-8, **how)
    assert apart(flight, st.simulate(model, q, v, method="dop853", rtol=1e-11, **how)) < 5e-8
