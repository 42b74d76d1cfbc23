"""Every type of statement: run by the interpreter, differentiated or refused by its name; what
conditions run, and what they become where a tape cannot tell.
"""

import random
from dataclasses import dataclass, is_dataclass
from fractions import Fraction

import numpy as np
import pytest

from serpentail_codegen.autodiff.forward import tangent_program
from serpentail_codegen.autodiff.reverse import adjoint_program
from serpentail_codegen.functions.derivatives.differentiated import FUNCTIONS
from serpentail_codegen.functions.function import assemble
from serpentail_codegen.functions.tail import Tail
from serpentail_codegen.ir import program as ir
from serpentail_codegen.ir.builder import Builder
from serpentail_codegen.ir.cost import branches
from serpentail_codegen.ir.dataflow import reads, writes
from serpentail_codegen.ir.interpret import Numbers, Run, unroll
from serpentail_codegen.passes.batch import batched
from serpentail_codegen.targets.c.loops import in_loops
from serpentail_codegen.targets.target import UnprintableStatement
from tests.support.program_runs import RATIONAL, interpreted, unrolled
from tests.support.programs import CROSS, EXACT, step_of
from tests.support.rows import row

ROW = 8  # numbers that store a row of a small matrix
DIFFERENTIATED = {ir.Apply, ir.Copy, ir.Fill, ir.Guard, ir.Loop}
REVERSED = {ir.Factor, ir.Solve}  # also, but not carried along
TREES = {ir.Loop, ir.When, ir.Call}  # asked of what is in them
MATRICES = {ir.Factor, ir.Solve}


@dataclass(frozen=True)
class Sort:
    """A statement that nobody knows."""

    target: ir.Ref


def record_loop(b, x, A, wide):
    with b.loop("i", 2) as i:
        b.copy(x.part(i, 1), A.part(i * ROW, 1))


def record_condition(b, x, A, wide):
    with b.when(x.part(1, 1)):
        b.fill(x[0], 9)


def record_call(b, x, A, wide):
    inner = Builder("inner", "Doubles.")
    one, two = inner.array("x", 2, role="input"), inner.array("y", 2, role="output")
    for adds in (False, True):
        inner.copy(two[0], one[0], adds=adds)
    b.call(inner.finish(), x=x, y=x)


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
    ir.Guard: (lambda b, x, A, wide: b.guard(x[0], "TOO_SMALL", x[0]), [2, 3]),
    ir.Call: (record_call, [4, 6]),
}
PAIRS = {
    ir.Factor: (lambda b, x, A, wide: b.factor(A, 2, True), [EXACT.const(1) / 3, 1]),
    ir.Solve: (lambda b, x, A, wide: b.solve(A, x[0], True), [-20, 23]),
}
CASES = [(kind, table) for table in (EXAMPLES, PAIRS) for kind in table]
UNKNOWN = lambda b, x, A, wide: b.emit(Sort(x[0]))  # noqa: E731 - as those above


def example(kind, table):
    """A program with a statement of a type; A = [[5, 1], [1, 1]], and [[5, 2], [1, 1]] in pairs."""
    b = Builder("example", "One statement.")
    a, x = b.array("a", 2, role="input"), b.array("x", 2, role="output")
    A, wide = b.array("A", 4 * ROW), b.wide("wide", 1, 3)
    if kind in MATRICES | {ir.Loop}:
        for first in (0, 2 * ROW):
            b.fill(A.part(first, 1), 5)
            b.fill(A.part(first + ROW, 2), 1 + bool(first), 1)
    b.copy(x[0], a[0])
    table.get(kind, (UNKNOWN,))[0](b, x, A, wide)
    if kind is ir.Unit:
        b.copy(x[0], wide.lane(0, 0, 2))
    if kind is ir.Factor:
        b.copy(x[0], A.part(0, 2, ROW))
    return b.finish()


def test_the_list_of_statements_is_complete():
    classes = {c for c in vars(ir).values() if isinstance(c, type) and is_dataclass(c)}
    no_statements = {ir.Step, ir.Index, ir.Array, ir.Ref, ir.Program}
    assert classes - no_statements == set(ir.STATEMENTS) == set(EXAMPLES)


def test_the_interpreter_runs_each():
    given = {"a": [EXACT.const(2), EXACT.const(3)]}
    for kind, table in CASES:
        with row(kind):
            assert Run(example(kind, table), EXACT, given).values["x"] == table[kind][1]
    with pytest.raises(TypeError, match=r"^no rule runs Sort$"):
        Run(example(Sort, {}), EXACT, given)


def test_what_each_reads_and_writes_is_known_or_it_is_refused():
    for kind, table in CASES:
        (statement,) = [s for s in example(kind, table).body if type(s) is kind][-1:]
        with row(kind):
            if kind in TREES:
                for question in (reads, writes):
                    with pytest.raises(TypeError, match=f"^no rule .* {kind.__name__} "):
                        question(statement)
            else:
                assert all(isinstance(ref, ir.Ref) for ref in reads(statement) + writes(statement))
                assert writes(statement) or kind is ir.Guard
            if kind in MATRICES:
                own = {"A"} | ({"x"} if kind is ir.Solve else set())
                assert {ref.array.name for ref in reads(statement)} == own


def test_each_is_differentiated_or_refused_by_its_name():
    for kind, table in (*CASES, (Sort, {})):
        program = example(kind, table)
        for derive, more in ((tangent_program, ()), (adjoint_program, (("x",),))):
            with row(kind):
                if kind in DIFFERENTIATED or (kind in REVERSED and derive is adjoint_program):
                    assert derive(program, ("a",), *more).body
                else:
                    with pytest.raises((TypeError, ValueError), match=f"{kind.__name__}|is overwr"):
                        derive(program, ("a",), *more)


def test_a_factorisation_whose_matrix_matters_has_no_reverse():
    b = Builder("factors", "One matrix.")
    a, x, A = b.array("a", 2, role="input"), b.array("x", 2, role="output"), b.array("A", 4 * ROW)
    b.copy(A.part(0, 2), a[0])
    b.factor(A, 2)
    b.copy(x[0], A.part(0, 2))
    with pytest.raises(ValueError, match=r"^Factor: A has no adjoints"):
        adjoint_program(b.finish(), ("a",), ("x",))


# Conditions

COUNT = step_of(
    "count", (("x", 1), ("y", 1)), (("z", 1),), lambda t, x, y: [t.add(t.mul(x, y), t.const(1))]
)


def conditional():
    """Conditions in a loop and in each other: what is written under one is read, summed up and
    overwritten after it; a number that is the same in all lanes is set under one.
    """
    b = Builder("choosy", "Conditions.")
    x, y, u = b.array("x", 1, 4, "input"), b.array("y", 1, 4, "input"), b.array("u", 1, 4, "output")
    w, t = b.array("w", 1, role="output"), b.array("t", 1)
    count, one = b.array("count", 1), b.constant("one", [1])
    b.fill(w[0], 1)
    b.fill(count[0], 0)
    with b.loop("i", 4) as i:
        b.fill(u[i], 7)
        with b.when(x[i]):
            b.apply(COUNT, {"x": x[i], "y": y[i]}, z=t[0])
            b.apply(COUNT, {"x": t[0], "y": w[0]}, z_=w[0])
            b.copy(count[0], one[0])
            with b.when(y[i]):
                b.copy(u[i], t[0])
                b.copy(w[0], y[i], adds=True)
        with b.when(w[0]), b.loop("j", i + 1) as j:
            b.copy(u[j], x[i], adds=True)
    b.copy(w[0], count[0], adds=True)
    return b.finish()


def plainly(x, y):
    """The same in Python."""
    u, w = [], 1
    for i, (a, b) in enumerate(zip(x, y, strict=True)):
        u.append(7)
        if a > 0:
            t = a * b + 1
            w += t * w + 1
            if b > 0:
                u[i], w = t, w + b
        if w > 0:
            u = [value + a for value in u]
    return u, w + any(a > 0 for a in x)


def test_conditions_run_what_they_ask_for_and_unroll_to_choices():
    p = conditional()
    for seed in range(20):
        rng = random.Random(seed)
        x, y = ([Fraction(rng.randint(-3, 3), rng.randint(1, 2)) for _ in "1234"] for _ in "xy")
        given = {"x": x, "y": y}
        found = interpreted(p, given)
        with row(seed):
            assert (found["u"], found["w"][0]) == plainly(**given)
            assert unrolled(p, given) == unrolled(p, given, fixed="xy") == found


def test_each_lane_runs_what_its_own_conditions_ask_for():
    rng, lanes = np.random.default_rng(0), 40
    many = {name: list(rng.integers(-3, 4, (4, lanes)).astype(float)) for name in "xy"}
    p = batched(conditional(), lanes)
    assert {a.lanes for a in p.arrays if a.name in ("w", "count")} == {lanes}
    values = Run(p, Numbers(np), many).values
    for k in range(lanes):
        u, w = plainly(*([float(values[k]) for values in many[name]] for name in "xy"))
        found = [np.broadcast_to(scalar, lanes)[k] for scalar in (*values["u"], values["w"][0])]
        with row(k):
            assert found == [*u, w]


def test_what_cannot_be_done_in_some_lanes_alone_is_refused():
    records = {
        "Fill": lambda b, u: b.fill(u[0], 1),
        "Guard": lambda b, u: b.guard(u[0], "OUT_OF_RANGE", u[0]),
    }
    for kind, record in records.items():
        b = Builder("partly", "A statement under a condition.")
        x, u = b.array("x", 1, role="input"), b.array("u", 1, role="output")
        b.copy(u[0], x[0])
        with b.when(x[0]):
            record(b, u)
        with row(kind), pytest.raises(UnprintableStatement, match=f"cannot print {kind}"):
            in_loops(batched(b.finish(), 8), "double", "rat")
    with pytest.raises(ValueError, match="a guard under a condition"):
        unroll(b.finish())


def test_a_condition_survives_being_called():
    b, p = Builder("outer", "Calls."), conditional()
    given = {a.name: b.array(a.name, 1, a.count, a.role) for a in p.arrays if "put" in a.role}
    b.call(p, **given)
    p, given = b.finish(), {"x": [1, -1, 2, 0], "y": [1, 2, -3, 4]}
    assert branches(p) and not branches(assemble(FUNCTIONS["mass_matrix"], Tail(1, 1)))
    values = Run(p, RATIONAL, given).values
    assert (values["u"], values["w"][0]) == plainly(**given)
