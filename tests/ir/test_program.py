"""Programs: what loops over steps mean, and what a builder refuses."""

import random
from fractions import Fraction

import numpy as np
import pytest

from serpentail_codegen.ir.builder import Builder, narrowed
from serpentail_codegen.ir.interpret import Run, unroll
from serpentail_codegen.ir.program import Apply, Array, Fill, Index, Loop, as_index, statements
from tests.support.algebras import RATIONAL
from tests.support.program_runs import SWAP, outputs
from tests.support.programs import step_of


def random_index(rng):
    """An affine index of up to three loop variables: its coefficients, its offset, and the
    index.
    """
    factors = {name: rng.randint(-4, 4) for name in rng.sample("ijl", rng.randint(0, 3))}
    offset = rng.randint(-9, 9)
    index = sum(
        (factor * Index(((name, 1),)) for name, factor in factors.items()), as_index(offset)
    )
    return factors, offset, index


@pytest.mark.parametrize("seed", range(20))
def test_indices_are_affine(seed):
    rng = random.Random(seed)
    values = {name: rng.randint(0, 9) for name in "ijl"}
    (factors, offset, a), (*_, b) = random_index(rng), random_index(rng)
    assert a.at(values) == offset + sum(factor * values[name] for name, factor in factors.items())
    assert (a + b).at(values) == (b + a).at(values) == a.at(values) + b.at(values)
    assert (3 + a).at(values) == (a + 3).at(values) == a.at(values) + 3
    assert (-2 * a).at(values) == (a * -2).at(values) == -2 * a.at(values)
    assert a + -1 * a == Index()


def test_indices_that_cancel_are_equal():
    i = Index((("i", 1),))
    assert i + -1 * i == Index()
    assert as_index(4) == Index((), 4)
    assert as_index(i) is i


SUM = step_of("plus", (("x", 1), ("y", 1)), (("z", 1),), lambda t, x, y: [t.add(x, y)])
SPLIT = step_of(
    "split",
    (("x", 2), ("y", 1)),
    (("u", 1), ("v", 2)),
    lambda t, a, b, c: [c, t.add(a, b), t.mul(a, b)],
)


@pytest.mark.parametrize(
    ("downward", "expected"), [(False, [1, 11, 111, 1111]), (True, [1111, 1110, 1100, 1000])]
)
def test_loops_run_in_their_direction(downward, expected):
    b = Builder("sums", "Running sums.")
    x, y, total = b.array("x", 1, 4, "input"), b.array("y", 1, 4, "output"), b.array("total", 1)
    b.fill(total[0], 0)
    with b.loop("i", 4, downward) as i:
        b.apply(SUM, {"x": total[0], "y": x[i]}, z=total[0])
        b.copy(y[i], total[0])
    assert outputs(b, x=[1, 10, 100, 1000]) == expected


def test_loop_bounds_are_affine_in_outer_loops():
    b = Builder("triangle", "Marks below the diagonal.")
    y = b.array("y", 1, 16, "output")
    b.fill(y.part(0, 16), 0)
    with b.loop("i", 4, start=1) as i, b.loop("j", i) as j:
        b.fill(y[4 * i + j], 1)
    assert outputs(b) == np.tril(np.ones((4, 4)), -1).ravel().tolist()


def test_empty_loops_are_left_out():
    b = Builder("nothing", "Nothing.")
    y = b.array("y", 1, 1, "output")
    with b.loop("i", 0) as i:
        b.fill(y[i], 1)
    with b.loop("i", 1, start=1) as i:
        b.fill(y[i], 1)
    with b.loop("i", 3):
        pass
    assert b.finish().body == ()


def test_strided_references_read_and_write_columns():
    b = Builder("transpose", "A 2 x 3 matrix, transposed.")
    x, y = b.array("x", 6, role="input"), b.array("y", 6, role="output")
    with b.loop("i", 3) as i:
        b.copy(y.part(2 * i, 2), x.part(i, 2, stride=3))
    assert outputs(b, x=[1, 2, 3, 4, 5, 6]) == [1, 4, 2, 5, 3, 6]
    b = Builder("transpose", "A 3 x 2 matrix, transposed.")
    x, y = b.array("x", 6, role="input"), b.array("y", 6, role="output")
    with b.loop("i", 3) as i:
        b.apply(SWAP, {"x": x.part(2 * i, 2)}, x=y.part(i, 2, stride=3))
    assert outputs(b, x=[1, 2, 3, 4, 5, 6]) == [2, 4, 6, 1, 3, 5]


def test_arrays_count_vectors():
    array = Array("x", "local", 3, 4)
    assert array.length == 12
    i = Index((("i", 1),))
    assert (array[i].offset.at({"i": 2}), array[i].size, array[i].stride) == (6, 3, 1)
    assert (array.part(i + 1, 2).offset.at({"i": 2}), array.part(0, 2, 4).stride) == (3, 4)


def test_trailing_underscore_adds():
    b = Builder("sums", "Sum and sum of squares.")
    x, u, v = (
        b.array("x", 1, 3, "input"),
        b.array("u", 1, role="output"),
        b.array("v", 2, role="output"),
    )
    b.fill(u[0], 100)
    b.fill(v[0], 1, 2)
    with b.loop("i", 3) as i:
        b.apply(SPLIT, {"x": x.part(0, 2), "y": x[i]}, u_=u[0], v_=v[0])
    assert outputs(b, x=[2, 3, 5]) == {"u": [110], "v": [16, 20]}


def test_steps_read_everything_before_they_write():
    b = Builder("swap", "In place.")
    x, y = b.array("x", 2, role="input"), b.array("y", 2, role="output")
    b.copy(y[0], x[0])
    b.apply(SWAP, {"x": y[0]}, x=y[0])
    assert outputs(b, x=[1, 2]) == [2, 1]


def test_constants_and_fills():
    b = Builder("numbers", "Constants.")
    y, c = b.array("y", 3, 2, "output"), b.constant("c", [1, Fraction(1, 3), 0.25])
    b.copy(y[0], c[0])
    b.fill(y[1], 7)
    assert outputs(b) == [1, Fraction(1, 3), Fraction(1, 4), 7, 7, 7]


def test_unwanted_outputs_go_with_all_that_only_they_need():
    b = Builder("part", "One output of a step.")
    x, u = b.array("x", 1, role="input"), b.array("u", 1, role="output")
    b.apply(SPLIT, {"y": x[0]}, u=u[0])
    assert outputs(b, x=[4]) == [4]
    (call,) = b.finish().body
    assert isinstance(call, Apply)
    assert (call.step.name, call.step.inputs, call.step.outputs) == (
        "split_u",
        (("y", 1),),
        (("u", 1),),
    )
    assert len(call.step.nodes) == 1


def test_narrowing_keeps_the_order_and_the_name_of_what_stays_whole():
    assert narrowed(SPLIT, {"v", "u"}).name == "split"
    assert narrowed(SPLIT, {"v", "u"}).outputs == SPLIT.outputs
    assert narrowed(SPLIT, {"v"}) is narrowed(SPLIT, {"v"})
    with pytest.raises(ValueError, match=r"split has no output \['w'\]"):
        narrowed(SPLIT, {"u", "w"})


def test_sizes_and_names_are_checked_where_they_are_used():
    b = Builder("wrong", "Wrong.")
    x, y = b.array("x", 3, role="input"), b.array("y", 2, role="output")
    with pytest.raises(ValueError, match="split_v in wrong: x has 2 scalars, not 3"):
        b.apply(SPLIT, {"x": x[0], "y": x.part(0, 1)}, v=y[0])
    with pytest.raises(ValueError, match="split_u in wrong: u has 1 scalars, not 2"):
        b.apply(SPLIT, {"y": x.part(0, 1)}, u=y[0])
    with pytest.raises(ValueError, match="no output"):
        b.apply(SPLIT, {"x": x[0]}, w=y[0])
    with pytest.raises(KeyError, match="y"):
        b.apply(SPLIT, {"x": y[0]}, u=y.part(0, 1))
    with pytest.raises(ValueError, match="3 scalars of x do not fit y"):
        b.copy(y[0], x[0])
    with pytest.raises(ValueError, match="array x is declared twice in wrong"):
        b.array("x", 3)
    assert b.finish().body == ()


def test_statements_come_with_the_loops_around_them():
    b = Builder("nest", "Nested loops.")
    y = b.array("y", 1, 9, "output")
    b.fill(y[0], 0)
    with b.loop("i", 3) as i, b.loop("j", 3) as j:
        b.fill(y[3 * i + j], 1)
    found = list(statements(b.finish().body))
    assert [[loop.var for loop in loops] for _, loops in found] == [[], ["i", "j"]]
    assert all(isinstance(statement, Fill) for statement, _ in found)
    assert all(isinstance(loop, Loop) for _, loops in found for loop in loops)


def test_guards_note_what_must_be_positive_in_order():
    b = Builder("guarded", "Guards in a loop.")
    x, y = b.array("x", 1, 3, "input"), b.array("y", 1, role="output")
    b.fill(y[0], 0)
    with b.loop("i", 3) as i:
        b.guard(x[i], "TOO_SMALL", y[0])
    assert outputs(b, x=[1, -2, 3]) == [0]
    p = b.finish()
    assert Run(p, RATIONAL, {"x": [1, -2, 3]}).guards == [
        ("TOO_SMALL", 1),
        ("TOO_SMALL", -2),
        ("TOO_SMALL", 3),
    ]
    assert unroll(p)[2] == [("TOO_SMALL", node) for node in range(3)]
