"""What airborne motion adds to the equations of motion: the angular momentum about the centre of
mass is given, and omega follows from it.
"""

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
