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
