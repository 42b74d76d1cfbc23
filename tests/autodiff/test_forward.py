"""Tangents of programs: exact in rational arithmetic, where dual numbers run the same loops."""

from itertools import combinations, product

import numpy as np

from serpentail_codegen.autodiff.forward import Lanes, tangent_program, tangents_together
from serpentail_codegen.ir.interpret import Run
from serpentail_codegen.ir.program import Index, statements
from tests.support.programs import EXACT, NEXT, PROGRAMS, SQUARE, Narrow, built, jacobian, numbers
from tests.support.rows import row


def arguments_of(program):
    """Names of the arrays that a program can be differentiated with respect to."""
    return [a.name for a in (*program.of_role("parameters"), *program.of_role("input"))]


def outputs_of(program):
    return [a.name for a in program.of_role("output")]


def subsets(names):
    """All sets of names but the empty one."""
    return [c for size in range(1, len(names) + 1) for c in combinations(names, size)]


def ran(program, given, kind=Run):
    """Values of all arrays after a run on those inputs that the program has."""
    return kind(program, EXACT, {n: given[n] for n in arguments_of(program) if n in given}).values


def dot(a, b):
    return sum(x * y for x, y in zip(a, b, strict=True))


def prefixed(letter, arrays):
    return {f"{letter}_{name}": values for name, values in arrays.items()}


def unit_rows(arguments, active):
    """``d_<input>`` of the active inputs, a lane for each of their scalars."""
    units = np.eye(sum(len(arguments[n]) for n in active), dtype=int).astype(object)
    rows = iter(units * EXACT.const(1))
    return {f"d_{name}": [next(rows) for _ in arguments[name]] for name in active}


def by_lanes(rows, lanes):
    """Rows as lists; one number stands for all lanes."""
    return [np.broadcast_to(np.asarray(x, dtype=object), lanes).tolist() for x in rows]


def test_tangents_and_lanes_are_those_of_dual_numbers():
    """Along one direction, and along many side by side, beside all values of the program."""
    for name, program in PROGRAMS.items():
        for active in subsets(arguments_of(program)):
            with row(name, *active):
                assert_tangents(program, active)


def assert_tangents(program, active):
    arguments, other = numbers(program), numbers(program, seed=2)
    values = ran(program, arguments)
    expected = jacobian(program, arguments, active)
    direction = [x for n in active for x in other[n]]
    tangents, count = tangent_program(program, active), len(direction)
    found = ran(tangents, arguments | prefixed("d", other))
    wide = tangent_program(program, active, count)
    rows = ran(wide, arguments | unit_rows(arguments, active))
    for name in outputs_of(program):
        if f"d_{name}" in outputs_of(tangents):
            along = [dot(entries, direction) for entries in expected[name]]
            assert found[f"d_{name}"] == along
            assert by_lanes(rows[f"d_{name}"], count) == expected[name]
        else:
            assert not any(x for entries in expected[name] for x in entries)
    assert {a.lanes for a in wide.arrays if a.name.startswith("d_")} == {count}
    still = [a.name for a in wide.arrays if not a.lanes]
    assert {name: rows[name] for name in still} == {name: values[name] for name in still}


def of_x(loops):
    """Iteration i of an upward loop depends on the first i + 1 entries of x alone."""
    outward = [loop for loop in loops if loop.var == "i" and not loop.downward]
    return Index((("i", 1),), 1) if outward else None


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


def test_lanes_left_out_are_zero():
    """In iteration i nothing depends on what comes later: leaving those lanes out changes nothing.

    The outputs u are written within the loop: their lanes that are left out mean nothing.
    """
    bounded = ("carry_up", "accumulators", "triangle", "temporaries")
    tried = {name: PROGRAMS[name] for name in bounded}
    tried |= {"chain_up": chain_up(), "later": read_in_later_iterations()}
    for name, program in tried.items():
        given = numbers(program)
        expected = jacobian(program, given, ("x",))
        given |= unit_rows(given, ("x",))
        wide = tangent_program(program, ("x",), 3)
        few = tangent_program(program, ("x",), 3, bound=of_x)
        for found in (ran(wide, given), ran(few, given), ran(few, given, Narrow)):
            with row(name):
                assert by_lanes(found["d_w"], 3) == expected["w"]
                if name not in ("later", "temporaries"):
                    lower = zip(by_lanes(found["d_u"], 3), expected["u"], strict=True)
                    for k, (lanes, slopes) in enumerate(lower):
                        assert lanes[: k + 1] == slopes[: k + 1] and not any(slopes[k + 1 :])
        assert any(getattr(s, "columns", None) for s, _ in statements(few.body)), name


def test_what_does_not_move_has_no_tangents():
    arrays = tangent_program(PROGRAMS["guarded"], ("mass",)).arrays
    names = {a.name for a in arrays}
    assert {"d_mass", "d_t", "d_u"} <= names
    assert not {"d_x", "d_y", "d_w", "dead", "d_dead", "w"} & names
    assert [a.role for a in arrays if a.name == "d_mass"] == ["input"]


def test_kinds_of_lanes_share_a_sweep():
    """Beside all values, each kind has the tangents that it has alone, or those that are wanted."""
    for name, program in PROGRAMS.items():
        arguments, names = numbers(program), arguments_of(program)
        for first, second in product(subsets(names), names):
            counts = [sum(len(arguments[n]) for n in active) for active in (first, (second,))]
            alone = Lanes((second,), counts[1], wanted=["w"])
            both = tangents_together(program, [Lanes(first, counts[0], prefix="e"), alone])
            rows = {f"e{n[1:]}": values for n, values in unit_rows(arguments, first).items()}
            found = ran(both, arguments | rows | unit_rows(arguments, (second,)))
            given, own = set(outputs_of(both)), outputs_of(tangent_program(program, first, 1))
            with row(name, *first, second):
                assert {n for n in given if n[:2] == "e_"} == {f"e{n[1:]}" for n in own}
                for prefix, active, count in (("e", first, counts[0]), ("d", (second,), counts[1])):
                    expected = jacobian(program, arguments, active)
                    for n in [n for n in given if n[:2] == f"{prefix}_"]:
                        assert by_lanes(found[n], count) == expected[n[2:]]
                assert not {n for n in given if n[:2] == "d_"} - {"d_w"}
