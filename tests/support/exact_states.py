"""States of tails in 40 digits, and the comparisons of their tests."""

from math import pi

import numpy as np
from scipy.spatial.transform import Rotation

from tests.references.parameters import random_states

BENDS = [1e-300, 1e-16, 1e-8, 1e-3, 1.0, pi, 2 * pi, 10.0]
ROUNDING = np.finfo(float).eps
RESIDUE = 1e-25
UPRIGHT = (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)


def states_of(segments, kind):
    """Two tuples (q, v, v_dot, tau)."""
    return list(zip(*random_states(segments, 17, 2, kind), strict=True))


def torso_rotation(q):
    """R_b, in float64."""
    return Rotation.from_quat(q[3:7], scalar_first=True).as_matrix()


def at_rest(tail_rates):
    """v of a tail that moves on a torso at rest."""
    return np.concatenate([np.zeros(6), tail_rates])


def assert_same_float64(x, x_ref):
    """Check that every entry is the same float64, except zeros, which are remainders of many
    digits.
    """
    x, x_ref = np.asarray(x), np.asarray(x_ref)
    floor = RESIDUE * np.max(np.abs(x_ref))
    np.testing.assert_array_equal(
        *(np.where(np.abs(values) < floor, 0.0, values) for values in (x, x_ref))
    )


def assert_same_quantities(tail, other, state):
    """Every quantity of two tails is the same float64 at one state."""
    q, v, v_dot, tau = state
    assert_same_float64(tail.mass_matrix(q), other.mass_matrix(q))
    assert_same_float64(tail.inverse_dynamics(q, v, v_dot), other.inverse_dynamics(q, v, v_dot))
    assert_same_float64(tail.forward_dynamics(q, v, tau), other.forward_dynamics(q, v, tau))
    assert_same_float64(tail.energy(q, v), other.energy(q, v))
    assert_same_float64(tail.momentum(q, v), other.momentum(q, v))
