"""Mass, inertia and momentum of a segment of the continuum tail, about its root (Eq. 18).

The integrals over x are the form factors of `arc_shape`.
"""

from dataclasses import dataclass

from sympy import Matrix, eye

from .arc import ArcTip, geometry
from .arc_shape import factors
from .rotations import Y, entries, symmetric
from .shapes import M33, V1, V2, V3, V6, V16


@dataclass(frozen=True)
class ArcInertia:
    """A segment's first moment and inertia at its root, its momentum columns, and block of H."""

    h_own: V3
    I_own: V6
    pitch_own: V6
    yaw_own: V6
    H_own: V3


def segment_inertia(let, angles: V2, shape: V16, section: V2) -> dict:
    """A segment's first moment and inertia at its root, momentum columns of a and b, and 2 x 2
    block of H (Eq. 18).
    """
    a, b, _, u, du = geometry(let, angles)
    m, length = section
    f, (moment, spread) = factors(shape), let("mL", Matrix([m * length, m * length * length]))
    second = f["ss"] * Y * Y.T - f["sg"] * (Y * u.T + u * Y.T) + f["gg"] * u * u.T

    # momentum of all slices per unit rate of a and of b
    columns = []
    for q, d in zip((a, b), du, strict=True):
        linear = 2 * q * (f["g_z"] * u - f["s_z"] * Y) + f["g"] * d
        angular = 2 * q * f["side"] * Y.cross(u) - f["sg"] * Y.cross(d) + f["gg"] * u.cross(d)
        columns.append(Matrix([moment * let("p", linear), spread * let("L", angular)]))

    # kinetic energy of bending alone
    block = Matrix([f["gg"] + a * a * f["along"], a * b * f["along"], f["gg"] + b * b * f["along"]])
    return {
        "h_own": moment * let("h", f["g"] * u - f["s"] * Y),
        "I_own": entries(spread * let("I", 2 * f["g"] * eye(3) - second)),
        "pitch_own": columns[0],
        "yaw_own": columns[1],
        "H_own": spread * let("H", block),
    }


def rotated_inertia(let, E, I) -> Matrix:
    """E I E^T."""
    return let("turned", entries(let("half", E * symmetric(I)) * E.T))


def gather_segment(let, section: V2, end: ArcTip, own: ArcInertia, mass: V1, h: V3, I: V6) -> dict:
    """Composite inertia at the root, from the composite inertia at the tip; momentum columns of a
    and b, and their block of H.
    """
    # the blocks that Eq. 18 has for this segment and for all beyond, which its bend moves, too
    # what is beyond, from the tip to the root
    E, r, bend = end.E, end.r, end.bend
    h_tip, I_tip = let("h_tip", E * h), symmetric(rotated_inertia(let, E, I))
    h_root = let("h_root", h_tip + mass[0] * r)
    spread = let("spread", (h_tip + h_root).dot(r))
    I_root = entries(I_tip + spread * eye(3) - (h_tip * r.T + r * h_root.T))

    # momentum columns: of this segment, and of what its bend moves beyond
    columns, twists = [], []
    for k, column in ((0, own.pitch_own), (6, own.yaw_own)):
        turn, move = bend[k : k + 3, :], bend[k + 3 : k + 6, :]
        p = let("p", mass[0] * move + turn.cross(h_tip))
        L = let("L", I_tip * turn + h_tip.cross(move))
        twists.append((turn, move, p, L))
        columns.append(Matrix([column[0:3, :] + p, column[3:6, :] + L + r.cross(p)]))

    # this segment's block of H: what its bend does to all beyond
    beyond = [
        twists[i][0].dot(twists[j][3]) + twists[i][1].dot(twists[j][2])
        for i, j in ((0, 0), (1, 0), (1, 1))
    ]
    return {
        "mass": mass + Matrix([section[0]]),
        "h": own.h_own + h_root,
        "I": own.I_own + I_root,
        "pitch": columns[0],
        "yaw": columns[1],
        **{name: [own.H_own[k] + beyond[k]] for k, name in enumerate(("H_pp", "H_py", "H_yy"))},
    }


def gather_segment_moment(let, section: V2, E: M33, r: V3, h_own: V3, mass: V1, h: V3) -> dict:
    """Mass and first moment of a segment and all beyond, at its root."""
    return {"mass": mass + Matrix([section[0]]), "h": h_own + E * h + mass[0] * r}


def segment_momentum(let, rates: V2, section: V2, own: ArcInertia, w: V3, u: V3) -> dict:
    """Momentum of a segment, its moment about the root, and its kinetic energy."""
    # momentum of the frame's motion and of bending
    relative, H = let("relative", rates[0] * own.pitch_own + rates[1] * own.yaw_own), own.H_own
    p = let("p", section[0] * u + w.cross(own.h_own) + relative[0:3, :])
    L = let("L", symmetric(own.I_own) * w + own.h_own.cross(u) + relative[3:6, :])

    # twice the kinetic energy: the frame's, of both, of bending
    bending = rates[0] ** 2 * H[0] + 2 * rates[0] * rates[1] * H[1] + rates[1] ** 2 * H[2]
    twice = let(
        "twice", u.dot(p) + w.dot(L) + u.dot(relative[0:3, :]) + w.dot(relative[3:6, :]) + bending
    )
    return {"F": Matrix([p, L]), "kinetic": [twice / 2]}
