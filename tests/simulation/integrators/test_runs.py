"""Integration methods: coefficients fulfil their order conditions, and the generated loops keep
what these promise.
"""

from functools import cache

import numpy as np
import pytest

import serpentail as st

from ...support.models import model_folder
from .trees_and_flights import WANTED, fly, model


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


@pytest.mark.parametrize("method", ["rk4", "implicit_euler"])
@pytest.mark.parametrize("side", [-1, 1])
def test_a_kink_beside_a_sample_takes_no_step_of_its_own(method, side):
    """What lies between a sample and a kink that rounding sets apart is no full step: the momentum
    of a free fall is M g t, whatever the torques.
    """
    m, samples = model(), np.linspace(0, 0.2, 201)[1:-1]
    kinks = np.nextafter(samples, side * np.inf)
    table = st.TorqueTable(kinks, 1e-5 * (-1.0) ** np.arange(len(kinks))[:, None] * np.ones(4))
    settings = {"t_span": 0.2, "output_step": 1e-3, "step": 1e-4, "method": method}
    flight = fly(m, controller=table, **settings)
    assert flight.info["steps"] <= 2000 + len(kinks)
    weight = 9.8 * (m.parameters["torso_mass"] + m.parameters["tail_mass"])
    fallen = flight.linear_momentum[0, 2] - flight.linear_momentum[:, 2]
    np.testing.assert_allclose(fallen, weight * flight.t, rtol=0, atol=1e-6 * weight)


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


def test_torques_of_a_long_tail_spoil_no_factors():
    """Laws of 8 joints need more scratch than a solution with the factors, which lie behind it."""
    m = model(4, 1)
    table = st.TorqueTable([0.0, 0.2], 1e-5 * np.random.default_rng(2).normal(size=(2, 8)), 1e-2)
    flight = fly(m, controller=table, method="ros34pw2", rtol=1e-8)
    assert apart(flight, fly(m, controller=table, method="dop853", rtol=1e-11)) < 5e-8


@pytest.mark.parametrize("method", ["tsit5", "ros34pw2"])
def test_the_last_two_steps_are_equal(method):
    """14 ms in steps of 10 ms or less: rates are asked for in the middle, and never beyond."""
    times, h = [], 0.01

    def law(t, q, v):
        times.append(t)
        return np.zeros(4)

    steps = {"first_step": h, "most_step": h, "t_span": 1.4 * h, "output_step": 1.4 * h}
    flight = fly(controller=law, method=method, **steps, **ONE_LENGTH)
    assert flight.info["steps"] == 2 and max(times) == 1.4 * h
    assert np.abs(np.array(times) - 0.7 * h).min() < 1e-12
