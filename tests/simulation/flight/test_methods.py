"""The generated loops keep what their methods promise: order, tolerance, steps, the same bits."""

from functools import cache

import numpy as np
import pytest

import serpentail as st
from tests.support import zoo
from tests.support.rows import row

from ..runs import TABLE, V0, fly, tail

SAMPLED = 0.2 / 150
ONE_LENGTH = {"rtol": 1e6, "atol": 1e6}  # whatever the error, the step is the longest allowed
ORDERS = {
    "rk4": (4, (150, 300, 600)),  # of 150 samples
    "tsit5": (4, (50, 100, 200)),
    "ros34pw2": (3, (100, 200, 400)),
    "implicit_euler": (1, (400, 800, 1600)),
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


def test_tsit5_has_order_five_at_the_ends_of_steps():
    flights = [fly(output_step=0.2, **steps_of("tsit5", h)) for h in (4e-3, 2e-3, 1e-3)]
    errors = [np.abs(flight.q[-1] - exact().q[-1]).max() for flight in flights]
    assert (np.log2(np.divide(errors[:-1], errors[1:])) > 4.6).all(), errors


def test_methods_agree_and_errors_follow_the_tolerance():
    rows = [
        ({"method": "rk4", "step": 1e-5}, 0, 1e-11),
        ({"method": "rk4"}, 0, 1e-7),
        ({"method": "lsoda"}, 0, 1e-6),
        ({"method": "dop853"}, 0, 1e-7),
        ({"rtol": 1e-10}, 0, 1e-8),
    ]
    for method in ("tsit5", "ros34pw2"):
        rows += [({"method": method, "rtol": r}, 0.01 * r, 100 * r) for r in (1e-4, 1e-6, 1e-8)]
    for settings, least, most in rows:
        with row(settings):
            error = apart(fly(output_step=1e-3, **settings), exact())
            assert least < error < most


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


@pytest.mark.parametrize("name", ["m2_n2", "arcs2"])
def test_stiff_damping_chooses_the_implicit_method(name):
    stiff = {"controller": st.Damping(2e-2)}
    chosen, model = fly(zoo.model(name), **stiff), zoo.model(name)
    mild = fly(model, controller=st.Damping(1e-5))
    assert (chosen.info["method"], mild.info["method"]) == ("ros34pw2", "tsit5")
    assert "stiff" in chosen.info["reason"] and chosen.info["steps"] < 1000
    explicit = fly(model, method="tsit5", **stiff)
    assert explicit.info["steps"] > 5 * chosen.info["steps"]
    assert apart(chosen, explicit) < 3e-3


def test_tracking_in_c_is_tracking_in_python_and_implicit_methods_track_too():
    bend = [0.3, -0.2, 0.1, 0.4]
    nodes = np.array([[0, 0, 0, 0], bend, bend, [0, 0, 0, 0]])
    law = st.Pfl(tail(), st.Reference([0.0, 0.05, 0.1, 0.2], nodes))
    flight, checked = fly(controller=law, rtol=1e-9), fly(controller=law.__call__, method="dop853")
    assert apart(flight, checked) < 1e-6
    np.testing.assert_allclose(flight.tau[5], law(flight.t[5], flight.q[5], flight.v[5]), rtol=1e-9)
    assert apart(fly(controller=law, method="ros34pw2", rtol=1e-6), flight) < 1e-4


def test_two_runs_are_bit_for_bit_the_same():
    for method in ORDERS:
        first, second = (fly(method=method, controller=TABLE) for _ in range(2))
        for name in ("q", "v", "tau"):
            np.testing.assert_array_equal(getattr(first, name), getattr(second, name))


def test_torques_of_a_long_tail_spoil_no_factors():
    """Laws of 8 joints need more scratch than a solution with the factors, which lie behind it."""
    model = zoo.model("mixed")
    q, v, rng = np.eye(1, model.nq, 3)[0], np.zeros(model.nv), np.random.default_rng(2)
    q[7:], v[3:] = rng.uniform(-0.5, 0.5, 8), rng.uniform(-4, 4, 11)
    table = st.TorqueTable([0.0, 0.2], 1e-5 * rng.normal(size=(2, 8)), 1e-2)
    how = {"controller": table, "t_span": 0.2}
    flight = st.simulate(model, q, v, method="ros34pw2", rtol=1e-8, **how)
    assert apart(flight, st.simulate(model, q, v, method="dop853", rtol=1e-11, **how)) < 5e-8
