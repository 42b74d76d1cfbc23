"""The steps that join chains at the torso: what a chain besides the tail adds there.

``side`` is 1, or -1 for the mirror image of a chain. Such a chain is computed as if it were on the
right, in the mirror image of the torso: there x of forces and places has the opposite sign, and so
have y and z of moments and turns.
"""

from sympy import Matrix, diag

from .rotations import entries, symmetric
from .shapes import M33, V1, V3, V6, V12


def polar(side: V1, vector) -> Matrix:
    """Return a place or a force, seen from the other side."""
    return Matrix([side[0] * vector[0], vector[1], vector[2]])


def axial(side: V1, vector) -> Matrix:
    """Return a moment or a turn, seen from the other side."""
    return Matrix([vector[0], side[0] * vector[1], side[0] * vector[2]])


def chain_composite(let, side: V1, tail_mount: V3, mass: V1, h: V3, I: V6) -> dict:
    """What a chain adds to mass, first moment and inertia at B, from its own at its mount."""
    r = tail_mount
    h_B = let("h_B", h + mass[0] * r)
    spread = let("spread", (h + h_B).dot(r))
    moved = entries(symmetric(I) + diag(spread, spread, spread) - (h * r.T + r * h_B.T))
    signs = [1, 1, 1, side[0], side[0], 1]
    return {
        "mass": mass,
        "h": polar(side, h_B),
        "I": Matrix([sign * entry for sign, entry in zip(signs, moved, strict=True)]),
    }


def chain_moment(let, side: V1, tail_mount: V3, mass: V1, h: V3) -> dict:
    """What a chain adds to mass and first moment at B."""
    return {"mass": mass, "h": polar(side, h + mass[0] * tail_mount)}


def chain_wrench(let, side: V1, tail_mount: V3, F_next: V6) -> dict:
    """What a chain adds to the wrench or the momentum at B, from that at its mount."""
    force = F_next[0:3, :]
    return {
        "force": polar(side, force),
        "moment": axial(side, F_next[3:6, :] + tail_mount.cross(force)),
    }


def chain_load(let, side: V1, F_beyond: V6) -> dict:
    """What the loads on a chain add to those at B."""
    return {
        "load_force": polar(side, F_beyond[0:3, :]),
        "load_moment": axial(side, F_beyond[3:6, :]),
    }


def mirrored_columns(let, side: V1, columns: V12) -> dict:
    """Momentum columns of a segment of a mirrored chain in torso axes."""
    parts = [columns[k : k + 3, :] for k in range(0, len(columns), 3)]
    turned = [(polar, axial)[k % 2](side, part) for k, part in enumerate(parts)]
    return {"columns": Matrix.vstack(*turned)}


def mirrored_torso(let, side: V1, R: M33) -> dict:
    """Attitude of the mirror image of the torso, in the mirror image of the world."""
    signs = diag(side[0], 1, 1)
    return {"R": signs * R * signs}


def mirrored_point(let, side: V1, S: V12, P: V3) -> dict:
    """Spatial columns at B, and a place, of a mirrored chain in the world, from those in its mirror
    image.
    """
    parts = [S[k : k + 3, :] for k in range(0, len(S), 3)]
    turned = [(axial, polar)[k % 2](side, part) for k, part in enumerate(parts)]
    return {"S": Matrix.vstack(*turned), "P": polar(side, P)}


def mirrored_motion(let, side: V1, w: V3, w_dot: V3, a: V3) -> dict:
    """The torso's motion, seen from the other side."""
    return {"w": axial(side, w), "w_dot": axial(side, w_dot), "a": polar(side, a)}


def mirrored_virtual(let, side: V1, w_virtual: V3, u_virtual: V3) -> dict:
    """A virtual motion of the torso, seen from the other side."""
    return {"w_virtual": axial(side, w_virtual), "u_virtual": polar(side, u_virtual)}


def mirrored_velocity(let, side: V1, w: V3, u: V3) -> dict:
    """The torso's angular and linear velocity, seen from the other side."""
    return {"w": axial(side, w), "u": polar(side, u)}


def mirrored_attitude(let, side: V1, R: M33) -> dict:
    """The matrix that gives places in the world from those in the mirror image of the torso."""
    return {"R": R * diag(side[0], 1, 1)}
