"""Lanes and strides of arrays: how they are read and written, and printed in C."""

from fractions import Fraction

from serpentail_codegen.ir.builder import Builder
from serpentail_codegen.ir.interpret import Run
from serpentail_codegen.targets.c.loops import in_loops
from serpentail_codegen.targets.c.routine import routine_lines
from tests.support.algebras import RATIONAL
from tests.support.program_runs import SWAP


def test_a_lane_of_several_rows_is_read_and_written():
    b = Builder("down", "Columns of lanes.")
    x, u, rows = (
        b.array("x", 2, 3, role="input"),
        b.array("u", 2, 3, role="output"),
        b.wide("rows", 4, 3),
    )
    b.fill(rows.part(0, 4), 7)
    with b.loop("i", 3) as i:
        b.copy(rows.down(2, i, 2), x[i])
        b.apply(SWAP, {"x": rows.down(2, i, 2)}, x=rows.down(2, i, 2))
        b.copy(u[i], rows.down(1, i, 2))
    values = Run(b.finish(), RATIONAL, {"x": [Fraction(k) for k in range(6)]}).values
    assert values["u"] == [7, 1, 7, 3, 7, 5]
    assert [list(row) for row in values["rows"][2:]] == [[1, 3, 5], [0, 2, 4]]
    assert "rat_swap_x_apart_8(rows + i + 16, x_new);" in "".join(
        in_loops(b.finish(), "double", "rat").lines
    )


def test_c_steps_read_scalars_that_lie_apart():
    b = Builder("apart", "A stride.")
    x, u = b.array("x", 4, role="input"), b.array("u", 2, role="output")
    b.apply(SWAP, {"x": x.part(0, 2, 2)}, x=u[0])
    (routine,) = in_loops(b.finish(), "double", "rat").routines
    assert routine_lines(routine, "double", "rat")[-2:] == ["x_out[0] = r0;", "x_out[1] = r1;"]
    assert "const real r0 = x[2];" in routine_lines(routine, "double", "rat")


def test_c_steps_read_rows_that_lie_apart():
    b = Builder("apart", "A stride.")
    x, u = b.wide("x", 4, 3), b.wide("u", 2, 3)
    b.apply(SWAP, {"x": x.part(0, 2, 2)}, x=u[0])
    (routine,) = in_loops(b.finish(), "double", "rat").routines
    text = "\n".join(routine_lines(routine, "double", "rat"))
    assert "LOAD(&x[0] + c)" in text
    assert "LOAD(&x[16] + c)" in text


def test_c_clears_rows_that_lie_apart_alone():
    b = Builder("apart", "A stride.")
    x = b.wide("x", 4, 3)
    b.fill(x.part(0, 2, 2), 0)
    lines = in_loops(b.finish(), "double", "rat").lines
    assert [line for line in lines if "fill" in line or "clear" in line] == [
        "rat_fill_rows(8, 0.0, x);",
        "rat_fill_rows(8, 0.0, x + 16);",
    ]
