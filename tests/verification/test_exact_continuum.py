"""The 40-digit continuum obeys exact laws to the last bit, whatever digits and nodes it has."""

from fractions import Fraction
from itertools import product

import mpmath
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.references.exact_continuum import ExactContinuum
from tests.references.metrics import block_error, equilibrated_condition
from tests.references.parameters import KINDS, TABLE_1
from tests.support.exact_states import (
    BENDS,
    ROUNDING,
    UPRIGHT,
    assert_same_float64,
    assert_same_quantities,
    at_rest,
    states_of,
    torso_rotation,
)
from tests.support.rows import row

STEP = 1e-6


def rows(sizes=(1, 2), count=2):
    """Yield a name, the exact continuum of a size, and a state of a kind: all of these."""
    for segments, kind in product(sizes, KINDS):
        exact = ExactContinuum(TABLE_1, segments)
        for state in states_of(segments, kind)[:count]:
            yield row(segments, kind), exact, *state


def test_laws_hold_but_for_the_rounding_of_float64():
    total = float(Fraction(TABLE_1["torso_mass"]) + Fraction(TABLE_1["tail_mass"]))
    for name, exact, q, v, v_dot, tau in rows():
        with name:
            mass, bias, axes = exact.mass_matrix(q), exact.bias_force(q, v), torso_rotation(q)
            assert_same_float64(mass[:3, :3], total * np.eye(3))
            # no more than the rounding of H, C and of these sums in float64
            unit, sizes = exact.nv * ROUNDING, np.abs(mass)
            force = exact.inverse_dynamics(q, v, v_dot)
            error = np.abs(force - (mass @ v_dot + bias))
            assert np.all(error <= unit * (sizes @ np.abs(v_dot) + np.abs(bias)))
            kinetic = exact.energy(q, v)[0] - v @ mass @ v / 2
            assert abs(kinetic) <= unit * (np.abs(v) @ sizes @ np.abs(v))
            (linear, angular), momentum = exact.momentum(q, v), mass @ v
            np.testing.assert_allclose(linear, momentum[:3], atol=1e-14)
            # H_p,omega = -M (c - p)~ R_b
            about_torso = angular - mass[:3, 3:6] @ axes.T @ linear / mass[0, 0]
            np.testing.assert_allclose(axes @ momentum[3:6], about_torso, atol=1e-15)
            found = exact.forward_dynamics(q, v, tau, force - at_rest(tau))
            assert block_error(found, v_dot) <= 1e-14 * equilibrated_condition(mass)


def test_power_is_the_rate_of_energy():
    for name, exact, q, v, v_dot, _ in rows(count=1):
        with name:
            after, before = (
                sum(exact.energy(displaced(q, v, time), v + time * v_dot)) for time in (STEP, -STEP)
            )
            power = v * exact.inverse_dynamics(q, v, v_dot)
            assert abs((after - before) / (2 * STEP) - sum(power)) <= 1e-8 * sum(abs(power))


def displaced(q, v, time):
    """The configuration reached from q in a time at the constant velocity v."""
    turned = Rotation.from_quat(q[3:7], scalar_first=True) * Rotation.from_rotvec(time * v[3:6])
    return np.concatenate(
        [q[:3] + time * v[:3], turned.as_quat(scalar_first=True), q[7:] + time * v[6:]]
    )


def test_internal_dynamics_do_not_depend_on_the_pose_to_the_last_bit():
    for name, exact, q, v, *_ in rows((1,), 1):
        with name:
            free = ExactContinuum({**TABLE_1, "gravity": 0.0}, exact.segments)
            upright = np.concatenate([UPRIGHT, q[7:]])
            internal = np.concatenate([np.zeros(3), v[3:]])
            assert_same_float64(free.mass_matrix(q)[3:, 3:], free.mass_matrix(upright)[3:, 3:])
            assert_same_float64(free.bias_force(q, v)[3:], free.bias_force(upright, internal)[3:])


@pytest.mark.parametrize("segments", [1, pytest.param(3, marks=pytest.mark.slow)])
def test_more_digits_and_nodes_give_the_same_float64(segments):
    few, many = (ExactContinuum(TABLE_1, segments, *size) for size in [(40, 24), (60, 32)])
    states = {kind: states_of(segments, kind)[1] for kind in KINDS}
    q, *others = states_of(segments, "random")[0]
    turns = np.tile([0.6, -0.8], segments)
    states |= {bend: (np.concatenate([q[:7], bend * turns]), *others) for bend in (0.0, *BENDS)}
    for name, state in states.items():
        with row(name):
            assert_same_quantities(few, many, state)
            assert_same_float64(few.tail_points(state[0], 3), many.tail_points(state[0], 3))


def test_nodes_integrate_polynomials():
    for count in (1, 2, 15, 24):
        continuum = ExactContinuum(TABLE_1, 1, nodes=count)
        shares = continuum.masses[1:] / continuum.mp.mpf(TABLE_1["tail_mass"])
        for power in range(2 * count):
            with row(count, power):
                assert abs(np.dot(shares, continuum.nodes**power) * (power + 1) - 1) <= 1e-37


def test_digits_are_the_continuum_s_own_and_arguments_are_left_alone():
    digits = mpmath.mp.dps
    for name, exact, q, v, v_dot, tau in rows((1,), 1):
        with name:
            expected = exact.bias_force(q, v)
            with mpmath.workdps(5):
                other = ExactContinuum(TABLE_1, exact.segments)
                np.testing.assert_array_equal(other.bias_force(q, v), expected)
            assert other.mp.dps == 40
            scaled = q.copy()
            scaled[3:7] *= 2
            given = [x.copy() for x in (scaled, v, v_dot, tau)]
            np.testing.assert_array_equal(exact.bias_force(scaled, v), expected)
            exact.forward_dynamics(scaled, v, tau, exact.inverse_dynamics(scaled, v, v_dot))
            for x, x_given in zip((scaled, v, v_dot, tau), given, strict=True):
                np.testing.assert_array_equal(x, x_given)
    assert mpmath.mp.dps == digits
