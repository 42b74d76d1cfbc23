"""Every type of statement: run by the interpreter, differentiated or refused by its name."""

from dataclasses import dataclass, is_dataclass

import pytest

from serpentail_codegen.autodiff.forward import tangent_program
from serpentail_codegen.autodiff.reverse import adjoint_program
from serpentail_codegen.ir import program as ir
from serpentail_codegen.ir.builder import Builder
from serpentail_codegen.ir.dataflow import reads, writes
from serpentail_codegen.ir.interpret import Run
from tests.support.programs import CROSS, EXACT
from tests.support.rows import row

ROW = 8  # numbers that store a row of a small matrix
DIFFERENTIATED = {ir.Apply, ir.Copy, ir.Fill, ir.Guard, ir.Loop}
TREES = {ir.Loop, ir.When, ir.Call}  # asked of what is in them
MATRICES = {ir.Factor, ir.Solve, ir.FactorPair, ir.SolvePair}


@dataclass(frozen=True)
class Sort:
    """A statement that nobody knows."""

    target: ir.Ref


def inner():
    """A program to call."""
    b = Builder("inner", "Doubles.")
    x, y = b.array("x", 2, role="input"), b.array("y", 2, role="output")
    b.copy(y[0], x[0])
    b.copy(y[0], x[0], adds=True)
    return b.finish()


def record_loop(b, x, A, wide):
    with b.loop("i", 2) as i:
        b.copy(x.part(i, 1), A.part(i * ROW, 1))


def record_condition(b, x, A, wide):
    with b.when(x.part(1, 1)):
        b.fill(x[0], 9)


# how each is recorded, between x = (2, 3), the matrix A and a wide array, and what x is then
EXAMPLES = {
    ir.Apply: (lambda b, x, A, wide: b.apply(CROSS, {"x": x[0]}, x=x[0]), [3, 6]),
    ir.Fill: (lambda b, x, A, wide: b.fill(x[0], 7), [7, 7]),
    ir.Unit: (lambda b, x, A, wide: b.unit(wide[0], 1), [0, 1]),
    ir.Copy: (lambda b, x, A, wide: b.copy(x[0], x[0], adds=True), [4, 6]),
    ir.Loop: (record_loop, [5, 1]),
    ir.When: (record_condition, [9, 9]),
    # 1 / D = 1 / (5 - 1), and L below it
    ir.Factor: (lambda b, x, A, wide: b.factor(A, 2), [EXACT.const(1) / 4, 1]),
    # L^T D L with L = 1 below 1 / D = (5, 1)
    ir.Solve: (lambda b, x, A, wide: b.solve(A, x[0]), [-5, 8]),
    ir.FactorPair: (lambda b, x, A, wide: b.factor_pair(A, 2), [EXACT.const(1) / 4, 1]),
    ir.SolvePair: (lambda b, x, A, wide: b.solve_pair(A, x[0]), [-5, 8]),
    ir.Guard: (lambda b, x, A, wide: b.guard(x[0], "TOO_SMALL", x[0]), [2, 3]),
    ir.Call: (lambda b, x, A, wide: b.call(inner(), x=x, y=x), [4, 6]),
}
UNKNOWN = lambda b, x, A, wide: b.emit(Sort(x[0]))  # noqa: E731 - as those above


def example(kind):
    """A program with a statement of a type; A = [[5, 1], [1, 1]], once more for its transpose."""
    b = Builder("example", "One statement.")
    a, x = b.array("a", 2, role="input"), b.array("x", 2, role="output")
    A, wide = b.array("A", 4 * ROW), b.wide("wide", 1, 3)
    if kind in MATRICES | {ir.Loop}:
        for first in (0, 2 * ROW):
            b.fill(A.part(first, 1), 5)
            b.fill(A.part(first + ROW, 2), 1)
    b.copy(x[0], a[0])
    EXAMPLES.get(kind, (UNKNOWN,))[0](b, x, A, wide)
    if kind is ir.Unit:
        b.copy(x[0], wide.lane(0, 0, 2))
    if kind in (ir.Factor, ir.FactorPair):
        b.copy(x[0], A.part(0, 2, ROW))
    return b.finish()


def test_the_list_of_statements_is_complete():
    classes = {c for c in vars(ir).values() if isinstance(c, type) and is_dataclass(c)}
    no_statements = {ir.Step, ir.Index, ir.Array, ir.Ref, ir.Program}
    assert classes - no_statements == set(ir.STATEMENTS) == set(EXAMPLES)


def test_the_interpreter_runs_each():
    given = {"a": [EXACT.const(2), EXACT.const(3)]}
    for kind, (_, expected) in EXAMPLES.items():
        with row(kind):
            assert Run(example(kind), EXACT, given).values["x"] == expected
    with pytest.raises(TypeError, match=r"^no rule runs Sort$"):
        Run(example(Sort), EXACT, given)


def test_what_each_reads_and_writes_is_known_or_it_is_refused():
    for kind in EXAMPLES:
        (statement,) = [s for s in example(kind).body if type(s) is kind][-1:]
        with row(kind):
            if kind in TREES:
                for question in (reads, writes):
                    with pytest.raises(TypeError, match=f"^no rule .* {kind.__name__} "):
                        question(statement)
            else:
                assert all(isinstance(ref, ir.Ref) for ref in reads(statement) + writes(statement))
                assert writes(statement) or kind is ir.Guard
            if kind in MATRICES:
                own = {"A"} | ({"x"} if kind in (ir.Solve, ir.SolvePair) else set())
                assert {ref.array.name for ref in reads(statement)} == own


def test_each_is_differentiated_or_refused_by_its_name():
    for kind in (*EXAMPLES, Sort):
        program = example(kind)
        for derive, more in ((tangent_program, ()), (adjoint_program, (("x",),))):
            with row(kind):
                if kind in DIFFERENTIATED:
                    assert derive(program, ("a",), *more).body
                else:
                    with pytest.raises(TypeError, match=f"^no rule .*{kind.__name__}"):
                        derive(program, ("a",), *more)
