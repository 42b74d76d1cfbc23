"""Flights: samples are where they shall be, what mechanics conserves stays, steps end at kinks,
and what ends a run early is told.
"""

import re

import numpy as np
import pytest

import serpentail as st
from tests.support import zoo
from tests.support.rows import row

from ..runs import NT, Q0, V0, centre_of_mass, fly, tail

TIGHT = {"method": "dop853", "rtol": 1e-13, "atol": 1e-15}


def test_a_flight_does_not_depend_on_samples_or_on_the_norm_of_its_quaternion():
    often, seldom = (fly(t_span=0.1, output_step=step) for step in (1e-3, 1e-2))
    np.testing.assert_array_equal(often.q[::10], seldom.q)
    np.testing.assert_array_equal(often.v[::10], seldom.v)
    q0, v0 = Q0 * ([1] * 3 + [2.0**30] * 4 + [1] * NT), V0.copy()
    given = q0.copy()
    np.testing.assert_array_equal(st.simulate(tail(), q0, v0, t_span=0.02).q, fly(t_span=0.02).q)
    np.testing.assert_array_equal([*q0, *v0], [*given, *V0])


def test_free_flight_conserves_and_the_centre_of_mass_flies_a_parabola():
    mass = sum(tail().parameters[name] for name in ("torso_mass", "tail_mass"))
    rows = [({}, 1e-8), ({"method": "rk4"}, 1e-8), ({"method": "dp8"}, 1e-10), (TIGHT, 1e-12)]
    for settings, drift in rows:
        for gravity in (0.0, 9.8):
            model = tail().with_parameters(gravity=gravity)
            flight = fly(model, t_span=0.25, **settings)
            angular, linear, t = flight.angular_momentum, flight.linear_momentum, flight.t[:, None]
            with row(settings, gravity):
                assert not flight.tau.any()
                assert np.abs(np.linalg.norm(flight.attitude, axis=1) - 1).max() < 1e-15
                assert np.abs(flight.energy - flight.energy[0]).max() < drift * flight.kinetic.max()
                assert np.abs(angular - angular[0]).max() < drift * np.linalg.norm(angular[0])
                fallen = linear + mass * gravity * t * [0, 0, 1]
                assert np.abs(fallen - linear[0]).max() < drift * np.linalg.norm(linear[0])
                centres = centre_of_mass(model, flight)
                parabola = centres[0] + linear[0] / mass * t - gravity * t**2 / 2 * [0, 0, 1]
                np.testing.assert_allclose(centres, parabola, atol=0.1 * drift)
                assert np.abs(flight.q[:, :3] - centres).max() > 1e-3


METHODS = {"rk4": {"step": 1e-3}, "tsit5": {"rtol": 1e-6}, "dop853": {"rtol": 1e-6}}
METHODS["dp8"] = {"rtol": 1e-6}
SPANS = [(0.3, None, 200), ((-1.0, 0.1), 0.1, 11), ((0.7, 1.7), 0.3, 3), (0.1, 1.0, 1)]


def test_samples_are_evenly_spaced_from_start_to_end():
    rows = [(method, *each) for method in METHODS for each in (*SPANS, ((1.0, 1.01), 1e-4, 100))]
    for method, span, output_step, intervals in rows:
        with row(method, span):
            flight = fly(t_span=span, output_step=output_step, method=method, **METHODS[method])
            start, end = span if isinstance(span, tuple) else (0.0, span)
            assert (len(flight.t), flight.t[0], flight.t[-1]) == (intervals + 1, start, end)
            np.testing.assert_allclose(np.diff(flight.t), (end - start) / intervals, rtol=1e-10)
            np.testing.assert_array_equal(flight.v[0], V0)
            assert flight.info["method"] == method and flight.info["model"] == "m2_n2"


def test_steps_divide_the_samples_and_looser_tolerances_cost_less():
    for step, used, steps in ((3e-3, 2.5e-3, 8), (2.5e-3, 2.5e-3, 8), (1.0, 5e-3, 4)):
        info = fly(t_span=0.02, output_step=5e-3, step=step).info
        found = info["step"], info["steps"], info["evaluations"]
        assert found == (pytest.approx(used), steps, 4 * steps)
    for method in ("tsit5", "dp8", "dop853"):
        how = [{"method": method, "rtol": r, "atol": r} for r in (1e-4, 1e-7, 1e-10)]
        costs = [fly(t_span=0.1, **each).info["evaluations"] for each in how]
        assert costs == sorted(set(costs)), method


def test_a_model_in_single_precision_flies():
    how = {"t_span": 0.1, "controller": st.Damping((2e-6, 1e-6, 3e-6, 4e-6))}
    reference = fly(**how)
    for method in METHODS:
        flight = fly(zoo.model("single"), method=method, **how)
        assert 0 < np.abs(flight.q - reference.q).max() < 1e-3, method
        assert flight.info["evaluations"] < 10_000 and flight.q.dtype == np.float64


def test_what_does_not_suffice_is_told():
    """Steps, and the reason why they are many: a torque that is far too large."""
    with pytest.raises(st.SimulationError, match="most_steps") as caught:
        fly(most_steps=5, output_step=1e-4)
    assert caught.value.trajectory.t[-1] < 0.2
    with pytest.raises(st.SimulationError, match="too short"):
        fly(rtol=1e-10, least_step=0.01)
    words = r"not enough.* 5 N m, and a joint (\S+) rad/s"
    with pytest.raises(st.SimulationError, match=words) as caught:
        fly(controller=lambda t, q, v: [5.0, 0, 0, 0], most_steps=2000)
    assert float(re.search(words, str(caught.value))[1]) > 1000
    fast = [1e308, *np.zeros(7)]  # of B alone: accelerations are finite when its position is not
    with pytest.raises(st.SimulationError, match=r"t = 1\.75 s .*finite"):
        st.simulate(
            zoo.model("m1_n3"), [*np.eye(7)[3], 0, 0], fast, t_span=10, method="rk4", step=1
        )


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
    assert curve.kinks().tolist() == [0, 0.5, 0.7, 1]  # of the third derivative


def test_only_jumps_and_kinks_are_stops_in_any_unit():
    rise = np.array([[0.0], [1.0], [2.0], [0.0]])
    for size in (1e-12, 1.0, 1e12):
        assert st.TorqueTable([0, 1, 2, 3], size * rise).parts(1).kinks() == [0, 2, 3], size
        rounding = size * np.array([[[1.0, 0]], [[1.0 + 1e-12, 0]]])
        assert st.Piecewise(np.array([0.0, 1, 2]), rounding).kinks().size == 0, size
    assert st.Reference([0, 1, 2], rise[:3] % 2, "spline").curve.kinks().tolist() == [0, 2]
    jump = st.Piecewise(np.array([0.0, 1, 2]), np.array([[[0.0, 0]], [[1.0, 0]]]))
    assert jump.kinks().tolist() == [1]


def test_a_smooth_and_short_torque_is_not_stepped_over():
    """x^2 (d - x)^2 from 0.1 s on for d = 1 ms, at rest before: the tail gets its impulse."""
    model, d = zoo.model("m1_n3"), 1e-3
    bump = np.zeros((3, 2, 5))
    bump[1, 0, 2:] = np.array([d**2, -2 * d, 1]) * 1e-6 * 30 / d**5  # impulse 1e-6 N m s
    times = [0, 0.1, 0.1 + d, 0.2]
    for wrong, powers in ((times[::-1], bump), (times[:3], bump), (times, bump[0]), ([], bump)):
        with pytest.raises(st.SimulationError, match=r"^Piecewise: (times|coefficients)"):
            st.Piecewise(wrong, powers)
    law = st.TorqueCurve(st.Piecewise(times, bump))
    run = st.simulate(model, model.state(), 0.1 + d, controller=law, output_step=0.1 + d)
    expected = np.linalg.solve(model.mass_matrix(run.q[0]), np.eye(8)[6] * 1e-6)
    np.testing.assert_allclose(run.v[-1, 3:], expected[3:], atol=1e-3 * np.abs(expected).max())


def test_phases_act_one_after_another():
    law = st.Phases([(0.0, None), (0.05, st.Damping(3e-5)), (0.15, None)])
    flight = fly(controller=law, output_step=1e-3)
    t, acts = flight.t, np.abs(flight.tau).max(axis=1) > 0
    inside = (t > 0.0505) & (t < 0.1495)
    assert not acts[(t < 0.0495) | (t > 0.1505)].any() and acts[inside].all()
    np.testing.assert_allclose(flight.tau[acts], -3e-5 * flight.v[acts, 6:], rtol=1e-12)


KINKS = st.TorqueTable(
    [0.031, 0.057, 0.093], np.array([[1, -2, 0, 3], [-3, 1, 2, -1], [2, 2, -1, 0]]) * 1e-4
)


def test_kinks_cost_no_accuracy():
    """Steps end at kinks: a table is as accurate as a smooth motion, and so are phases."""

    def between(t, q, v):
        """The same torques, without a word about kinks."""
        return np.array([np.interp(t, KINKS.times, column) for column in KINKS.torques.T])

    def error(law, exact):
        reference = fly(controller=exact, **TIGHT)
        return np.abs(fly(controller=law, rtol=1e-9).q - reference.q).max()

    least, blind = error(KINKS, KINKS), error(between, KINKS)
    assert least < 3e-8 < blind * 1e3 and least < blind * 3
    phases = st.Phases([(0.0, None), (0.05, st.Damping(2e-5)), (0.1, KINKS)])
    assert error(phases, phases) < 3e-8


@pytest.mark.parametrize("method", ["rk4", "implicit_euler"])
def test_a_kink_beside_a_sample_takes_no_step_of_its_own(method):
    """What lies between a sample and a kink that rounding sets apart is no full step: the momentum
    of a free fall is M g t, whatever the torques.
    """
    weight = 9.8 * sum(tail().parameters[name] for name in ("torso_mass", "tail_mass"))
    for side in (-1, 1):
        kinks = np.nextafter(np.linspace(0, 0.2, 201)[1:-1], side * np.inf)
        torques = 1e-5 * (-1.0) ** np.arange(len(kinks))[:, None] * np.ones(NT)
        table = st.TorqueTable(kinks, torques)
        flight = fly(controller=table, output_step=1e-3, step=1e-4, method=method)
        assert flight.info["steps"] <= 2000 + len(kinks)
        fallen = flight.linear_momentum[0, 2] - flight.linear_momentum[:, 2]
        np.testing.assert_allclose(fallen, weight * flight.t, rtol=0, atol=1e-5 * weight)


def test_the_c_numbers_its_statuses_one_by_one():
    names = "PAUSED STEP_TOO_SMALL TOO_MANY_STEPS STOPPED_AT_EVENT TORQUE_FAILED NO_SUCH_METHOD "
    names += "STEP_TOO_LONG BAD_TIMES"
    header = (zoo.folder("m2_n2") / "include" / "m2_n2_simulation.h").read_text()
    for number, name in enumerate(names.split(), 32):
        assert f"M2_N2_{name} = {number}" in header
