"""Programs: what indices, loops, strides and lanes mean, what a builder refuses, the solvers of
linear equations, and the straight lines of the models.
"""

import math
import random
from fractions import Fraction

import numpy as np
import pytest

from serpentail_codegen.functions.derivatives.differentiated import FUNCTIONS
from serpentail_codegen.functions.function import assemble
from serpentail_codegen.functions.tail import Tail
from serpentail_codegen.ir.builder import Builder, narrowed
from serpentail_codegen.ir.interpret import Run, unroll
from serpentail_codegen.ir.ldl import ldl_factor, pair_factor, pair_solve
from serpentail_codegen.ir.program import Apply, Array, Fill, Index, as_index, statements
from serpentail_codegen.ir.tape import live_nodes
from serpentail_codegen.targets.c.loops import in_loops
from tests.references.parameters import TABLE_1, random_states
from tests.support.program_runs import FLOATS, RATIONAL, interpreted, outputs, unrolled
from tests.support.programs import SUM, SWAP, step_of
from tests.support.rows import row

PARTS = lambda t, a, b, c: [c, t.add(a, b), t.mul(a, b)]  # noqa: E731
SPLIT = step_of("split", (("x", 2), ("y", 1)), (("u", 1), ("v", 2)), PARTS)


def arrays(b, x, u):
    """Inputs and outputs of so many scalars."""
    return b.array("x", x, role="input"), b.array("u", u, role="output")


def test_indices_are_affine_and_arrays_count_vectors():
    i, j = Index((("i", 1),)), Index((("j", 1),))
    a = 3 + 2 * i + j * -3 + (i + -1) + 4
    assert [a.at({"i": i, "j": j}) for i, j in ((0, 0), (1, 0), (0, 1), (5, 7))] == [6, 9, 3, 0]
    assert a + -1 * a == Index()
    assert as_index(4) == Index((), 4) and as_index(a) is a

    array = Array("x", "local", 3, 4)
    assert array.length == 12 and array.row == 1
    assert [Array("x", "local", 1, lanes=n).row for n in (1, 8, 9)] == [8, 8, 16]
    assert (array[i].offset.at({"i": 2}), array[i].size, array[i].stride) == (6, 3, 1)
    assert (array.part(i + 1, 2).offset.at({"i": 2}), array.part(0, 2, 4).stride) == (3, 4)


def test_loops_run_in_their_direction_between_affine_bounds_and_constants_are_exact():
    for downward, expected in ((False, [1, 11, 111, 1111]), (True, [1111, 1110, 1100, 1000])):
        b = Builder("sums", "Running sums.")
        x, y, total = b.array("x", 1, 4, "input"), b.array("y", 1, 4, "output"), b.array("total", 1)
        b.fill(total[0], 0)
        with b.loop("i", 4, downward) as i:
            b.apply(SUM, {"x": total[0], "y": x[i]}, s=total[0])
            b.copy(y[i], total[0])
        assert outputs(b, x=[1, 10, 100, 1000]) == expected
    b = Builder("numbers", "Constants.")
    y, c = b.array("y", 3, 2, "output"), b.constant("c", [1, Fraction(1, 3), 0.25])
    b.copy(y[0], c[0])
    b.fill(y[1], 7)
    assert outputs(b) == [1, Fraction(1, 3), Fraction(1, 4), 7, 7, 7]
    b = Builder("triangle", "Marks below the diagonal.")
    y = b.array("y", 1, 16, "output")
    b.fill(y.part(0, 16), 0)
    with b.loop("i", 4, start=1) as i, b.loop("j", i) as j:
        b.fill(y[4 * i + j], 1)
    assert outputs(b) == np.tril(np.ones((4, 4)), -1).ravel().tolist()


def test_empty_loops_are_left_out_and_statements_come_with_those_around_them():
    b = Builder("nest", "Nested loops.")
    y = b.array("y", 1, 9, "output")
    for start, count in ((0, 0), (1, 1)):
        with b.loop("i", count, start=start) as i:
            b.fill(y[i], 1)
    with b.loop("i", 3):
        pass
    assert b.finish().body == ()
    b.fill(y[0], 0)
    with b.loop("i", 3) as i, b.loop("j", 3) as j:
        b.fill(y[3 * i + j], 1)
    found = [(type(s), [x.var for x in around]) for s, around in statements(b.finish().body)]
    assert found == [(Fill, []), (Fill, ["i", "j"])]


def test_strided_references_read_and_write_columns():
    b = Builder("transpose", "Two matrices.")
    (x, y), z = arrays(b, 6, 6), b.array("z", 6, role="output")
    with b.loop("i", 3) as i:
        b.copy(y.part(2 * i, 2), x.part(i, 2, stride=3))
        b.apply(SWAP, {"x": x.part(2 * i, 2)}, x=z.part(i, 2, stride=3))
    found = outputs(b, x=[1, 2, 3, 4, 5, 6])
    assert found == {"u": [1, 4, 2, 5, 3, 6], "z": [2, 4, 6, 1, 3, 5]}


def test_steps_read_everything_before_they_write_and_may_add():
    b = Builder("swap", "In place.")
    x, y = arrays(b, 2, 2)
    b.copy(y[0], x[0])
    b.apply(SWAP, {"x": y[0]}, x=y[0])
    assert outputs(b, x=[1, 2]) == [2, 1]
    b = Builder("sums", "Sum and sum of squares.")
    x = b.array("x", 1, 3, "input")
    u, v = b.array("u", 1, role="output"), b.array("v", 2, role="output")
    b.fill(u[0], 100)
    b.fill(v[0], 1, 2)
    with b.loop("i", 3) as i:
        b.apply(SPLIT, {"x": x.part(0, 2), "y": x[i]}, u_=u[0], v_=v[0])
    assert outputs(b, x=[2, 3, 5]) == {"u": [110], "v": [16, 20]}


def test_unwanted_outputs_go_with_all_that_only_they_need():
    b = Builder("part", "One output of a step.")
    x, u = arrays(b, 1, 1)
    b.apply(SPLIT, {"y": x[0]}, u=u[0])
    assert outputs(b, x=[4]) == [4]
    (call,) = b.finish().body
    assert isinstance(call, Apply) and len(call.step.nodes) == 1
    found = (call.step.name, call.step.inputs, call.step.outputs)
    assert found == ("split_u", (("y", 1),), (("u", 1),))
    whole = narrowed(SPLIT, {"v", "u"})
    assert (whole.name, whole.outputs) == ("split", SPLIT.outputs)
    assert narrowed(SPLIT, {"v"}) is narrowed(SPLIT, {"v"})
    with pytest.raises(ValueError, match=r"split .*\['w'\]"):
        narrowed(SPLIT, {"u", "w"})


def test_sizes_and_names_are_checked_where_they_are_used():
    b = Builder("wrong", "Wrong.")
    x, y = arrays(b, 3, 2)
    rows = [
        (lambda: b.apply(SPLIT, {"x": x[0], "y": x.part(0, 1)}, v=y[0]), "wrong: x .*2 .*3"),
        (lambda: b.apply(SPLIT, {"y": x.part(0, 1)}, u=y[0]), "split_u in wrong: u .*1 .*2"),
        (lambda: b.apply(SPLIT, {"x": x[0]}, w=y[0]), "'w'"),
        (lambda: b.apply(SPLIT, {"x": y[0]}, u=y.part(0, 1)), "y"),
        (lambda: b.copy(y[0], x[0]), "3 scalars of x .* u"),
        (lambda: b.array("x", 3), "x .*twice in wrong"),
    ]
    for record, words in rows:
        with row(words), pytest.raises((ValueError, KeyError), match=words):
            record()
    assert b.finish().body == ()


def test_guards_note_what_must_be_positive_in_order():
    b = Builder("guarded", "Guards in a loop.")
    x, y = b.array("x", 1, 3, "input"), b.array("y", 1, role="output")
    b.fill(y[0], 0)
    with b.loop("i", 3) as i:
        b.guard(x[i], "TOO_SMALL", y[0])
    assert outputs(b, x=[1, -2, 3]) == [0]
    p = b.finish()
    noted = Run(p, RATIONAL, {"x": [1, -2, 3]}).guards
    assert noted == [("TOO_SMALL", x) for x in (1, -2, 3)]
    assert unroll(p)[2] == [("TOO_SMALL", node) for node in range(3)]


def test_a_lane_of_several_rows_is_read_and_written():
    b = Builder("down", "Columns of lanes.")
    x, u = b.array("x", 2, 3, role="input"), b.array("u", 2, 3, role="output")
    rows = b.wide("rows", 4, 3)
    b.fill(rows.part(0, 4), 7)
    with b.loop("i", 3) as i:
        b.copy(rows.down(2, i, 2), x[i])
        b.apply(SWAP, {"x": rows.down(2, i, 2)}, x=rows.down(2, i, 2))
        b.copy(u[i], rows.down(1, i, 2))
    p = b.finish()
    values = Run(p, RATIONAL, {"x": [Fraction(k) for k in range(6)]}).values
    assert values["u"] == [7, 1, 7, 3, 7, 5]
    assert [list(lanes) for lanes in values["rows"][2:]] == [[1, 3, 5], [0, 2, 4]]
    assert "apart_8(rows + i + 16, x_new);" in "".join(in_loops(p, "double", "rat").lines)


# Linear equations


def lower(rows):
    return [[Fraction(x) for x in values[: k + 1]] for k, values in enumerate(rows)]


def test_the_solvers_are_exact_in_rational_arithmetic():
    """Of a positive definite matrix of small integers, and of one that is not symmetric."""
    for size in range(1, 9):
        rng = random.Random(size)
        half = [[rng.randint(-3, 3) for _ in range(size)] for _ in range(size)]
        A = np.array(half) @ np.transpose(half) + np.eye(size, dtype=int)
        b = rng.choices(range(-9, 10), k=size)
        turn = [[rng.choice((-1, 1)) * (k != j) for j in range(size)] for k in range(size)]
        right = [Fraction(value) for value in b]
        triangle = lower(A.tolist())
        factors, pivots = ldl_factor(RATIONAL, triangle)
        assert triangle == lower(A.tolist())  # the arguments are left alone
        solved = [(A, pair_solve(RATIONAL, factors, factors, right), pivots)]
        B = A + np.array(turn)
        *pair, pivots = pair_factor(RATIONAL, lower(B.tolist()), lower(B.T.tolist()))
        solved += [(B, pair_solve(RATIONAL, *pair, right), pivots)]
        for matrix, x, found in solved:
            with row(size):
                assert [sum(a * y for a, y in zip(r, x, strict=True)) for r in matrix] == b
                minors = [round(np.linalg.det(matrix[k:, k:])) for k in reversed(range(size))]
                assert [math.prod(found[: k + 1]) for k in range(size)] == minors
    pivots = ldl_factor(RATIONAL, lower([[1], [2, 3]]))[1]
    assert pivots == [3, Fraction(-1, 3)]  # they show what is not positive definite


# Straight lines of the models, parameters baked in or not

TAILS = {"m1_n2": Tail(1, 2), "m2_n3": Tail(2, 3), "arcs2": Tail(2, 3, "continuum")}


def arguments_of(program, tail, convert):
    """Table 1 and a random state for the parameters and inputs of a program."""
    q, v, v_dot, tau = (rows[0] for rows in random_states(tail.segments, 3, 1, "random"))
    f_ext = np.random.default_rng(4).uniform(-1, 1, 6 + 3 * (tail.total + 1))
    known = {"q": q, "v": v, "v_dot": v_dot, "tau": tau, "f_ext": f_ext}
    known |= {"link_inertia": (4.9e-8, 2e-9, 5e-8)} | TABLE_1
    arrays = (*program.of_role("parameters"), *program.of_role("input"))
    return {a.name: [convert(x) for x in np.ravel(known[a.name]).tolist()] for a in arrays}


def rounded(x):
    """A coarse rational: exact arithmetic on it stays small."""
    coarse = Fraction(round(x * 64), 64)
    return coarse if abs(x) > 1 / 16 else Fraction(x).limit_denominator(1 << 30)


def live_line(program, fixed=None):
    """Unroll; return the tape and the live nodes, those that must be positive included."""
    tape, nodes, guards = unroll(program, fixed)
    wanted = [node for found in nodes.values() for node in found] + [node for _, node in guards]
    return tape, live_nodes(tape.nodes, wanted)


@pytest.mark.parametrize("tail", TAILS)
def test_unrolling_keeps_every_bit_and_baking_leaves_no_parameter(tail):
    """Signs of zeros aside: no two constants that round meet in these programs, so folding changes
    no rounding.
    """
    for name, function in FUNCTIONS.items():
        with row(name):
            p = assemble(function, TAILS[tail])
            arguments = arguments_of(p, TAILS[tail], float)
            expected = interpreted(p, arguments, FLOATS)
            assert unrolled(p, arguments, FLOATS) == expected
            assert all(math.isfinite(x) for values in expected.values() for x in values)

            parameters = p.of_role("parameters")
            tape, live = live_line(p, {a.name: arguments[a.name] for a in parameters})
            read = {tape.nodes[node][1] for node in live if tape.nodes[node][0] == "input"}
            assert min(read) >= sum(array.length for array in parameters)
            assert len(live) <= len(live_line(p)[1])
            if tail == "m1_n2":  # exactly
                arguments = arguments_of(p, TAILS[tail], rounded)
                fixed = [array.name for array in parameters]
                expected = interpreted(p, arguments)
                assert unrolled(p, arguments) == unrolled(p, arguments, fixed=fixed) == expected
