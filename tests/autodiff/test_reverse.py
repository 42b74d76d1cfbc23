"""Adjoints of programs: exact in rational arithmetic, where dual numbers run the same loops; what
shares places is right or refused.
"""

from types import SimpleNamespace

import pytest

from serpentail_codegen.autodiff.forward import tangent_program
from serpentail_codegen.autodiff.reverse import adjoint_program, iterations
from serpentail_codegen.ir.builder import Builder
from serpentail_codegen.ir.interpret import Run
from serpentail_codegen.ir.program import Factor, Index, Loop, as_index
from tests.autodiff.test_forward import arguments_of, subsets
from tests.support.programs import (
    EXACT,
    NEXT,
    PROGRAMS,
    RECTANGULAR,
    SQUARE,
    TURN,
    built,
    jacobian,
    numbers,
)

every_program = pytest.mark.parametrize("name", RECTANGULAR)


def gradients(program, arguments, wanted, given, seed=3):
    """Weights of the given outputs, the adjoints that the program of adjoints gives, and what dual
    numbers say.
    """
    weights = {n: xs for n, xs in weights_of(program, seed).items() if n in given}
    J = jacobian(program, arguments, wanted)
    terms = [(w, row) for name in given for w, row in zip(weights[name], J[name], strict=True)]
    expected = [sum(w * row[k] for w, row in terms) for k in range(len(terms[0][1]))]
    back = adjoint_program(program, wanted, given)
    values = ran(back, arguments | {f"b_{name}": xs for name, xs in weights.items()})
    assert {a.name for a in back.of_role("output")} == {f"b_{name}" for name in wanted}
    return weights, [x for name in wanted for x in values[f"b_{name}"]], expected


def ran(program, inputs):
    """Values of all arrays after a run on those inputs that the program has."""
    return Run(program, EXACT, {n: inputs[n] for n in arguments_of(program)}).values


def weights_of(program, seed=3):
    """Random rationals for the outputs of a program."""
    outputs = SimpleNamespace(of_role=lambda role: program.of_role("output") * (role == "input"))
    return numbers(outputs, seed)


def dot(a, b):
    """Sum of products."""
    return sum(x * y for x, y in zip(a, b, strict=True))


def connected(program, wanted, given):
    """Tell if each wanted array may change a given output, and each given output depends on a
    wanted array.
    """
    J = {name: jacobian(program, numbers(program), (name,)) for name in wanted}
    on = {(w, g): any(x for row in J[w][g] for x in row) for w in wanted for g in given}
    return all(any(on[w, g] for g in given) for w in wanted) and all(
        any(on[w, g] for w in wanted) for g in given
    )


def outputs_of(program):
    """Names of all outputs."""
    return [a.name for a in program.of_role("output")]


@every_program
def test_adjoints_are_the_transpose_of_dual_numbers_and_of_tangents(name):
    """b^T (J d) = (J^T b)^T d, both by programs."""
    program, tried = RECTANGULAR[name], 0
    arguments, every, given = numbers(program), arguments_of(program), outputs_of(program)
    for wanted in subsets(every):
        for some in subsets(given):
            if connected(program, wanted, some):
                _, found, expected = gradients(program, arguments, wanted, some)
                assert found == expected, (wanted, some)
                tried += 1
    assert tried >= 2
    directions = {f"d_{n}": xs for n, xs in numbers(program, seed=5).items()}
    values = ran(tangent_program(program, every), arguments | directions)
    weights, back, _ = gradients(program, arguments, every, given)
    one = sum(dot(weights[n], values[f"d_{n}"]) for n in given)
    assert one == dot(back, [x for n in every for x in directions[f"d_{n}"]])


@every_program
def test_tangents_of_adjoints_are_symmetric(name):
    """The Hessian of a weighted sum of outputs, column by column, and what dual numbers say of the
    gradient.
    """
    program = RECTANGULAR[name]
    given = outputs_of(program)
    wanted = [n for n in arguments_of(program) if connected(program, [n], given)]
    back = adjoint_program(program, wanted, given)
    arguments = numbers(program) | {f"b_{n}": xs for n, xs in weights_of(program).items()}
    read = arguments_of(back)
    by_duals = jacobian(back, {n: arguments[n] for n in read}, [n for n in wanted if n in read])
    H = [row for n in wanted for row in by_duals[f"b_{n}"]]
    assert [list(column) for column in zip(*H, strict=True)] == H
    assert any(x for row in H for x in row)
    directions = {f"d_{n}": xs for n, xs in numbers(program, seed=7).items()}
    values = ran(tangent_program(back, wanted), arguments | directions)
    d = [x for n in wanted for x in directions[f"d_{n}"]]
    found = [x for n in wanted for x in values.get(f"d_b_{n}", [0] * len(arguments[n]))]
    assert found == [dot(row, d) for row in H]


# ---- what is kept --------------------------------------------------------------------------------


def test_only_what_is_overwritten_is_kept():
    b, _, x, y, u, w = built()
    s, t = b.array("s", 1), b.array("t", 1, 3)
    b.fill(s[0], 1)
    b.fill(u.part(0, 3), 0)
    with b.loop("i", 3) as i:
        b.apply(NEXT, {"s": x[i], "x": x[i], "y": y[i]}, s=t[i])
        b.apply(NEXT, {"s": s[0], "x": t[i], "y": y[i]}, s=s[0])
    b.apply(SQUARE, {"x": s[0]}, s=w[0])
    back = adjoint_program(b.finish(), ("x",), ("w",))
    kept = {a.name: (a.size, a.count) for a in back.arrays if a.name.startswith("kept_")}
    assert kept == {"kept_0_s": (1, 3), "kept_1_s": (1, 1)}


def test_each_iteration_keeps_its_own_value():
    """Iterations of nested loops are numbered from 0 on, the innermost fastest."""
    loops = tuple(
        Loop(var, as_index(0), as_index(n), down, ())
        for var, n, down in [("i", 2, False), ("j", 3, True)]
    )
    number, count = iterations(loops)
    assert count == 6
    assert [number.at({"i": i, "j": j}) for i in range(2) for j in range(3)] == list(range(6))
    assert iterations(()) == (Index(), 1)


def test_loops_run_the_other_way_back():
    back = adjoint_program(RECTANGULAR["carry_up"], ("x",), ("u",))
    ways = [s.downward for s in back.body if isinstance(s, Loop)]
    assert ways == [False, True]
    back = adjoint_program(RECTANGULAR["carry_down"], ("x",), ("u",))
    assert [s.downward for s in back.body if isinstance(s, Loop)] == [True, False]


def test_forward_part_is_left_out_where_it_is_not_needed():
    """The adjoint of a linear program reads no value: nothing runs forward."""
    b, _, x, _, u, w = built()
    b.fill(w[0], 0)
    b.fill(u.part(0, 3), 0)
    with b.loop("i", 3) as i:
        b.copy(w[0], x[i], adds=True)
    back = adjoint_program(b.finish(), ("x",), ("w",))
    assert [s.downward for s in back.body if isinstance(s, Loop)] == [True]
    assert Run(back, EXACT, {"x": [], "y": [], "mass": [], "b_w": [EXACT.const(5)]}).values[
        "b_x"
    ] == [5, 5, 5]


def test_an_input_without_influence_has_a_zero_gradient():
    back = adjoint_program(RECTANGULAR["guarded"], ("x", "y"), ("w",))
    numbers_ = {"b_w": [EXACT.const(5)]}
    assert Run(back, EXACT, numbers_).values["b_y"] == [0, 0, 0]


# ---- what is refused -----------------------------------------------------------------------------


def test_values_kept_in_a_triangle_are_refused():
    with pytest.raises(ValueError, match="loop j"):
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
    with pytest.raises(TypeError, match=statement.capitalize()):
        adjoint_program(b.finish(), ("a",), ("x",))


# ---- places that several statements, iterations or inputs share: right or refused ----------------


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
