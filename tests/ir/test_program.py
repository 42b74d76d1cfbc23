"""Programs: what loops over steps mean, that unrolling keeps every bit of it, and that the solver
solves.
"""

import math
import random
from fractions import Fraction
from types import SimpleNamespace

import numpy as np
import pytest

from serpentail_codegen.functions.function import assemble
from serpentail_codegen.functions.plain import FUNCTIONS
from serpentail_codegen.functions.tail import Tail
from serpentail_codegen.ir.builder import Builder, narrowed
from serpentail_codegen.ir.interpret import Numbers, Run, branches, unroll
from serpentail_codegen.ir.ldl import ldl_factor, ldl_solve, pair_factor, pair_solve
from serpentail_codegen.ir.program import Apply, Array, Fill, Index, Loop, as_index, statements
from serpentail_codegen.ir.step import Step
from serpentail_codegen.ir.tape import Tape, live_nodes, replay
from serpentail_codegen.targets.c.loops import in_loops
from serpentail_codegen.targets.c.routine import routine_lines
from tests.references.parameters import TABLE_1, random_states

TAILS = {"m1_n2": Tail(1, 2), "m2_n3": Tail(2, 3), "continuum_m2": Tail(2, 3, "continuum")}
FLOATS = Numbers(math, float)
EXACT = Numbers(
    SimpleNamespace(sin=lambda x: x / (1 + x * x), cos=lambda x: 1 / (1 + x * x), sqrt=None),
    Fraction,
)


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


def step_of(name, inputs, outputs, build):
    """A step recorded by ``build(tape, *nodes)``."""
    tape = Tape()
    nodes = [tape.input(k) for k in range(sum(size for _, size in inputs))]
    results = build(tape, *nodes)
    return Step(name, "A step.", inputs, outputs, tuple(tape.nodes), tuple(results))


SUM = step_of("plus", (("x", 1), ("y", 1)), (("z", 1),), lambda t, x, y: [t.add(x, y)])
SWAP = step_of("swap", (("x", 2),), (("x", 2),), lambda t, a, b: [b, a])
SPLIT = step_of(
    "split",
    (("x", 2), ("y", 1)),
    (("u", 1), ("v", 2)),
    lambda t, a, b, c: [c, t.add(a, b), t.mul(a, b)],
)


def outputs(builder, **arguments):
    """Run what a builder recorded on exact numbers, interpreted and unrolled; both give the
    same.
    """
    program = builder.finish()
    names = [array.name for array in program.of_role("output")]
    values = Run(program, EXACT, arguments).values
    tape, nodes, _ = unroll(program)
    order = (*program.of_role("parameters"), *program.of_role("input"))
    replayed = replay(
        tape.nodes, [scalar for array in order for scalar in arguments[array.name]], EXACT
    )
    assert {name: [replayed[node] for node in nodes[name]] for name in names} == {
        name: values[name] for name in names
    }
    return values[names[0]] if len(names) == 1 else {name: values[name] for name in names}


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
    assert Run(p, EXACT, {"x": [1, -2, 3]}).guards == [
        ("TOO_SMALL", 1),
        ("TOO_SMALL", -2),
        ("TOO_SMALL", 3),
    ]
    assert unroll(p)[2] == [("TOO_SMALL", node) for node in range(3)]


# The functions of the models.


@pytest.fixture(params=TAILS)
def tail(request):
    """A tail of few segments."""
    return TAILS[request.param]


@pytest.fixture(params=FUNCTIONS)
def function(request):
    """A function of the catalogue."""
    return FUNCTIONS[request.param]


def arguments_of(program, tail, convert):
    """Table 1 and a random state for the parameters and inputs of a program."""
    q, v, v_dot, tau = (rows[0] for rows in random_states(tail.segments, 3, 1, "random"))
    f_ext = np.random.default_rng(4).uniform(-1, 1, 6 + 3 * (tail.total + 1))
    known = {
        "q": q,
        "v": v,
        "v_dot": v_dot,
        "tau": tau,
        "f_ext": f_ext,
        "link_inertia": (4.9e-8, 2e-9, 5e-8),
    } | TABLE_1
    arrays = (*program.of_role("parameters"), *program.of_role("input"))
    return {a.name: [convert(x) for x in np.ravel(known[a.name]).tolist()] for a in arrays}


def unrolled_values(program, arguments, algebra, fixed=()):
    """Unroll, then evaluate the straight line; return the scalars of every output array."""
    tape, nodes, _ = unroll(program, {name: arguments[name] for name in fixed})
    scalars = [scalar for values in arguments.values() for scalar in values]
    values = replay(tape.nodes, scalars, algebra)
    return {name: [values[node] for node in found] for name, found in nodes.items()}


def interpreted_values(program, arguments, algebra):
    """Run the loops; return the scalars of every output array."""
    values = Run(program, algebra, arguments).values
    return {array.name: values[array.name] for array in program.of_role("output")}


def rounded(x):
    """A coarse rational: exact arithmetic on it stays small."""
    return (
        Fraction(round(x * 64), 64) if abs(x) > 1 / 16 else Fraction(x).limit_denominator(1 << 30)
    )


def test_unrolling_keeps_every_bit(function, tail):
    """Signs of zeros aside: no two constants that round meet in these programs, so folding changes
    no rounding.
    """
    p = assemble(function, tail)
    arguments = arguments_of(p, tail, float)
    unrolled, interpreted = (
        unrolled_values(p, arguments, FLOATS),
        interpreted_values(p, arguments, FLOATS),
    )
    assert unrolled == interpreted
    assert all(math.isfinite(x) for values in interpreted.values() for x in values)


def test_unrolling_and_baking_are_exact_in_rational_arithmetic(function):
    tail = Tail(1, 2)
    p = assemble(function, tail)
    arguments = arguments_of(p, tail, rounded)
    interpreted = interpreted_values(p, arguments, EXACT)
    names = [array.name for array in p.of_role("parameters")]
    assert unrolled_values(p, arguments, EXACT) == interpreted
    assert unrolled_values(p, arguments, EXACT, fixed=names) == interpreted


def unrolled_results(program, fixed=None):
    """Unroll; return the tape and all nodes that are wanted of it, what must be positive
    included.
    """
    tape, nodes, guards = unroll(program, fixed)
    return tape, [node for found in nodes.values() for node in found] + [node for _, node in guards]


def test_baking_leaves_no_parameter_and_adds_no_operation(function, tail):
    p = assemble(function, tail)
    arguments = arguments_of(p, tail, float)
    tape, results = unrolled_results(
        p, {array.name: arguments[array.name] for array in p.of_role("parameters")}
    )
    read = {
        tape.nodes[node][1]
        for node in live_nodes(tape.nodes, results)
        if tape.nodes[node][0] == "input"
    }
    assert min(read) >= sum(array.length for array in p.of_role("parameters"))
    free, free_results = unrolled_results(p)
    assert len(live_nodes(tape.nodes, results)) <= len(live_nodes(free.nodes, free_results))


def test_a_batch_is_its_states_one_by_one(function, tail):
    p = assemble(function, tail)
    one = arguments_of(p, tail, float)
    inputs = {array.name for array in p.of_role("input")}
    stretched = {
        name: [np.array([x, 0.9 * x]) if name in inputs else x for x in xs]
        for name, xs in one.items()
    }
    shrunk = {name: [0.9 * x if name in inputs else x for x in xs] for name, xs in one.items()}
    batch = interpreted_values(p, stretched, Numbers(np, float))
    for k, arguments in enumerate((one, shrunk)):
        for name, expected in interpreted_values(p, arguments, FLOATS).items():
            values = [np.broadcast_to(x, 2)[k] for x in batch[name]]
            np.testing.assert_allclose(
                values, expected, rtol=1e-9, atol=1e-12 * np.max(np.abs(expected))
            )


# LDL^T.


def positive_definite(rng, size):
    """A random symmetric positive definite matrix of small integers."""
    half = [[rng.randint(-3, 3) for _ in range(size)] for _ in range(size)]
    return [
        [sum(a * b for a, b in zip(x, y, strict=True)) + (i == j) for j, y in enumerate(half)]
        for i, x in enumerate(half)
    ]


@pytest.mark.parametrize("size", range(1, 9))
def test_solver_is_exact_in_rational_arithmetic(size):
    rng = random.Random(size)
    A, b = positive_definite(rng, size), [rng.randint(-9, 9) for _ in range(size)]
    lower = [[Fraction(x) for x in row[: k + 1]] for k, row in enumerate(A)]
    factors, pivots = ldl_factor(EXACT, lower)
    x = ldl_solve(EXACT, factors, [Fraction(value) for value in b])
    assert [sum(a * value for a, value in zip(row, x, strict=True)) for row in A] == b
    minors = [Fraction(round(np.linalg.det(np.array(A)[k:, k:]))) for k in reversed(range(size))]
    assert [math.prod(pivots[: k + 1]) for k in range(size)] == minors
    assert [
        list(map(Fraction, row[: k + 1])) for k, row in enumerate(A)
    ] == lower  # the arguments are left alone


@pytest.mark.parametrize("size", [1, 3, 9, 22])
def test_solver_agrees_with_numpy(size):
    rng = np.random.default_rng(size)
    half = rng.normal(size=(size, size))
    A, b = half @ half.T + 0.1 * np.eye(size), rng.normal(size=size)
    factors, pivots = ldl_factor(FLOATS, [row[: k + 1] for k, row in enumerate(A.tolist())])
    x = ldl_solve(FLOATS, factors, b.tolist())
    np.testing.assert_allclose(
        x, np.linalg.solve(A, b), rtol=0, atol=1e-14 * np.linalg.cond(A) * np.abs(x).max()
    )
    assert min(pivots) > 0


def test_pivots_show_what_is_not_positive_definite():
    _, pivots = ldl_factor(EXACT, [[Fraction(1)], [Fraction(2), Fraction(3)]])
    assert pivots == [3, Fraction(-1, 3)]


@pytest.mark.parametrize("size", [1, 3, 8])
def test_pair_solver_is_exact_in_rational_arithmetic(size):
    rng = random.Random(size)
    A, b = positive_definite(rng, size), [rng.randint(-9, 9) for _ in range(size)]
    A = [[x + rng.choice((-1, 1)) * (k != j) for j, x in enumerate(row)] for k, row in enumerate(A)]
    turned = [list(column) for column in zip(*A, strict=True)]
    triangles = [
        [[Fraction(x) for x in row[: k + 1]] for k, row in enumerate(rows)] for rows in (A, turned)
    ]
    *factors, pivots = pair_factor(EXACT, *triangles)
    x = pair_solve(EXACT, *factors, [Fraction(value) for value in b])
    assert [sum(a * value for a, value in zip(row, x, strict=True)) for row in A] == b
    minors = [Fraction(round(np.linalg.det(np.array(A)[k:, k:]))) for k in reversed(range(size))]
    assert [math.prod(pivots[: k + 1]) for k in range(size)] == minors


def test_pair_statement_solves_in_place():
    """[[2, 7], [1, 4]] x = [11, 6]: triangles of it and of its transpose, rows 8 apart."""
    b = Builder("solve", "A x = x.")
    a, x = b.array("a", 32, role="input"), b.array("x", 2, role="output")
    A = b.array("A", 32)
    b.copy(A[0], a[0])
    b.fill(x[0], 11, 6)
    b.factor_pair(A, 2)
    b.solve_pair(A, x[0])
    rows = [[2, 99], [1, 4], [2, 99], [7, 4]]
    assert outputs(b, a=[y for row in rows for y in [*row, *[0] * 6]]) == [2, 1]
    *_, guards = unroll(b.finish())
    assert [status for status, _ in guards] == ["NOT_POSITIVE_DEFINITE"] * 2


def test_solve_statement_solves_in_place():
    """[[2, 1], [1, 3]] x = [5, 10]: the lower triangle, rows 8 apart."""
    b = Builder("solve", "A x = x.")
    a, x = b.array("a", 16, role="input"), b.array("x", 2, role="output")
    A = b.array("A", 16)
    b.copy(A[0], a[0])
    b.fill(x[0], 5, 10)
    b.factor(A, 2)
    b.solve(A, x[0])
    assert outputs(b, a=[2, 99, *[0] * 6, 1, 3, *[0] * 6]) == [1, 3]
    *_, guards = unroll(b.finish())
    assert [status for status, _ in guards] == ["NOT_POSITIVE_DEFINITE"] * 2


# Conditions.

COUNT = step_of(
    "count", (("x", 1), ("y", 1)), (("z", 1),), lambda t, x, y: [t.add(t.mul(x, y), t.const(1))]
)


def conditional():
    """Conditions in a loop and in each other: what is written under one is read, summed up and
    overwritten after it.
    """
    b = Builder("choosy", "Conditions.")
    x, y, u = b.array("x", 1, 4, "input"), b.array("y", 1, 4, "input"), b.array("u", 1, 4, "output")
    w, t = b.array("w", 1, role="output"), b.array("t", 1)
    b.fill(w[0], 1)
    with b.loop("i", 4) as i:
        b.fill(u[i], 7)
        with b.when(x[i]):
            b.apply(COUNT, {"x": x[i], "y": y[i]}, z=t[0])
            b.apply(COUNT, {"x": t[0], "y": w[0]}, z_=w[0])
            with b.when(y[i]):
                b.copy(u[i], t[0])
                b.copy(w[0], y[i], adds=True)
        with b.when(w[0]), b.loop("j", i + 1) as j:
            b.copy(u[j], x[i], adds=True)
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
    return u, w


@pytest.mark.parametrize("seed", range(20))
def test_conditions_run_what_they_ask_for_and_unroll_to_choices(seed):
    rng, p = random.Random(seed), conditional()
    given = {
        name: [Fraction(rng.randint(-3, 3), rng.randint(1, 2)) for _ in range(4)] for name in "xy"
    }
    values = Run(p, EXACT, given).values
    assert (values["u"], values["w"][0]) == plainly(given["x"], given["y"])
    assert unrolled_values(p, given, EXACT) == {"u": values["u"], "w": values["w"]}
    assert unrolled_values(p, given, EXACT, fixed=["x", "y"]) == {
        "u": values["u"],
        "w": values["w"],
    }


def test_a_condition_survives_being_called():
    b = Builder("outer", "Calls.")
    arrays = {
        name: b.array(name, 1, 4, role)
        for name, role in (("x", "input"), ("y", "input"), ("u", "output"))
    }
    b.call(conditional(), **arrays, w=b.array("w", 1, role="output"))
    p, given = b.finish(), {"x": [1, -1, 2, 0], "y": [1, 2, -3, 4]}
    assert branches(p) and not branches(assemble(FUNCTIONS["mass_matrix"], Tail(1, 1)))
    values = Run(p, EXACT, given).values
    assert (values["u"], values["w"][0]) == plainly(**given)


def test_a_guard_under_a_condition_cannot_be_unrolled():
    b = Builder("guarded", "A guard.")
    x, u = b.array("x", 1, role="input"), b.array("u", 1, role="output")
    with b.when(x[0]):
        b.guard(x[0], "OUT_OF_RANGE", u[0])
        b.copy(u[0], x[0])
    with pytest.raises(ValueError, match="a guard under a condition"):
        unroll(b.finish())


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
    values = Run(b.finish(), EXACT, {"x": [Fraction(k) for k in range(6)]}).values
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


def test_c_steps_read_no_rows_that_lie_apart():
    b = Builder("apart", "A stride.")
    x, u = b.wide("x", 4, 3), b.wide("u", 2, 3)
    b.apply(SWAP, {"x": x.part(0, 2, 2)}, x=u[0])
    with pytest.raises(ValueError, match="swap reads wide scalars that lie apart"):
        in_loops(b.finish(), "double", "rat")
