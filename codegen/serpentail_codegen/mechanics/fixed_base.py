"""The steps of a base that never moves: B at the world's origin, with the world's axes."""

from sympy import Matrix

from .rotations import Z
from .shapes import V1, V3, V6


def resting_acceleration(let, gravity: V1) -> dict:
    """Gravity on a base at rest, as an acceleration of the base, upward."""
    return {"a": gravity[0] * Z}


def net_torque(let, tau: V1, inertial: V1) -> dict:
    """A torque minus the force that velocities and gravity require."""
    return {"rest": Matrix([tau[0] - inertial[0]])}


def resting_potential(let, gravity: V1, tail_mount: V3, mass: V1, h: V3) -> dict:
    """g times the tail's first moment along z; ``h`` is about the mount."""
    return {"potential": [gravity[0] * (h[2] + mass[0] * tail_mount[2])]}


def resting_momentum(let, mass: V1, h: V3, F_next: V6) -> dict:
    """The tail's momentum, and its moment about the tail's centre of mass, from those at the mount;
    ``h`` is about the mount, too.
    """
    force, moment = F_next[0:3, :], F_next[3:6, :]
    return {"linear": force, "angular": moment - h.cross(force) / mass[0]}


def resting_com(let, tail_mount: V3, mass: V1, h: V3) -> dict:
    """Position of the tail's COM, p_b2t + h / m; ``h`` is about the mount. And 1 / m."""
    inverse = let("inverse", 1 / mass[0])
    return {"position": tail_mount + h * inverse, "inverse_mass": [inverse]}


def resting_com_of_coordinate(let, inverse_mass: V1, column: V6, rate: V1) -> dict:
    """Velocity of the tail's COM per rate of one coordinate, f_k / m, and the part of this rate."""
    J = let("J", column[0:3, :] * inverse_mass[0])
    return {"J_column": J, "velocity": J * rate[0]}
