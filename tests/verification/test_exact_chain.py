"""The 40-digit articulated tail obeys exact laws to the last bit, and measures are as said."""

from fractions import Fraction
from itertools import product

import mpmath
import numpy as np
import pytest

from tests.references.exact_chain import ExactChain
from tests.references.metrics import block_error, equilibrated_condition
from tests.references.parameters import KINDS, TABLE_1, random_states
from tests.support.exact_states import (
    ROUNDING,
    UPRIGHT,
    assert_same_float64,
    assert_same_quantities,
    at_rest,
)
from tests.support.rows import row

SIZES = [(1, 1), (1, 3), (3, 4)]


def rows(sizes=SIZES, count=2):
    """Yield a name, the exact chain of a size, and a state of a kind: all of these."""
    for size, kind in product(sizes, KINDS):
        for state in zip(*random_states(size[0], 11, count, kind), strict=True):
            yield row(size, kind), ExactChain(TABLE_1, *size), *state


def test_laws_hold_but_for_the_rounding_of_float64():
    total = float(Fraction(TABLE_1["torso_mass"]) + Fraction(TABLE_1["tail_mass"]))
    for name, exact, q, v, v_dot, tau in rows():
        with name:
            mass, bias = exact.mass_matrix(q), exact.bias_force(q, v)
            np.testing.assert_array_equal(mass[:3, :3], total * np.eye(3))
            # no more than the rounding of H, C and of these sums in float64
            unit, sizes = exact.nv * ROUNDING, np.abs(mass)
            force = exact.inverse_dynamics(q, v, v_dot)
            error = np.abs(force - (mass @ v_dot + bias))
            assert np.all(error <= unit * (sizes @ np.abs(v_dot) + np.abs(bias)))
            kinetic = exact.energy(q, v)[0] - v @ mass @ v / 2
            assert abs(kinetic) <= unit * (np.abs(v) @ sizes @ np.abs(v))
            linear = np.abs(exact.momentum(q, v)[0] - mass[:3] @ v)
            assert np.all(linear <= unit * (sizes[:3] @ np.abs(v)))
            found = exact.forward_dynamics(q, v, tau, force - at_rest(tau))
            assert block_error(found, v_dot) <= 1e-14 * equilibrated_condition(mass)


def test_more_digits_give_the_same_float64():
    for name, exact, *state in rows([(1, 3), (3, 4)], 1):
        with name:
            for digits in (30, 50):
                other = ExactChain(TABLE_1, exact.segments, exact.links, digits)
                assert_same_quantities(exact, other, state)


def test_internal_dynamics_do_not_depend_on_the_pose_to_the_last_bit():
    for name, exact, q, v, *_ in rows():
        with name:
            chain = ExactChain({**TABLE_1, "gravity": 0.0}, exact.segments, exact.links)
            upright, internal = (
                np.concatenate([UPRIGHT, q[7:]]),
                np.concatenate([np.zeros(3), v[3:]]),
            )
            assert_same_float64(chain.mass_matrix(q)[3:, 3:], chain.mass_matrix(upright)[3:, 3:])
            assert_same_float64(chain.bias_force(q, v)[3:], chain.bias_force(upright, internal)[3:])


def test_one_link_is_the_universal_pendulum_to_the_last_bit():
    for name, chain, q, v, *_ in rows([(1, 1)]):
        with name:
            upright = np.concatenate([UPRIGHT, q[7:]])
            coupling, mass, bias = pendulum(q[7:], v[6:])
            assert_same_float64(chain.mass_matrix(upright)[:3, 6:], coupling)
            assert_same_float64(chain.mass_matrix(upright)[6:, 6:], mass)
            assert_same_float64(chain.bias_force(upright, at_rest(v[6:]))[6:], bias)


@mpmath.workdps(50)
def pendulum(angles, rates):
    """H_pt, H_tt and C_t of one link on a torso at rest in the world's axes, by Lagrange's
    equations.
    """
    mass, gravity, half, across, along = one_link()
    (ca, sa), (cb, sb) = (mpmath.cos_sin(angle) for angle in angles)
    pitch = [0, half * cb * sa, -half * cb * ca]  # d p_com / d alpha
    yaw = [half * cb, half * sb * ca, half * sb * sa]  # d p_com / d beta
    spread = mass * half**2 + across - along  # H_aa = along + spread cos(beta)^2
    alpha_dot, beta_dot = (mpmath.mpf(rate) for rate in rates)
    coupling = [[mass * x, mass * y] for x, y in zip(pitch, yaw, strict=True)]
    inertia = [[along + spread * cb**2, 0], [0, across + mass * half**2]]
    bias = [
        mass * gravity * pitch[2] - 2 * spread * cb * sb * alpha_dot * beta_dot,
        mass * gravity * yaw[2] + spread * cb * sb * alpha_dot**2,
    ]
    return tuple(np.array(values, dtype=float) for values in (coupling, inertia, bias))


def one_link():
    """m, g, L/2 and the moments of an ellipsoid (r, L/2, r) across and along its axis."""
    names = ("tail_mass", "gravity", "tail_length", "link_radius")
    mass, gravity, length, radius = (mpmath.mpf(TABLE_1[name]) for name in names)
    half = length / 2
    return mass, gravity, half, mass * (half**2 + radius**2) / 5, mass * 2 * radius**2 / 5


def test_straight_tail_has_the_rational_inertia_to_the_last_bit():
    for links in range(1, 9):
        with row(links):
            chain = ExactChain({**TABLE_1, "link_radius": 0.1}, 1, links)
            mass_matrix = chain.mass_matrix(np.eye(chain.nq)[3])
            coupling, inertia = straight_tail(Fraction(0.1), links)
            assert_same_float64(mass_matrix[:3, 6:], [[0, coupling], [0, 0], [-coupling, 0]])
            assert_same_float64(mass_matrix[6:, 6:], inertia * np.eye(2))


def straight_tail(radius, links):
    """Sums of m l j^2 / 2 and m (l j^2 / 2)^2 + I j^2 over links that turn at j times the rate."""
    mass, length = (Fraction(TABLE_1[name]) / links for name in ("tail_mass", "tail_length"))
    across = mass * (radius**2 + (length / 2) ** 2) / 5
    arms = [(rate, length * rate**2 / 2) for rate in range(1, links + 1)]
    inertia = sum(mass * arm**2 + across * rate**2 for rate, arm in arms)
    return float(mass * sum(arm for _, arm in arms)), float(inertia)


def test_digits_are_the_chain_s_own_and_arguments_are_left_alone():
    digits = mpmath.mp.dps
    for name, exact, q, v, v_dot, tau in rows([(1, 3)], 1):
        with name:
            expected = exact.bias_force(q, v)
            with mpmath.workdps(5):
                np.testing.assert_array_equal(ExactChain(TABLE_1, 1, 3).bias_force(q, v), expected)
            scaled = q.copy()
            scaled[3:7] *= 2
            given = [x.copy() for x in (scaled, v, v_dot, tau)]
            np.testing.assert_array_equal(exact.bias_force(scaled, v), expected)
            exact.forward_dynamics(scaled, v, tau, exact.inverse_dynamics(scaled, v, v_dot))
            for x, x_given in zip((scaled, v, v_dot, tau), given, strict=True):
                np.testing.assert_array_equal(x, x_given)
    assert mpmath.mp.dps == digits


def test_states_are_seeded():
    for kind in KINDS:
        first, again, other = (random_states(2, seed, 4, kind) for seed in (1, 1, 2))
        for x, same in zip(first, again, strict=True):
            np.testing.assert_array_equal(x, same)
        assert [x.shape for x in first] == [(4, 11), (4, 10), (4, 10), (4, 4)]
        assert not np.array_equal(first[1], other[1])


def test_errors_are_relative_to_their_blocks_and_conditions_to_the_diagonal():
    reference = np.array([1, 0, 0, 0, 1e-3, 0, 1e-5, 0])
    assert block_error(reference + 1e-9 * np.eye(8)[7], reference) == pytest.approx(1e-4)
    assert block_error(reference, reference) == 0
    reference = np.array([1, 0, 0, 0, 0, 0, 1, 0])
    assert block_error(reference + 1e-16 * np.eye(8)[4], reference) == pytest.approx(1e-10)
    assert block_error(np.full(8, 1e-3), np.zeros(8)) == 1e-3
    mass, scale = np.array([[2.0, 1.0], [1.0, 2.0]]), np.diag([1, 1e-4])
    assert equilibrated_condition(scale @ mass @ scale) == pytest.approx(3)
