"""Rates of airborne states from full dynamics and momentum, in 60 digits, and their differences.

Velocity of B and omega are those that the momenta leave, which are linear in them; accelerations
solve all rows of the equation of motion. Nothing is eliminated, and nothing is derived.
"""

import numpy as np

from .body_set import MP, Animal, exact
from .passive import PassiveTail

SHIFT = MP.mpf(10) ** -7


def rates(animal: Animal, passive: PassiveTail, x, tau, angular):
    """Return y: rates of x = (quaternion, q_t, q_t_dot), then omega."""
    x, tau, nt = exact(x), exact(tau), len(tau)
    q, tail_rates = np.array([*exact(np.zeros(3)), *x[: 4 + nt]]), x[4 + nt :]

    # velocity of B, and omega
    unit = np.eye(6 + nt)
    columns = [np.concatenate(animal.momenta(q, exact(unit[k]))) for k in range(6)]
    still = np.array([*exact(np.zeros(6)), *tail_rates])
    wanted = np.array([*exact(np.zeros(3)), *exact(angular)])
    motion = solved(np.array(columns).T, wanted - np.concatenate(animal.momenta(q, still)))
    v = np.array([*motion, *tail_rates])

    # accelerations
    bias = animal.inverse_dynamics(q, v, np.zeros(6 + nt))
    own = passive.force(q[7:], tail_rates)
    force = np.array([*exact(np.zeros(6)), *(tau - own)]) - bias
    v_dot = solved(animal.inertia(q), force)
    return np.array([*turning(x[:4], motion[3:]), *tail_rates, *v_dot[6:], *motion[3:]])


def turning(quaternion, omega):
    """Return quaternion (0, omega) / 2."""
    w, e = quaternion[0], quaternion[1:]
    a, b, c = omega
    across = np.array([e[1] * c - e[2] * b, e[2] * a - e[0] * c, e[0] * b - e[1] * a])
    return np.array([-e.dot(omega), *(w * omega + across)]) / 2


def solved(A, b):
    """Return A^-1 b."""
    return np.array([*MP.lu_solve(MP.matrix(A.tolist()), MP.matrix(b.tolist()))])


def along(animal: Animal, passive: PassiveTail, x, tau, angular, direction):
    """Return y, and its first and second derivative along a direction of (x, tau), in float64."""
    z, step = exact(np.concatenate([x, tau])), exact(direction) * SHIFT
    size = len(x)
    behind, here, ahead = (
        rates(animal, passive, at[:size], at[size:], angular) for at in (z - step, z, z + step)
    )
    first, second = (ahead - behind) / (2 * SHIFT), (ahead - 2 * here + behind) / SHIFT**2
    return tuple(values.astype(float) for values in (here, first, second))
