"""Small linear systems without loops: matrices are factored and solved by straight-line steps.

Pairs of triangles are factored in loops whatever their size: twice the entries spill registers, and
whole vectors are faster.
"""

from collections.abc import Iterator
from dataclasses import replace
from functools import cache

from ..ir import program as ir
from ..ir.dataflow import rewritten
from ..ir.ldl import ldl_factor, pair_solve
from ..ir.step import Step, compacted
from ..ir.tape import Tape


def unrolled_ldl(program: ir.Program, largest: int) -> ir.Program:
    """Return a program whose matrices of up to ``largest`` rows are eliminated without loops."""
    pivots: dict[str, ir.Array] = {}

    def rewrite(statement: ir.Statement) -> Iterator[ir.Statement]:
        if isinstance(statement, ir.Factor) and not statement.pair and statement.size <= largest:
            name = f"pivots_{statement.matrix.name}"
            pivots[name] = ir.Array(name, "local", statement.size)
            yield from _factored(statement, pivots[name])
        elif isinstance(statement, ir.Solve) and statement.x.size <= largest:
            yield _solved(statement)
        elif isinstance(statement, ir.Call):
            yield replace(statement, program=unrolled_ldl(statement.program, largest))
        else:
            yield statement

    body = rewritten(program.body, rewrite)
    return replace(program, arrays=(*program.arrays, *pivots.values()), body=body)


def _factored(factor: ir.Factor, pivots: ir.Array) -> Iterator[ir.Statement]:
    """Yield the step that factors a matrix in place, and the guard of its pivots."""
    rows = _rows(factor.matrix, factor.size, factor.size)
    step = _factor_step(factor.size)
    yield ir.Apply(step, rows, (*rows, pivots[0]), (False,) * (len(rows) + 1))
    yield ir.Guard(pivots[0], "NOT_POSITIVE_DEFINITE", rows)


def _solved(solve: ir.Solve) -> ir.Apply:
    """Return the step that solves with a factored matrix, or with a factored pair."""
    size, triangles = solve.x.size, 2 if solve.pair else 1
    rows = _rows(solve.matrix, triangles * size, size)
    step = _solve_step(size, triangles)
    inputs = {f"row_{k}": row for k, row in enumerate(rows)} | {"x": solve.x}
    return ir.Apply.named(step, inputs, (solve.x,))


def _rows(matrix: ir.Array, count: int, size: int) -> tuple[ir.Ref, ...]:
    """Return so many rows of lower triangles, one below the other."""
    return tuple(matrix.part(k * ir.padded(size), k % size + 1) for k in range(count))


def _row_names(size: int, triangles: int) -> tuple[tuple[str, int], ...]:
    """Return the rows of lower triangles as the vectors of a step: names and lengths."""
    return tuple((f"row_{k}", k % size + 1) for k in range(triangles * size))


def _recorded_triangle(tape: Tape, first: int, size: int) -> list[list[int]]:
    """Return a lower triangle of inputs, from input number ``first`` on, row by row."""
    triangle: list[list[int]] = []
    for row in range(size):
        triangle.append([tape.input(first + k) for k in range(row + 1)])
        first += row + 1
    return triangle


@cache
def _factor_step(size: int) -> Step:
    """Return the step that factors a matrix, its inputs and outputs the rows of a triangle."""
    tape, rows = Tape(), _row_names(size, 1)
    factored, pivots = ldl_factor(tape, _recorded_triangle(tape, 0, size))
    results = (*(entry for row in factored for entry in row), *pivots)
    doc = f"A = L^T D L of {size} rows; L below 1 / D on the diagonal, and the pivots D."
    outputs = (*rows, ("pivots", size))
    return Step(f"factor_{size}", doc, rows, outputs, tuple(tape.nodes), results)


@cache
def _solve_step(size: int, triangles: int) -> Step:
    """Return the step that solves with one factored triangle, or with a pair of them."""
    tape, entries = Tape(), size * (size + 1) // 2
    lower = _recorded_triangle(tape, 0, size)
    if triangles == 1:
        name, product, upper = "solve", "L^T D L", lower
    else:
        name, product = "solve_pair", "U D L"
        upper = _recorded_triangle(tape, entries, size)
    x = pair_solve(tape, lower, upper, [tape.input(triangles * entries + k) for k in range(size)])

    inputs = (*_row_names(size, triangles), ("x", size))
    doc = f"Solve {product} x = x of {size} rows."
    step = Step(f"{name}_{size}", doc, inputs, (("x", size),), tuple(tape.nodes), tuple(x))
    return compacted(step)  # one of the pair's diagonals is not read
