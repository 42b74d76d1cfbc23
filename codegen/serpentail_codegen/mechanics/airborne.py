"""What airborne motion adds to the equations of motion: the angular momentum about the centre of
mass is given, and omega follows from it.
"""

from sympy import Matrix

from .rotations import X, Y, Z
from .shapes import M33, V1, V3, V6


def momentum_in_torso(let, R: M33, angular: V3) -> dict:
    """The angular momentum in torso axes, R^T h."""
    return {"momentum": R.T * angular}


def tail_momentum(let, column: V6, rate: V1) -> dict:
    """Momentum and its moment about B of one tail coordinate's rate, at rest of the torso."""
    return {"linear": column[0:3, :] * rate[0], "angular": column[3:6, :] * rate[0]}


def opposite(let, vector: V3) -> dict:
    """Minus a vector."""
    return {"opposite": -vector}


def product(let, weight: V1, row: V1) -> dict:
    """A row times a weight."""
    return {"sum": [weight[0] * row[0]]}


def upward(let, gravity: V1) -> dict:
    """g z, the acceleration that replaces gravity, world axes."""
    return {"pull": gravity[0] * Z}


def drift_rate(let, a: V3, pull: V3, omega: V3, u: V3) -> dict:
    """Rate of the velocity of B against the air, torso axes: a - R^T g z - omega x u."""
    return {"rate": a - pull - omega.cross(u)}


def drift_change(let, a: V3, pull: V3, omega: V3, u: V3, turn: V3, drift: V3) -> dict:
    """Change of that rate with those of a, R^T g z, omega (``turn``) and u (``drift``)."""
    return {"rate": a - pull - turn.cross(u) - omega.cross(drift)}


def drift_curvature(let, weight: V3) -> dict:
    """Second derivatives of the weighted rate by omega (rows) and u."""
    axes = (X, Y, Z)
    rows = [[-weight.dot(axis.cross(other)) for other in axes] for axis in axes]
    return {f"row_{r}": Matrix(row) for r, row in enumerate(rows)}
