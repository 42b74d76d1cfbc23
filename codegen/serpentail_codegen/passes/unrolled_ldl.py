"""Eliminations: a program goes in, the same one with small matrices factored and solved by steps
comes out.

Pairs of triangles are factored in loops whatever their size: twice the entries spill, and whole
vectors are faster.
"""

from dataclasses import replace
from functools import cache

from ..ir.dataflow import rewritten
from ..ir.ldl import ldl_factor, ldl_solve, pair_solve
from ..ir.program import Apply, Array, Call, Factor, Guard, Program, Ref, Solve, SolvePair, padded
from ..ir.step import Step, compacted
from ..ir.tape import Tape


def unrolled_ldl(program: Program, largest: int) -> Program:
    """Return a program without loops of eliminations in matrices of up to ``largest`` rows."""
    pivots: dict[str, Array] = {}

    def rewrite(statement):
        if isinstance(statement, Factor) and statement.size <= largest:
            own = Array(f"pivots_{statement.matrix.name}", "local", statement.size)
            pivots[own.name] = own
            rows = _rows(statement.matrix, statement.size, statement.size)
            yield Apply(
                _factor_step(statement.size), rows, (*rows, own[0]), (False,) * (len(rows) + 1)
            )
            yield Guard(own[0], "NOT_POSITIVE_DEFINITE", rows)
        elif isinstance(statement, Solve | SolvePair) and statement.x.size <= largest:
            count = 2 if isinstance(statement, SolvePair) else 1
            rows = _rows(statement.matrix, count * statement.x.size, statement.x.size)
            step = _solve_step(statement.x.size, count)
            given = {f"row_{k}": row for k, row in enumerate(rows)} | {"x": statement.x}
            yield Apply(
                step, tuple(given[name] for name, _ in step.inputs), (statement.x,), (False,)
            )
        elif isinstance(statement, Call):
            yield replace(statement, program=unrolled_ldl(statement.program, largest))
        else:
            yield statement

    body = rewritten(program.body, rewrite)
    return replace(program, arrays=(*program.arrays, *pivots.values()), body=body)


def _rows(matrix: Array, count: int, size: int) -> tuple[Ref, ...]:
    """Return so many rows of lower triangles, one below the other."""
    return tuple(matrix.part(k * padded(size), k % size + 1) for k in range(count))


def _triangles(
    size: int, count: int
) -> tuple[Tape, list[list[list[int]]], tuple[tuple[str, int], ...]]:
    """Return a tape whose inputs are lower triangles, their entries row by row, and the rows' names
    and lengths.
    """
    tape = Tape()
    entries = (tape.input(k) for k in range(count * size * (size + 1) // 2))
    found = [[[next(entries) for _ in range(k + 1)] for k in range(size)] for _ in range(count)]
    return tape, found, tuple((f"row_{k}", k % size + 1) for k in range(count * size))


@cache
def _factor_step(size: int) -> Step:
    tape, (rows,), names = _triangles(size, 1)
    factored, pivots = ldl_factor(tape, rows)
    results = (*(entry for row in factored for entry in row), *pivots)
    doc = f"A = L^T D L of {size} rows; L below 1 / D on the diagonal, and the pivots D."
    return Step(
        f"factor_{size}", doc, names, (*names, ("pivots", size)), tuple(tape.nodes), results
    )


@cache
def _solve_step(size: int, count: int) -> Step:
    tape, triangles, names = _triangles(size, count)
    first = count * size * (size + 1) // 2
    solve, name, product = (
        (ldl_solve, "solve", "L^T D L") if count == 1 else (pair_solve, "solve_pair", "U D L")
    )
    x = solve(tape, *triangles, [tape.input(first + k) for k in range(size)])
    doc = f"Solve {product} x = x of {size} rows."
    step = Step(
        f"{name}_{size}", doc, (*names, ("x", size)), (("x", size),), tuple(tape.nodes), tuple(x)
    )
    return compacted(step)  # one of the pair's diagonals is not read
