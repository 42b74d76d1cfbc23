"""Factoring and solving linear equations over any algebra, without pivoting.

The interpreter solves with these functions, and recorded on a tape they are the steps that factor
small matrices.  A matrix is given by its lower triangle, row by row.
"""

from typing import Any

from .algebra import Algebra

Triangle = list[list[Any]]


def ldl_factor(algebra: Algebra, A: Triangle) -> tuple[Triangle, list]:
    """Factor A = L^T D L; return L below 1 / D on the diagonal, and the pivots D.

    From the last row up, because then all that a row takes from another one lies side by side.
    """
    A, pivots = [list(row) for row in A], []
    for k in reversed(range(len(A))):
        last = A[k]
        pivots.append(last[k])
        inverse = algebra.div(algebra.const(1), last[k])
        for i in reversed(range(k)):
            factor = algebra.mul(last[i], inverse)
            A[i] = _reduced(algebra, A[i], factor, last)
        A[k] = [algebra.mul(entry, inverse) for entry in last[:k]] + [inverse]
    return A, pivots


def _reduced(algebra: Algebra, row: list, factor: Any, other: list) -> list:
    """Return row - factor * other, as far as the row goes."""
    pairs = zip(row, other, strict=False)
    return [algebra.sub(entry, algebra.mul(factor, taken)) for entry, taken in pairs]


def pair_factor(algebra: Algebra, A: Triangle, B: Triangle) -> tuple[Triangle, Triangle, list]:
    """Factor A = U D L, not symmetric, of the lower triangles A of it and B of its transpose.

    From the last row up, as ``ldl_factor``.  Return L below 1 / D, the transpose of U below it, and
    the pivots D.
    """
    A, B, pivots = [list(row) for row in A], [list(row) for row in B], []
    for k in reversed(range(len(A))):
        pivots.append(A[k][k])
        inverse = algebra.div(algebra.const(1), A[k][k])
        for one, other in ((A, B), (B, A)):
            for i in range(k):
                factor = algebra.mul(other[k][i], inverse)
                one[i] = _reduced(algebra, one[i], factor, one[k])
        A[k] = [algebra.mul(entry, inverse) for entry in A[k][:k]] + [inverse]
        B[k] = [algebra.mul(entry, inverse) for entry in B[k][:k]] + [inverse]
    return A, B, pivots


def pair_solve(algebra: Algebra, A: Triangle, B: Triangle, b: list) -> list:
    """Solve U D L x = b with what ``pair_factor`` returns; A = B is what ``ldl_factor`` returns."""
    size, b = len(b), list(b)
    for k in reversed(range(size)):
        for i in range(k):
            b[i] = algebra.sub(b[i], algebra.mul(B[k][i], b[k]))
    b = [algebra.mul(value, A[k][k]) for k, value in enumerate(b)]
    for k in range(size):
        for i in range(k):
            b[k] = algebra.sub(b[k], algebra.mul(A[k][i], b[i]))
    return b
