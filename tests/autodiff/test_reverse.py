"""Adjoints of programs: exact in rational arithmetic, where dual numbers run the same loops; what
shares places is right or refused.
"""

from types import SimpleNamespace

import pytest

from serpentail_codegen.autodiff.forward import tangent_program
from serpentail_codegen.autodiff.reverse import adjoint_program
from serpentail_codegen.ir.program import Loop
from tests.autodiff.test_forward import arguments_of, dot, outputs_of, prefixed, ran, subsets
from tests.support import programs
from tests.support.programs import NEXT, PROGRAMS, RECTANGULAR, SQUARE, TURN, built, numbers
from tests.support.rows import row


def gradients(program, wanted, given):
    """Random weights of outputs, their gradient by the program of adjoints, and by duals."""
    outputs = SimpleNamespace(of_role=lambda role: program.of_role("output") * (role == "input"))
    arguments, weights = numbers(program), numbers(outputs, seed=3)
    J = programs.jacobian(program, arguments, wanted)
    terms = [(w, entries) for g in given for w, entries in zip(weights[g], J[g], strict=True)]
    expected = [sum(w * entries[k] for w, entries in terms) for k in range(len(terms[0][1]))]
    back = adjoint_program(program, wanted, given)
    values = ran(back, arguments | prefixed("b", weights))
    assert {*outputs_of(back)} == {f"b_{name}" for name in wanted}
    return weights, [x for name in wanted for x in values[f"b_{name}"]], expected


def assert_reversed(program, wanted, given):
    _, found, expected = gradients(program, wanted, given)
    assert found == expected, (wanted, given)


def connected(program, wanted, given):
    """Tell if each wanted array changes a given output, and each of these depends on one."""
    J = {name: programs.jacobian(program, numbers(program), (name,)) for name in wanted}
    on = [[any(x for entries in J[w][g] for x in entries) for w in wanted] for g in given]
    return all(map(any, on)) and all(map(any, zip(*on, strict=True)))


@pytest.mark.parametrize("program", RECTANGULAR.values(), ids=RECTANGULAR)
def test_adjoints_are_the_transpose_of_dual_numbers_and_of_tangents(program):
    """b^T (J d) = (J^T b)^T d, both by programs; their tangents are a symmetric Hessian: that of a
    weighted sum of outputs.
    """
    every, given, other = arguments_of(program), outputs_of(program), numbers(program, seed=5)
    pairs = [(w, g) for w in subsets(every) for g in subsets(given) if connected(program, w, g)]
    assert len(pairs) >= 2
    for pair in pairs:
        assert_reversed(program, *pair)
    arguments, directions = numbers(program), prefixed("d", other)
    values = ran(tangent_program(program, every), arguments | directions)
    weights, back, _ = gradients(program, every, given)
    one = sum(dot(weights[n], values[f"d_{n}"]) for n in given)
    assert one == dot(back, [x for n in every for x in other[n]])

    wanted = [n for n in every if connected(program, [n], given)]
    back = adjoint_program(program, wanted, given)
    arguments |= prefixed("b", weights)
    read = arguments_of(back)
    reached = [n for n in wanted if n in read]
    by_duals = programs.jacobian(back, {n: arguments[n] for n in read}, reached)
    H = [entries for n in wanted for entries in by_duals[f"b_{n}"]]
    assert [list(column) for column in zip(*H, strict=True)] == H
    assert any(x for entries in H for x in entries)
    values = ran(tangent_program(back, wanted), arguments | directions)
    found = [x for n in wanted for x in values.get(f"d_b_{n}", [0] * len(arguments[n]))]
    assert found == [dot(entries, [x for n in wanted for x in other[n]]) for entries in H]


def started():
    """A builder whose outputs are zeros."""
    b, mass, x, y, u, w = built()
    b.fill(w[0], 0)
    b.fill(u.part(0, 3), 0)
    return b, mass, x, y, u, w


def test_only_what_is_overwritten_is_kept():
    b, _, x, y, _, w = started()
    s, t = b.array("s", 1), b.array("t", 1, 3)
    b.fill(s[0], 1)
    with b.loop("i", 3) as i:
        b.apply(NEXT, {"s": x[i], "x": x[i], "y": y[i]}, s=t[i])
        b.apply(NEXT, {"s": s[0], "x": t[i], "y": y[i]}, s=s[0])
    b.apply(SQUARE, {"x": s[0]}, s=w[0])
    back = adjoint_program(b.finish(), ("x",), ("w",))
    kept = {a.name: (a.size, a.count) for a in back.arrays if a.name.startswith("kept_")}
    assert kept == {"kept_0_s": (1, 3), "kept_1_s": (1, 1)}


def test_forward_part_is_left_out_where_it_is_not_needed():
    """The adjoint of a linear program reads no value: nothing runs forward."""
    b, _, x, _, _, w = started()
    with b.loop("i", 3) as i:
        b.copy(w[0], x[i], adds=True)
    back = adjoint_program(b.finish(), ("x",), ("w",))
    assert [s.downward for s in back.body if isinstance(s, Loop)] == [True]
    assert ran(back, {"x": [], "y": [], "mass": [], "b_w": [5]})["b_x"] == [5, 5, 5]
    back = adjoint_program(RECTANGULAR["guarded"], ("x", "y"), ("w",))  # y has no influence
    assert ran(back, {"b_w": [5]})["b_y"] == [0, 0, 0]


def test_values_are_kept_in_rectangles_alone():
    with pytest.raises(ValueError, match="loop j"):
        adjoint_program(PROGRAMS["triangle"], ("x",), ("u",))
    for start in (1, 2):
        b, mass, x, y, _, w = started()
        b.copy(w[0], mass[0])
        with b.loop("i", 3, start=start) as i:
            b.apply(NEXT, {"s": w[0], "x": x[i], "y": y[i]}, s=w[0])
        assert_reversed(b.finish(), ("x",), ("w",))
    b, _, x, y, u, _ = started()
    with b.loop("i", 3) as i, b.loop("j", i + 1) as j:  # keeps nothing
        b.apply(NEXT, {"s": x[i], "x": y[j], "y": x[j]}, s_=u[i])
    assert_reversed(b.finish(), ("x", "y"), ("u",))


# Places that several statements, iterations or inputs share: right or refused


def shared_by_iterations(b, x, y, w):
    """Iterations (i, j) of one statement write the same place where i + j is the same."""
    t = b.array("t", 1, 5)
    with b.loop("i", 3) as i, b.loop("j", 3) as j:
        b.apply(NEXT, {"s": x[i], "x": y[j], "y": x[i]}, s=t[i + j])
        b.apply(SQUARE, {"x": t[i + j]}, s_=w[0])


def shared_by_windows(b, x, y, w):
    """Windows that overlap: the second scalar of one iteration is the first of the next."""
    t = b.array("t", 1, 4)
    with b.loop("i", 3) as i:
        b.apply(TURN, {"x": x.part(0, 2), "y": y[i]}, s=t.part(i, 2))
        b.apply(SQUARE, {"x": t[i]}, s_=w[0])
        b.apply(SQUARE, {"x": t[i + 1]}, s_=w[0])


def shared_in_part(b, x, y, w):
    """A step overwrites a part of what it reads."""
    t = b.array("t", 1, 3)
    b.copy(t.part(0, 3), x.part(0, 3))
    b.apply(TURN, {"x": t.part(0, 2), "y": y[0]}, s=t.part(1, 2))
    b.apply(NEXT, {"s": t[0], "x": t[1], "y": t[2]}, s=w[0])


def shared_by_inputs(b, x, y, w):
    """A step reads one scalar under two names and overwrites it."""
    t = b.array("t", 1)
    b.copy(t[0], x[0])
    b.apply(NEXT, {"s": t[0], "x": t[0], "y": y[0]}, s=t[0])
    b.apply(NEXT, {"s": t[0], "x": y[1], "y": x[1]}, s=w[0])


def test_shared_places_are_right_or_refused():
    for record in (shared_by_iterations, shared_by_windows, shared_in_part, shared_by_inputs):
        b, _, x, y, _, w = started()
        record(b, x, y, w)
        with row(record.__name__):
            try:
                assert_reversed(b.finish(), ("x", "y"), ("w",))
            except ValueError:
                continue
