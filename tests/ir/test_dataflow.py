"""Programs as parts of others: what depends on what, what nothing needs, and one program within
another.
"""

import pytest

from serpentail_codegen.autodiff.forward import tangent_program
from serpentail_codegen.autodiff.reverse import adjoint_program
from serpentail_codegen.ir import dataflow
from serpentail_codegen.ir.builder import Builder
from serpentail_codegen.ir.dataflow import backward_slice, forward_slice, pruned, reads, writes
from serpentail_codegen.ir.program import Apply, Guard, Loop, statements
from tests.support import programs
from tests.support.program_runs import interpreted
from tests.support.programs import EXACT, NEXT, PROGRAMS, RECTANGULAR, SQUARE, built, numbers
from tests.support.rows import row

SPLIT = programs.step_of(
    "split", (("x", 1), ("y", 1)), (("s", 1), ("z", 1)), lambda t, x, y: [t.mul(x, x), t.mul(y, y)]
)


def outputs(program, arguments):
    """The outputs of a run by name."""
    given = {name: arguments[name] for name in numbers(program)}
    return interpreted(program, given, EXACT)


def made():
    """Programs as they come from builders, tangents and adjoints."""
    for name, program in PROGRAMS.items():
        yield name, pruned(program)
        yield f"tangents of {name}", tangent_program(program, [*numbers(program)])
    for name, program in RECTANGULAR.items():
        active = {"guarded": "mass", "columns": "m"}.get(name, "x")
        yield f"adjoints of {name}", adjoint_program(program, (active,), ("u",))


# What depends on what


def diamond():
    """w from a and b, both from x; u from y alone."""
    b, mass, x, y, u, w = built()
    p, q = b.array("p", 1), b.array("q", 1)
    b.apply(SPLIT, {"x": x[0], "y": y[0]}, s=p[0], z=u[0])
    b.copy(u.part(1, 2), y.part(1, 2))
    b.guard(mass[0], "TOO_SMALL", w[0])
    b.apply(SQUARE, {"x": x[1]}, s=q[0])
    b.apply(NEXT, {"s": p[0], "x": q[0], "y": q[0]}, s=w[0])
    return b.finish()


def test_dependence_goes_both_ways_and_around_loops():
    body = diamond().body
    forward = {"x": "x p q w u", "q": "q w", "mass": "mass"}  # a step is one: it may take x to u
    backward = {"w": "w p q x mass", "u": "u y"}  # an output that is not wanted needs nothing
    for slice_of, expected in ((forward_slice, forward), (backward_slice, backward)):
        for start, reached in expected.items():
            with row(slice_of.__name__, start):
                assert slice_of(body, {start}) == set(reached.split())

    b, _mass, x, _y, u, _w = built()
    s, t = b.array("s", 1), b.array("t", 1)
    with b.loop("i", 3) as i:
        b.copy(u[i], t[0])
        b.copy(t[0], s[0])
        b.copy(s[0], x[i])
    assert "u" in forward_slice(b.finish().body, {"x"})
    assert "x" in backward_slice(b.finish().body, {"u"})


def test_sums_read_what_they_add_to():
    b, _mass, x, y, u, w = built()
    b.copy(w[0], x[0], adds=True)
    b.apply(SQUARE, {"x": y[0]}, s_=u[0])
    b.apply(SQUARE, {"x": y[0]}, s=u[0])
    added, squared, stored = b.finish().body
    assert reads(added) == (x[0], w[0]) and writes(added) == (w[0],)
    assert reads(squared) == (y[0], u[0]) and reads(stored) == (y[0],)
    guard = Guard(w[0], "TOO_SMALL", ())
    assert reads(guard) == (w[0],) and writes(guard) == ()


# What nothing needs


def test_pruning_keeps_the_outputs():
    for name, program in PROGRAMS.items():
        with row(name):
            given = numbers(program)
            assert outputs(pruned(program), given) == outputs(program, given)


def test_nothing_unneeded_is_left():
    """Every array matters to an output; every loop has a body; every output of a step is needed."""
    for name, program in made():
        needed = backward_slice(program.body, {a.name for a in program.of_role("output")})
        known = {a.name for a in program.arrays if a.role in ("input", "output", "parameters")}
        assert {a.name for a in program.arrays} == needed | known, name
        for statement, loops in statements(program.body):
            assert all(loop.body for loop in loops)
            targets = statement.protects if isinstance(statement, Guard) else writes(statement)
            assert targets and {ref.array.name for ref in targets} <= needed, name
        assert pruned(program) == program, name


def test_outputs_of_a_step_go_one_by_one():
    b, _mass, x, y, u, w = built()
    dead = b.array("dead", 1)
    b.fill(u.part(0, 3), 0)
    b.apply(SPLIT, {"x": x[0], "y": y[0]}, s=w[0], z=dead[0])
    with b.loop("i", 3) as i:
        b.apply(programs.TURN, {"x": x.part(0, 2), "y": y[i]}, s=b.array("t", 2)[0])
    program = pruned(b.finish())
    (call,) = [s for s in program.body if isinstance(s, Apply)]
    found = (call.step.name, call.reads, call.writes, call.adds)
    assert found == ("split_s", (x[0],), (w[0],), (False,))
    assert not any(isinstance(s, Loop) for s in program.body)
    assert [a.name for a in program.arrays] == ["mass", "x", "y", "u", "w"]


def test_guards_stay_where_they_protect_an_output():
    b, _mass, x, _y, u, w = built()
    dead = b.array("dead", 1)
    b.fill(u.part(0, 3), 0)
    b.fill(dead[0], 0)
    b.guard(x[0], "TOO_SMALL", w[0], dead[0])
    b.guard(x[1], "TOO_SMALL", dead[0])
    b.apply(SQUARE, {"x": x[0]}, s=w[0])
    guards = [s for s in pruned(b.finish()).body if isinstance(s, Guard)]
    assert [(g.scalar, g.protects) for g in guards] == [(x[0], (w[0],))]


# One program within another


def outer():
    """A builder with the arguments that the inner programs have."""
    b = Builder("outer", "A program with another one inside.")
    b.array("mass", 1, role="parameters")
    return b, b.array("a", 1, 3, "input"), b.array("y", 1, 3, "input"), b.array("z", 1, 3, "output")


def test_called_programs_mean_the_same_and_have_arrays_of_their_own_each_time():
    """In a loop, and one call after the other: the outputs of all are summed up."""
    for name in sorted(PROGRAMS.keys() - {"columns"}):
        inner, (b, a, y, z) = PROGRAMS[name], outer()
        s, w, total = b.array("s", 1), b.array("w", 1), b.array("total", 1, role="output")
        b.fill(s[0], 7)
        b.fill(total[0], 0)
        for times in (2, 1, 1):
            with b.loop("l", times):
                b.call(inner, x=a, y=y, u=z, w=w)
                b.copy(total[0], w[0], adds=True)
        b.copy(total[0], s[0], adds=True)  # the inner program's own s is another
        names = [array.name for array in dataflow.inlined(b.finish()).arrays]
        given = numbers(inner)
        expected = outputs(inner, given)
        found = outputs(b.finish(), {"mass": given["mass"], "a": given["x"], "y": given["y"]})
        with row(name):
            assert len(names) == 7 + 3 * sum(array.role == "local" for array in inner.arrays)
            assert found == {"z": expected["u"], "total": [4 * expected["w"][0] + 7]}


def test_called_names_carry_the_programs_name():
    b, a, y, z = outer()
    b.call(PROGRAMS["nested"], x=a, y=y, u=z, w=b.array("w", 1))
    program = dataflow.inlined(b.finish())
    assert " ".join(array.name for array in program.arrays) == "mass a y z w nest_s nest_t"
    for statement, _ in statements(program.body):
        assert all(ref.array in program.arrays for ref in (*reads(statement), *writes(statement)))


def test_arguments_that_are_not_bound_are_named():
    b, a, y, z = outer()
    given = {"x": a, "y": y, "u": z, "w": b.array("w", 1)}
    for left_out, role in {"x": "input", "y": "input", "u": "output", "w": "output"}.items():
        bound = {name: array for name, array in given.items() if name != left_out}
        with row(left_out), pytest.raises(ValueError, match=f"^nest in outer: {role} {left_out} "):
            b.call(PROGRAMS["nested"], **bound)
