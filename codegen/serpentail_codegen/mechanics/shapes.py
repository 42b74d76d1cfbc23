"""The types of what steps read: a step's annotations say how many numbers each vector holds.

``Vn`` is a column of n numbers; ``M33`` is a 3 x 3 matrix, whose nine numbers lie row by row in
the emitted code.
"""

from typing import Annotated

from sympy import Matrix

V1 = Annotated[Matrix, (1, 1)]
V2 = Annotated[Matrix, (2, 1)]
V3 = Annotated[Matrix, (3, 1)]
V4 = Annotated[Matrix, (4, 1)]
V6 = Annotated[Matrix, (6, 1)]
V8 = Annotated[Matrix, (8, 1)]
V9 = Annotated[Matrix, (9, 1)]
V10 = Annotated[Matrix, (10, 1)]
V12 = Annotated[Matrix, (12, 1)]
V15 = Annotated[Matrix, (15, 1)]
V16 = Annotated[Matrix, (16, 1)]
V18 = Annotated[Matrix, (18, 1)]
V27 = Annotated[Matrix, (27, 1)]
V30 = Annotated[Matrix, (30, 1)]
M33 = Annotated[Matrix, (3, 3)]
