"""Tangents of programs: exact in rational arithmetic, where dual numbers run through the same
loops.
"""

from itertools import combinations

import numpy as np
import pytest

from serpentail_codegen.autodiff.forward import tangent_program
from serpentail_codegen.ir.builder import Builder
from serpentail_codegen.ir.interpret import Run
from serpentail_codegen.ir.program import Factor, Fill, Index, statements
from tests.support.programs import EXACT, NEXT, PROGRAMS, SQUARE, Narrow, built, jacobian, numbers
from tests.support.rows import row

every_program = pytest.mark.parametrize("name", PROGRAMS)


def arguments_of(program):
    """Names of the arrays that a program can be differentiated with respect to."""
    return [a.name for a in (*program.of_role("parameters"), *program.of_role("input"))]


def subsets(names):
    """All sets of names but the empty one."""
    return [c for size in range(1, len(names) + 1) for c in combinations(names, size)]


def unit_rows(arguments, active):
    """``d_<input>`` of the active inputs, a lane for each of their scalars."""
    units = np.eye(sum(len(arguments[n]) for n in active))
    rows = iter(np.array([[EXACT.const(int(x)) for x in unit] for unit in units]))
    return {f"d_{name}": [next(rows) for _ in arguments[name]] for name in active}


def run(program, arguments, kind=Run):
    """The outputs of a program on rationals."""
    values = kind(program, EXACT, {a: arguments[a] for a in arguments_of(program)}).values
    return {a.name: values[a.name] for a in program.of_role("output")}


def by_lanes(rows, lanes):
    """Rows as lists; one number stands for all lanes."""
    return [np.broadcast_to(np.asarray(x, dtype=object), lanes).tolist() for x in rows]


@every_program
def test_tangents_and_lanes_are_those_of_dual_numbers(name):
    """Along one direction, and along many side by side."""
    program = PROGRAMS[name]
    arguments = numbers(program)
    for active in subsets(arguments_of(program)):
        expected = jacobian(program, arguments, active)
        changes = {f"d_{n}": xs for n, xs in numbers(program, seed=2).items() if n in active}
        direction = [x for n in active for x in changes[f"d_{n}"]]
        found = run(tangent_program(program, active), arguments | changes)
        with row(*active):
            for output, slopes in found.items():
                along = [
                    sum(a * b for a, b in zip(entries, direction, strict=True))
                    for entries in expected[output.removeprefix("d_")]
                ]
                assert slopes == along
            still = {output for output in expected if f"d_{output}" not in found}
            assert not any(x for output in still for entries in expected[output] for x in entries)
            wide = tangent_program(program, active, len(direction))
            lanes = {a.lanes for a in wide.arrays if a.name.startswith("d_")}
            assert lanes == {len(direction)}
            for output, rows in run(wide, arguments | unit_rows(arguments, active)).items():
                assert by_lanes(rows, len(direction)) == expected[output.removeprefix("d_")]


@every_program
def test_values_go_along_unchanged(name):
    """A program whose outputs are kept local still computes them: a tangent program is the program
    and more.
    """
    program = PROGRAMS[name]
    arguments, wide = numbers(program), tangent_program(program, arguments_of(program), 2)
    ones = np.array([EXACT.const(1)] * 2)
    rows = {a.name: [ones] * a.length for a in wide.of_role("input") if a.lanes}
    values = Run(wide, EXACT, arguments | rows).values
    expected = Run(program, EXACT, arguments).values
    assert not [a.name for a in wide.arrays if not a.lanes and values[a.name] != expected[a.name]]


# ---- lanes that are left out ---------------------------------------------------------------------


def of_x(loops):
    """Iteration i of an upward loop depends on the first i + 1 entries of x alone."""
    outward = [loop for loop in loops if loop.var == "i" and not loop.downward]
    return Index((("i", 1),), 1) if outward else None


def too_few(loops):
    """One lane less."""
    return Index((("i", 1),)) if loops else None


def chain_up():
    """Each entry from the last, then one step after the loop that reads them all."""
    b, mass, x, y, u, w = built()
    a = b.array("a", 1, 4)
    b.copy(a[0], mass[0])
    with b.loop("i", 3) as i:
        b.apply(NEXT, {"s": a[i], "x": x[i], "y": y[i]}, s=a[i + 1])
        b.apply(SQUARE, {"x": a[i + 1]}, s=u[i])
    b.apply(NEXT, {"s": a[1], "x": a[2], "y": a[3]}, s=w[0])
    return b.finish()


def read_in_later_iterations():
    """An array written in one iteration and read in later ones, where more lanes are needed."""
    b, _, x, y, u, w = built()
    a = b.array("a", 1, 3)
    b.fill(w[0], 0)
    b.fill(u.part(0, 3), 0)
    with b.loop("i", 3) as i:
        b.apply(NEXT, {"s": x[i], "x": x[i], "y": y[i]}, s=a[i])
    with b.loop("i", 3) as i:
        b.apply(NEXT, {"s": a[0], "x": x[i], "y": y[i]}, s_=w[0])
    return b.finish()


BOUNDED = {name: PROGRAMS[name] for name in ("carry_up", "accumulators", "triangle", "temporaries")}
BOUNDED |= {"chain_up": chain_up(), "later": read_in_later_iterations()}


@pytest.mark.parametrize("name", BOUNDED)
def test_lanes_left_out_are_zero(name):
    """In iteration i nothing depends on what comes later: leaving those lanes out changes nothing.

    The outputs u are written within the loop: their lanes that are left out mean nothing.
    """
    program = BOUNDED[name]
    arguments = numbers(program)
    wide, bounded = (
        tangent_program(program, ("x",), 3),
        tangent_program(program, ("x",), 3, bound=of_x),
    )
    expected = jacobian(program, arguments, ("x",))
    arguments |= unit_rows(arguments, ("x",))
    for found in (run(wide, arguments), run(bounded, arguments), run(bounded, arguments, Narrow)):
        assert by_lanes(found["d_w"], 3) == expected["w"]
        if name not in ("later", "temporaries"):
            for k, (lanes, slopes) in enumerate(
                zip(by_lanes(found["d_u"], 3), expected["u"], strict=True)
            ):
                assert lanes[: k + 1] == slopes[: k + 1] and not any(slopes[k + 1 :])
    assert any(getattr(s, "columns", None) for s, _ in statements(bounded.body))


def test_lanes_too_few_are_noticed():
    """The check above sees what a bound that is too tight does."""
    program = PROGRAMS["carry_up"]
    arguments = numbers(program)
    tight = tangent_program(program, ("x",), 3, bound=too_few)
    found = run(tight, arguments | unit_rows(arguments, ("x",)), Narrow)["d_u"]
    assert by_lanes(found, 3) != jacobian(program, arguments, ("x",))["u"]


def test_fills_are_added_where_lanes_differ():
    """Rows that are written in few lanes and read in all begin as zeros."""
    bounded = tangent_program(chain_up(), ("x",), 3, bound=of_x)
    filled = {s.target.array.name for s in bounded.body if isinstance(s, Fill)}
    assert "d_a" in filled and "a" not in filled
    whole = [s for s in tangent_program(chain_up(), ("x",), 3).body[:-1] if isinstance(s, Fill)]
    assert "d_a" not in {s.target.array.name for s in whole if s.target.size > 1}


# ---- which statements there are ------------------------------------------------------------------


def test_what_does_not_move_has_no_tangents():
    arrays = tangent_program(PROGRAMS["guarded"], ("mass",)).arrays
    names = {a.name for a in arrays}
    assert {"d_mass", "d_t", "d_u"} <= names
    assert not {"d_x", "d_y", "d_w", "dead", "d_dead", "w"} & names
    assert [a.role for a in arrays if a.name == "d_mass"] == ["input"]


def test_what_is_stored_anew_forgets_its_tangents():
    b, _, x, y, u, _ = built()
    t = b.array("t", 1)
    b.copy(t[0], x[0])
    b.copy(u[0], t[0])
    for k, store in enumerate((lambda: b.fill(t[0], 3), lambda: b.copy(t[0], y[0])), start=1):
        b.copy(t[0], x[0], adds=True)
        store()
        b.copy(u[k], t[0])
    found = run(tangent_program(b.finish(), ("x",)), numbers(b.finish()) | {"d_x": [7, 0, 0]})
    assert found["d_u"] == [7, 0, 0]


@pytest.mark.parametrize("statement", ["Factor", "Solve"])
def test_solvers_are_refused(statement):
    b = Builder("solver", "A solver.")
    a, x = b.array("a", 4, role="input"), b.array("x", 2, role="output")
    A = b.array("A", 4)
    b.copy(A[0], a[0])
    b.fill(x[0], 1)
    b.emit(Factor(A, 2)) if statement == "Factor" else b.solve(A, x[0])
    with pytest.raises(TypeError, match=statement):
        tangent_program(b.finish(), ("a",))
