"""The meaning of a program: arrays and an algebra go in, the program runs statement by statement.

With numbers as the algebra this is the reference for every emitted text; with a tape it unrolls the
loops.
"""


def ldl_factor(algebra, A: list[list]) -> tuple[list[list], list]:
    """Factor A = L^T D L without pivoting, of its lower triangle; L below 1 / D on the diagonal,
    and the pivots D.

    From the last row up, because then all that a row takes from another one lies side by side.
    """
    A, pivots = [list(row) for row in A], []
    for k in reversed(range(len(A))):
        last = A[k]
        pivots.append(last[k])
        inverse = algebra.div(algebra.const(1), last[k])
        for i in reversed(range(k)):
            factor = algebra.mul(last[i], inverse)
            A[i] = [
                algebra.sub(entry, algebra.mul(factor, other))
                for entry, other in zip(A[i], last, strict=False)
            ]
        A[k] = [algebra.mul(entry, inverse) for entry in last[:k]] + [inverse]
    return A, pivots


def ldl_solve(algebra, A: list[list], b: list) -> list:
    """Solve L^T D L x = b with what ``ldl_factor`` returns."""
    return pair_solve(algebra, A, A, b)


def pair_factor(algebra, A: list[list], B: list[list]) -> tuple[list[list], list[list], list]:
    """Factor A = U D L without pivoting, of the lower triangles A of it and B of its transpose.

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
                one[i] = [
                    algebra.sub(e, algebra.mul(factor, r))
                    for e, r in zip(one[i], one[k], strict=False)
                ]
        A[k], B[k] = (
            [algebra.mul(entry, inverse) for entry in row[k][:k]] + [inverse] for row in (A, B)
        )
    return A, B, pivots


def pair_solve(algebra, A: list[list], B: list[list], b: list) -> list:
    """Solve U D L x = b with what ``pair_factor`` returns."""
    size, b = len(b), list(b)
    for k in reversed(range(size)):
        for i in range(k):
            b[i] = algebra.sub(b[i], algebra.mul(B[k][i], b[k]))
    b = [algebra.mul(value, A[k][k]) for k, value in enumerate(b)]
    for k in range(size):
        for i in range(k):
            b[k] = algebra.sub(b[k], algebra.mul(A[k][i], b[i]))
    return b
