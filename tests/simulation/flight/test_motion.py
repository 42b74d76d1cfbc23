"""Free flight: samples are where they shall be, what mechanics conserves stays, and torques and
damping change energy by their work.
"""

import numpy as np
import pytest
from scipy.integrate import simpson

import serpentail as st
from tests.support import zoo
from tests.support.rows import row

from ..runs import NT, Q0, V0, fly, tail

TIGHT = {"method": "dop853", "rtol": 1e-13, "atol": 1e-15}
DAMPING = np.array([2e-6, 1e-6, 3e-6, 4e-6])  # N m s, small enough for a tail that swings


def total_mass():
    return tail().parameters["torso_mass"] + tail().parameters["tail_mass"]


def centre_of_mass(flight):
    """Centre of mass (K, 3) from the positions of torso and links."""
    points = tail().tail_points(flight.q)
    links = (points[:, 1:] + points[:, :-1]) / 2
    torso, own = tail().parameters["torso_mass"], tail().parameters["tail_mass"]
    return (torso * flight.q[:, :3] + own * links.mean(axis=1)) / (torso + own)


def test_velocities_are_the_rates_of_positions_and_quaternions_stay_units():
    for method in ("rk4", "tsit5", "dop853"):
        with row(method):
            flight = fly(t_span=0.05, output_step=1e-4, method=method)
            rates = (flight.q[2:] - flight.q[:-2]) / 2e-4
            assert np.abs(rates[:, :3] - flight.v[1:-1, :3]).max() < 1e-3
            assert np.abs(rates[:, 7:] - flight.v[1:-1, 6:]).max() < 1e-2
            w, turn, spin = flight.q[1:-1, 3:4], flight.q[1:-1, 4:7], rates[:, 4:7]
            omega = 2 * (w * spin - rates[:, 3:4] * turn - np.cross(turn, spin))
            assert np.abs(omega - flight.v[1:-1, 3:6]).max() < 1e-2
            assert np.abs(np.linalg.norm(flight.attitude, axis=1) - 1).max() < 1e-15


def test_a_flight_does_not_depend_on_samples_or_on_the_norm_of_its_quaternion():
    often, seldom = (fly(t_span=0.1, output_step=step) for step in (1e-3, 1e-2))
    np.testing.assert_array_equal(often.q[::10], seldom.q)
    np.testing.assert_array_equal(often.v[::10], seldom.v)
    q0, v0 = Q0 * ([1] * 3 + [2.0**30] * 4 + [1] * NT), V0.copy()
    given = q0.copy()
    np.testing.assert_array_equal(st.simulate(tail(), q0, v0, t_span=0.02).q, fly(t_span=0.02).q)
    np.testing.assert_array_equal([*q0, *v0], [*given, *V0])


def test_free_flight_conserves():
    for settings, drift in (({}, 1e-8), ({"method": "rk4"}, 1e-8), (TIGHT, 1e-12)):
        with row(settings):
            flight = fly(t_span=0.25, **settings)
            assert not flight.tau.any()
            assert np.abs(flight.energy - flight.energy[0]).max() < drift * flight.kinetic.max()
            angular, linear = flight.angular_momentum, flight.linear_momentum
            assert np.abs(angular - angular[0]).max() < drift * np.linalg.norm(angular[0])
            fallen = linear + np.outer(flight.t, [0, 0, total_mass() * 9.8])
            assert np.abs(fallen - linear[0]).max() < drift * np.linalg.norm(linear[0])
            assert np.ptp(flight.kinetic) > 1e-3 * flight.kinetic.max()


def test_energy_of_a_long_flight_drifts_by_rounding():
    model = tail().with_parameters(gravity=0)
    q, v = np.eye(1, model.nq, 3)[0], np.zeros(model.nv)
    q[7:], v[3:6] = 0.1, [3, 2, 1]
    flight = st.simulate(model, q, v, t_span=10, rtol=1e-8)
    assert flight.info["method"] == "tsit5"
    assert np.abs(flight.energy - flight.energy[0]).max() < 1e-8 * flight.energy[0]


def test_the_centre_of_mass_flies_a_parabola():
    for gravity in (0.0, 9.8):
        with row(gravity):
            flight = fly(tail().with_parameters(gravity=gravity), t_span=0.25, **TIGHT)
            centres, t = centre_of_mass(flight), flight.t[:, None]
            speed = flight.linear_momentum[0] / total_mass()
            parabola = centres[0] + speed * t - gravity * t**2 / 2 * [0, 0, 1]
            np.testing.assert_allclose(centres, parabola, atol=1e-13)
            assert np.abs(flight.q[:, :3] - centres).max() > 1e-3


def test_damping_takes_energy_by_its_power():
    fine = {"t_span": 0.25, "output_step": 1.25e-4, "method": "tsit5", "rtol": 1e-10}
    for law in (st.Damping(tuple(DAMPING)), lambda t, q, v: -DAMPING * v[6:]):
        flight = fly(controller=law, **fine)
        lost = flight.energy[0] - flight.energy[-1]
        assert lost > 1e-3 * flight.kinetic[0]
        assert lost == pytest.approx(simpson(flight.v[:, 6:] ** 2 @ DAMPING, x=flight.t), rel=1e-8)
        angular = flight.angular_momentum
        assert np.abs(angular - angular[0]).max() < 1e-8 * np.linalg.norm(angular[0])


def test_torques_change_energy_by_their_work():
    def law(t, q, v):
        return 1e-5 * np.cos(9 * t + np.arange(NT))

    flight = fly(t_span=0.25, controller=law, output_step=1.25e-4)
    work = simpson((flight.tau * flight.v[:, 6:]).sum(axis=1), x=flight.t)
    assert abs(work) > 1e-6
    assert flight.energy[-1] - flight.energy[0] == pytest.approx(work, rel=1e-6)


METHODS = {"rk4": {"step": 1e-3}, "tsit5": {"rtol": 1e-6}, "dop853": {"rtol": 1e-6}}
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
    for method in ("tsit5", "dop853"):
        how = [{"method": method, "rtol": r, "atol": r} for r in (1e-4, 1e-7, 1e-10)]
        costs = [fly(t_span=0.1, **each).info["evaluations"] for each in how]
        assert costs == sorted(set(costs)), method


def test_results_hold_parameters():
    own = tail().with_parameters(tail_mass=0.01)
    told = fly(own, t_span=0.01).info["parameters"]
    assert told["tail_mass"] == 0.01
    assert told["link_inertia"] == list(own.parameters["link_inertia"])


def test_a_model_in_single_precision_flies():
    laws = st.Damping(tuple(DAMPING)), lambda t, q, v: -DAMPING * v[6:]
    reference = fly(t_span=0.1, controller=laws[0])
    for law in laws:
        for method in METHODS:
            flight = fly(zoo.model("single"), t_span=0.1, controller=law, method=method)
            assert 0 < np.abs(flight.q - reference.q).max() < 1e-3, method
            assert flight.info["evaluations"] < 10_000 and flight.q.dtype == np.float64
