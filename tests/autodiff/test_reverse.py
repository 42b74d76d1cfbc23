"""Adjoints of programs: exact in rational arithmetic, where dual numbers run the same loops."""

import pytest

from serpentail_codegen.autodiff.forward import tangent_program
from serpentail_codegen.autodiff.reverse import adjoint_program, iterations
from serpentail_codegen.ir.interpret import Run
from serpentail_codegen.ir.program import Index, Loop, as_index, statements
from tests.autodiff.test_forward import arguments_of, subsets
from tests.support.programs import EXACT, NEXT, RECTANGULAR, SQUARE, built, jacobian, numbers

every_program = pytest.mark.parametrize("name", RECTANGULAR)


def gradients(program, arguments, wanted, given, seed=3):
    """Weights of the given outputs, the adjoints that the program of adjoints gives, and what dual
    numbers say.
    """
    weights = {
        name: xs
        for name, xs in numbers_of(program.of_role("output"), seed).items()
        if name in given
    }
    J = jacobian(program, arguments, wanted)
    terms = [(w, row) for name in given for w, row in zip(weights[name], J[name], strict=True)]
    expected = [sum(w * row[k] for w, row in terms) for k in range(len(terms[0][1]))]
    back = adjoint_program(program, wanted, given)
    inputs = arguments | {f"b_{name}": xs for name, xs in weights.items()}
    values = Run(back, EXACT, {n: inputs[n] for n in arguments_of(back)}).values
    assert {a.name for a in back.of_role("output")} == {f"b_{name}" for name in wanted}
    return weights, [x for name in wanted for x in values[f"b_{name}"]], expected


def numbers_of(arrays, seed):
    """Random rationals for some arrays."""
    return numbers(
        type(
            "Arrays", (), {"of_role": staticmethod(lambda role: arrays if role == "input" else ())}
        ),
        seed,
    )


def connected(program, wanted, given):
    """Tell if each wanted array may change a given output, and each given output depends on a
    wanted array.
    """
    J = {name: jacobian(program, numbers(program), (name,)) for name in wanted}
    on = {(w, g): any(x for row in J[w][g] for x in row) for w in wanted for g in given}
    return all(any(on[w, g] for g in given) for w in wanted) and all(
        any(on[w, g] for w in wanted) for g in given
    )


@every_program
def test_adjoints_are_the_transpose_of_dual_numbers(name):
    program, tried = RECTANGULAR[name], 0
    for wanted in subsets(arguments_of(program)):
        for given in subsets([a.name for a in program.of_role("output")]):
            if connected(program, wanted, given):
                _, found, expected = gradients(program, numbers(program), wanted, given)
                assert found == expected, (wanted, given)
                tried += 1
    assert tried >= 2


@every_program
def test_adjoints_are_the_transpose_of_tangents(name):
    """b^T (J d) = (J^T b)^T d, both by programs."""
    program = RECTANGULAR[name]
    arguments, wanted = numbers(program), arguments_of(program)
    given = [a.name for a in program.of_role("output")]
    directions = {f"d_{n}": xs for n, xs in numbers(program, seed=5).items()}
    forward = tangent_program(program, wanted)
    inputs = arguments | directions
    values = Run(forward, EXACT, {n: inputs[n] for n in arguments_of(forward)}).values
    weights, back, _ = gradients(program, arguments, wanted, given)
    one = sum(b * d for n in given for b, d in zip(weights[n], values[f"d_{n}"], strict=True))
    assert one == sum(
        b * d for b, d in zip(back, (x for n in wanted for x in directions[f"d_{n}"]), strict=True)
    )


@every_program
def test_tangents_of_adjoints_are_symmetric(name):
    """The Hessian of a weighted sum of outputs, column by column, and what dual numbers say of the
    gradient.
    """
    program = RECTANGULAR[name]
    given = [a.name for a in program.of_role("output")]
    wanted = [n for n in arguments_of(program) if connected(program, [n], given)]
    back = adjoint_program(program, wanted, given)
    arguments = numbers(program) | {
        f"b_{n}": xs for n, xs in numbers_of(program.of_role("output"), 3).items()
    }
    by_duals = jacobian(
        back,
        {n: arguments[n] for n in arguments_of(back)},
        [n for n in wanted if n in arguments_of(back)],
    )
    H = [row for n in wanted for row in by_duals[f"b_{n}"]]
    assert [list(column) for column in zip(*H, strict=True)] == H
    assert any(x for row in H for x in row)
    second = tangent_program(back, wanted)
    directions = {f"d_{n}": xs for n, xs in numbers(program, seed=7).items()}
    inputs = arguments | directions
    values = Run(second, EXACT, {n: inputs[n] for n in arguments_of(second)}).values
    d = [x for n in wanted for x in directions[f"d_{n}"]]
    found = [x for n in wanted for x in values.get(f"d_b_{n}", [0] * len(arguments[n]))]
    assert found == [sum(a * b for a, b in zip(row, d, strict=True)) for row in H]


# What is kept


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


def test_every_value_that_the_way_back_reads_is_there():
    """Adjoint programs leave no statement that nothing needs, and read nothing that was not
    written.
    """
    for program in RECTANGULAR.values():
        given = [a.name for a in program.of_role("output")]
        wanted = [n for n in arguments_of(program) if connected(program, [n], given)]
        back = adjoint_program(program, wanted, given)
        known = {
            a.name
            for a in (
                *back.of_role("input"),
                *back.of_role("parameters"),
                *back.of_role("constant"),
            )
        }
        for statement, _ in statements(back.body):
            refs = getattr(statement, "reads", ()) or (
                [statement.source] if hasattr(statement, "source") else []
            )
            assert {ref.array.name for ref in refs} <= known
            known |= {ref.array.name for ref in getattr(statement, "writes", ())}
            known |= {statement.target.array.name} if hasattr(statement, "target") else set()


def test_an_input_without_influence_has_a_zero_gradient():
    back = adjoint_program(RECTANGULAR["guarded"], ("x", "y"), ("w",))
    numbers_ = {"b_w": [EXACT.const(5)]}
    assert Run(back, EXACT, numbers_).values["b_y"] == [0, 0, 0]
