"""Flight: what mechanics conserves stays, what damping takes is accounted for, and torque laws act
as written.
"""

import numpy as np
import pytest
from scipy.integrate import simpson

import serpentail as st

from .thrown import DAMPING, NT, Q0, V0, both

TIGHT = {"method": "dop853", "rtol": 1e-13, "atol": 1e-15}


@pytest.fixture(scope="module")
def tight(fly):
    """A quarter of a second without torques, as exact as can be."""
    return fly(t_span=0.25, **TIGHT)


def total_mass(model):
    return model.parameters["torso_mass"] + model.parameters["tail_mass"]


def centre_of_mass(model, flight):
    """Centre of mass (K, 3) from the positions of torso and links."""
    points = model.tail_points(flight.q)
    links = (points[:, 1:] + points[:, :-1]) / 2
    torso, tail = model.parameters["torso_mass"], model.parameters["tail_mass"]
    return (torso * flight.q[:, :3] + tail * links.mean(axis=1)) / (torso + tail)


def error(flight, reference):
    """Largest difference of states."""
    return max(
        np.abs(flight.q - reference.q).max(),
        np.abs(flight.v - reference.v).max() / np.abs(V0).max(),
    )


# Methods


def test_rk4_has_order_four(fly, tight):
    errors = [error(fly(t_span=0.25, step=step), tight) for step in (1.25e-3, 6.25e-4, 3.125e-4)]
    orders = np.log2(np.divide(errors[:-1], errors[1:]))
    assert errors[-1] > 1e-11 and ((orders > 3.7) & (orders < 4.4)).all(), (errors, orders)


def test_methods_agree(fly, tight):
    assert error(fly(t_span=0.25, step=1e-5), tight) < 1e-11
    assert error(fly(t_span=0.25, method="rk4"), tight) < 1e-7
    assert error(fly(t_span=0.25, rtol=1e-10), tight) < 1e-8
    assert error(fly(t_span=0.25, method="lsoda"), tight) < 1e-6
    assert error(fly(t_span=0.25, method="dop853"), tight) < 1e-7


@both
def test_velocities_are_the_rates_of_positions(fly, settings):
    flight = fly(t_span=0.05, output_step=1e-4, **settings)
    rates = (flight.q[2:] - flight.q[:-2]) / 2e-4
    assert np.abs(rates[:, :3] - flight.v[1:-1, :3]).max() < 1e-3
    assert np.abs(rates[:, 7:] - flight.v[1:-1, 6:]).max() < 1e-2
    w, turn = flight.q[1:-1, 3], flight.q[1:-1, 4:7]
    omega = 2 * (w[:, None] * rates[:, 4:7] - rates[:, 3:4] * turn - np.cross(turn, rates[:, 4:7]))
    assert np.abs(omega - flight.v[1:-1, 3:6]).max() < 1e-2


@both
def test_quaternion_stays_on_the_unit_sphere(fly, settings):
    norms = np.linalg.norm(fly(t_span=0.25, **settings).attitude, axis=1)
    assert np.abs(norms - 1).max() < 1e-15


def test_flight_does_not_depend_on_where_it_is_sampled(fly):
    often, seldom = (fly(t_span=0.1, output_step=step) for step in (1e-3, 1e-2))
    np.testing.assert_array_equal(often.q[::10], seldom.q)
    np.testing.assert_array_equal(often.v[::10], seldom.v)


def test_norm_of_the_first_quaternion_does_not_matter(model, fly):
    scaled = Q0 * ([1] * 3 + [2.0**30] * 4 + [1] * NT)
    np.testing.assert_array_equal(st.simulate(model, scaled, V0, t_span=0.02).q, fly(t_span=0.02).q)


def test_arguments_are_left_alone(model):
    q0, v0 = Q0 * 2, V0.copy()
    st.simulate(model, q0, v0, t_span=0.01)
    np.testing.assert_array_equal([*q0, *v0], [*(Q0 * 2), *V0])


# Conservation


@pytest.mark.parametrize(("settings", "drift"), [({}, 1e-8), (TIGHT, 1e-12)], ids=["rk4", "dop853"])
def test_free_flight_conserves(model, fly, settings, drift):
    flight = fly(t_span=0.25, **settings)
    assert not flight.tau.any()
    assert np.abs(flight.energy - flight.energy[0]).max() < drift * flight.kinetic.max()
    angular, linear = flight.angular_momentum, flight.linear_momentum
    assert np.abs(angular - angular[0]).max() < drift * np.linalg.norm(angular[0])
    fallen = linear + np.outer(flight.t, [0, 0, total_mass(model) * model.parameters["gravity"]])
    assert np.abs(fallen - linear[0]).max() < drift * np.linalg.norm(linear[0])
    assert np.ptp(flight.kinetic) > 1e-3 * flight.kinetic.max()


@pytest.mark.parametrize("gravity", [0.0, 9.8])
def test_centre_of_mass_flies_a_parabola(model, gravity):
    flight = st.simulate(model.with_parameters(gravity=gravity), Q0, V0, t_span=0.25, **TIGHT)
    centres, t = centre_of_mass(model, flight), flight.t[:, None]
    speed = flight.linear_momentum[0] / total_mass(model)
    parabola = centres[0] + speed * t - gravity * t**2 / 2 * [0, 0, 1]
    np.testing.assert_allclose(centres, parabola, atol=1e-13)
    assert np.abs(flight.q[:, :3] - centres).max() > 1e-3


@pytest.mark.parametrize(
    "controller",
    [st.Damping(DAMPING), lambda t, q, v: -np.array(DAMPING) * v[6:]],
    ids=["Damping", "function"],
)
def test_damping_takes_energy_by_its_power(model, fly, controller):
    flight = fly(
        t_span=0.25, controller=controller, output_step=1.25e-4, method="tsit5", rtol=1e-10
    )
    power = flight.v[:, 6:] ** 2 @ DAMPING
    lost = flight.energy[0] - flight.energy[-1]
    assert lost > 1e-3 * flight.kinetic[0]
    assert lost == pytest.approx(simpson(power, x=flight.t), rel=1e-8)
    angular = flight.angular_momentum
    assert np.abs(angular - angular[0]).max() < 1e-8 * np.linalg.norm(angular[0])


def test_torques_work(fly):
    """Energy changes by the work of the torques."""
    flight = fly(
        t_span=0.25,
        controller=lambda t, q, v: 1e-5 * np.cos(9 * t + np.arange(NT)),
        output_step=1.25e-4,
    )
    work = simpson((flight.tau * flight.v[:, 6:]).sum(axis=1), x=flight.t)
    assert abs(work) > 1e-6 and flight.energy[-1] - flight.energy[0] == pytest.approx(
        work, rel=1e-6
    )
