"""What a turn of the torso, in its own axes, does to the virtual power P = lambda^T (H v_dot + C).

In torso axes the attitude is seen in two vectors alone, which stay where they are in the world: a =
R^T (p_b_ddot + g z), and u, the virtual velocity of B.  P = M a . u + a . f + u . g + ..., where
neither vector is in f or g, and ``b_a = f + M u``, ``b_u = g + M a`` are its gradients.
"""

from sympy import Matrix, eye

from .rotations import X, Y, Z
from .shapes import M33, V1, V3


def turned_back(let, vector: V3, turn: V3) -> dict:
    """Change, in torso axes, of a vector that is constant in the world."""
    return {"change": vector.cross(turn)}


def turning_force(let, R: M33, force: V3, turn: V3, change: V3) -> dict:
    """Change of a force in world axes with a turn, from the force and its change in torso axes."""
    return {"change": R * let("both", change + turn.cross(force))}


def power_by_turn(let, a: V3, u: V3, b_a: V3, b_u: V3) -> dict:
    """Gradient of P by a rotation: f x a + g x u, because M (u x a + a x u) is zero."""
    return {"turn": b_a.cross(a) + b_u.cross(u)}


def term_by_turn(let, gradient: V3, vector: V3) -> dict:
    """Gradient by a rotation of the term gradient . vector, with the vector constant in the world.

    For a row of H lambda in the tail this is f_k . u, where f_k is the change of the first moment
    with the tail coordinate.
    """
    return {"turn": gradient.cross(vector)}


def turn_curvature(let, torso_mass: V1, tail_mass: V1, a: V3, u: V3, b_a: V3, b_u: V3) -> dict:
    """Second derivatives of P by rotations (by the exponential map), row by row."""
    mass = let("mass", torso_mass[0] + tail_mass[0])
    pairs = ((a, let("f", b_a - mass * u)), (u, let("g", b_u - mass * a)))
    total = -let("trace", a.dot(pairs[0][1]) + u.dot(pairs[1][1])) * eye(3)
    for vector, factor in pairs:
        half = let("half", factor / 2)
        total += half * vector.T + vector * half.T
    return {f"row_{r}": total.row(r).T for r in range(3)}


def turned_momentum(let, torso_mass: V1, tail_mass: V1, R: M33, h: V3, u: V3, b_a: V3) -> dict:
    """Change of the first six rows of H lambda with a rotation, row by row: R (turn x f), and h x
    (u x turn).
    """
    f = let("f", b_a - let("mass", torso_mass[0] + tail_mass[0]) * u)
    force = [R * axis.cross(f) for axis in (X, Y, Z)]
    moment = [h.cross(u.cross(axis)) for axis in (X, Y, Z)]
    columns = [Matrix([*pair[0], *pair[1]]) for pair in zip(force, moment, strict=True)]
    return {f"row_{r}": Matrix([column[r] for column in columns]) for r in range(6)}
