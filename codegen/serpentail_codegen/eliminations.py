"""Eliminations: a program goes in, the same one with small matrices factored and solved by steps comes out."""

from dataclasses import replace
from functools import cache

from .compose import rewritten
from .interpret import ldl_factor, ldl_solve
from .program import Apply, Array, Call, Factor, Guard, Program, Ref, Solve, padded
from .tape import Step, Tape


def written_out(program: Program, largest: int) -> Program:
    """Return a program without loops of eliminations in matrices of up to ``largest`` rows."""
    pivots: dict[str, Array] = {}

    def rewrite(statement):
        if isinstance(statement, Factor) and statement.size <= largest:
            own = Array(f"pivots_{statement.matrix.name}", "local", statement.size)
            pivots[own.name] = own
            rows = _rows(statement.matrix, statement.size)
            yield Apply(_factor_step(statement.size), rows, (*rows, own[0]), (False,) * (len(rows) + 1))
            yield Guard(own[0], "NOT_POSITIVE_DEFINITE", rows)
        elif isinstance(statement, Solve) and statement.x.size <= largest:
            rows = _rows(statement.matrix, statement.x.size)
            yield Apply(_solve_step(statement.x.size), (*rows, statement.x), (statement.x,), (False,))
        elif isinstance(statement, Call):
            yield replace(statement, program=written_out(statement.program, largest))
        else:
            yield statement

    body = rewritten(program.body, rewrite)
    return replace(program, arrays=(*program.arrays, *pivots.values()), body=body)


def _rows(matrix: Array, size: int) -> tuple[Ref, ...]:
    """Return the rows of the lower triangle."""
    return tuple(matrix.part(k * padded(size), k + 1) for k in range(size))


def _triangle(size: int) -> tuple[Tape, list[list[int]], tuple[tuple[str, int], ...]]:
    """Return a tape whose inputs are a lower triangle, its entries row by row, and the rows' names and lengths."""
    tape = Tape()
    rows = [[tape.input(k * (k + 1) // 2 + j) for j in range(k + 1)] for k in range(size)]
    return tape, rows, tuple((f"row_{k}", k + 1) for k in range(size))


@cache
def _factor_step(size: int) -> Step:
    tape, rows, names = _triangle(size)
    factored, pivots = ldl_factor(tape, rows)
    results = (*(entry for row in factored for entry in row), *pivots)
    doc = f"A = L^T D L of {size} rows; L below 1 / D on the diagonal, and the pivots D."
    return Step(f"factor_{size}", doc, names, (*names, ("pivots", size)), tuple(tape.nodes), results)


@cache
def _solve_step(size: int) -> Step:
    tape, rows, names = _triangle(size)
    first = size * (size + 1) // 2
    x = ldl_solve(tape, rows, [tape.input(first + k) for k in range(size)])
    doc = f"Solve L^T D L x = x of {size} rows."
    return Step(f"solve_{size}", doc, (*names, ("x", size)), (("x", size),), tuple(tape.nodes), tuple(x))
