"""Adjoints of programs that share places, or that have none: right or refused."""

import pytest

from serpentail_codegen.autodiff.reverse import adjoint_program
from serpentail_codegen.ir.builder import Builder
from serpentail_codegen.ir.program import Factor
from tests.autodiff.test_reverse import gradients
from tests.support.programs import NEXT, PROGRAMS, SQUARE, TURN, built, numbers

# What is refused


def test_values_kept_in_a_triangle_are_refused():
    with pytest.raises(
        ValueError, match=r"^loop j is no rectangle: its iterations cannot be numbered$"
    ):
        adjoint_program(PROGRAMS["triangle"], ("x",), ("u",))


@pytest.mark.parametrize("start", [1, 2])
def test_values_kept_in_a_loop_from_elsewhere_are_reversed(start):
    b, mass, x, y, u, w = built()
    b.fill(u.part(0, 3), 0)
    b.copy(w[0], mass[0])
    with b.loop("i", 3, start=start) as i:
        b.apply(NEXT, {"s": w[0], "x": x[i], "y": y[i]}, s=w[0])
    program = b.finish()
    _, found, expected = gradients(program, numbers(program), ("x",), ("w",))
    assert found == expected


def test_triangles_without_kept_values_are_reversed():
    b, _, x, y, u, w = built()
    b.fill(u.part(0, 3), 0)
    b.fill(w[0], 0)
    with b.loop("i", 3) as i, b.loop("j", i + 1) as j:
        b.apply(NEXT, {"s": x[i], "x": y[j], "y": x[j]}, s_=u[i])
    program = b.finish()
    _, found, expected = gradients(program, numbers(program), ("x", "y"), ("u",))
    assert found == expected


@pytest.mark.parametrize("statement", ["factor", "solve", "unit"])
def test_statements_without_a_rule_are_refused(statement):
    b = Builder("solver", "A solver.")
    a, x = b.array("a", 4, role="input"), b.array("x", 2, role="output")
    A = b.array("A", 4)
    b.copy(A[0], a[0])
    b.copy(x[0], A.part(0, 2))
    if statement == "unit":
        b.unit(b.wide("rows", 2, 3)[0], 0)
    else:
        b.emit(Factor(A, 2)) if statement == "factor" else b.solve(A, x[0])
    with pytest.raises(TypeError, match=f"^no rule reverses {statement.capitalize()}$"):
        adjoint_program(b.finish(), ("a",), ("x",))


# Aliases: places that several statements, iterations or inputs share


def shared_by_iterations():
    """Iterations (i, j) of one statement write the same place where i + j is the same."""
    b, _, x, y, u, w = built()
    t = b.array("t", 1, 5)
    b.fill(w[0], 0)
    b.fill(u.part(0, 3), 0)
    with b.loop("i", 3) as i, b.loop("j", 3) as j:
        b.apply(NEXT, {"s": x[i], "x": y[j], "y": x[i]}, s=t[i + j])
        b.apply(SQUARE, {"x": t[i + j]}, s_=w[0])
    return b.finish()


def shared_by_windows():
    """Windows that overlap: the second scalar of one iteration is the first of the next."""
    b, _, x, y, u, w = built()
    t = b.array("t", 1, 4)
    b.fill(w[0], 0)
    b.fill(u.part(0, 3), 0)
    with b.loop("i", 3) as i:
        b.apply(TURN, {"x": x.part(0, 2), "y": y[i]}, s=t.part(i, 2))
        b.apply(SQUARE, {"x": t[i]}, s_=w[0])
        b.apply(SQUARE, {"x": t[i + 1]}, s_=w[0])
    return b.finish()


def shared_in_part():
    """A step overwrites a part of what it reads."""
    b, _, x, y, u, w = built()
    t = b.array("t", 1, 3)
    b.copy(t.part(0, 3), x.part(0, 3))
    b.fill(u.part(0, 3), 0)
    b.apply(TURN, {"x": t.part(0, 2), "y": y[0]}, s=t.part(1, 2))
    b.apply(NEXT, {"s": t[0], "x": t[1], "y": t[2]}, s=w[0])
    return b.finish()


def shared_by_inputs():
    """A step reads one scalar under two names and overwrites it."""
    b, _, x, y, u, w = built()
    t = b.array("t", 1)
    b.copy(t[0], x[0])
    b.fill(u.part(0, 3), 0)
    b.apply(NEXT, {"s": t[0], "x": t[0], "y": y[0]}, s=t[0])
    b.apply(NEXT, {"s": t[0], "x": y[1], "y": x[1]}, s=w[0])
    return b.finish()


@pytest.mark.parametrize(
    "build", [shared_by_iterations, shared_by_windows, shared_in_part, shared_by_inputs]
)
def test_shared_places_are_right_or_refused(build):
    program = build()
    try:
        _, found, expected = gradients(program, numbers(program), ("x", "y"), ("w",))
    except ValueError:
        return
    assert found == expected
