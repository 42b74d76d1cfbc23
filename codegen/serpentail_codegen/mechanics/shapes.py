"""The types of what steps read: a step's annotations say how many numbers each vector holds.

``Vn`` is a column of n numbers; ``M33`` is a 3 x 3 matrix, whose nine numbers lie row by row in
the emitted code.  ``V3x8`` are eight columns of 3, the vectors ``<argument>_0`` to
``<argument>_7``.  A dataclass groups vectors that belong together.
"""

from dataclasses import dataclass
from typing import Annotated

from sympy import Matrix

V1 = Annotated[Matrix, (1, 1)]
V2 = Annotated[Matrix, (2, 1)]
V3 = Annotated[Matrix, (3, 1)]
V4 = Annotated[Matrix, (4, 1)]
V5 = Annotated[Matrix, (5, 1)]
V6 = Annotated[Matrix, (6, 1)]
V8 = Annotated[Matrix, (8, 1)]
V9 = Annotated[Matrix, (9, 1)]
V10 = Annotated[Matrix, (10, 1)]
V12 = Annotated[Matrix, (12, 1)]
V13 = Annotated[Matrix, (13, 1)]
V15 = Annotated[Matrix, (15, 1)]
V16 = Annotated[Matrix, (16, 1)]
V18 = Annotated[Matrix, (18, 1)]
V27 = Annotated[Matrix, (27, 1)]
V30 = Annotated[Matrix, (30, 1)]
M33 = Annotated[Matrix, (3, 3)]
V3x6 = Annotated[tuple[Matrix, ...], (3, 1), 6]
V3x8 = Annotated[tuple[Matrix, ...], (3, 1), 8]
V6x3 = Annotated[tuple[Matrix, ...], (6, 1), 3]
V6x6 = Annotated[tuple[Matrix, ...], (6, 1), 6]


@dataclass(frozen=True)
class FrameMotion:
    """Angular velocity of a frame, its rate, and the acceleration of the frame's origin."""

    w: V3
    w_dot: V3
    a: V3


@dataclass(frozen=True)
class CoordinateMotion:
    """Rates and accelerations of a segment's coordinates, and virtual rates."""

    rates: V2
    accelerations: V2
    virtual_rates: V2


@dataclass(frozen=True)
class VirtualMotion:
    """Virtual angular velocity of a frame, and virtual velocity of its origin."""

    w_virtual: V3
    u_virtual: V3
