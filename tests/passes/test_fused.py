"""Fused steps: the same numbers by fewer steps, and only where reading comes before writing."""

from dataclasses import replace

from serpentail_codegen.ir.dataflow import inlined
from serpentail_codegen.ir.interpret import Numbers, Run
from serpentail_codegen.ir.program import (
    Apply,
    Array,
    Fill,
    Index,
    Loop,
    Program,
    as_index,
    statements,
)
from serpentail_codegen.ir.step import Step
from serpentail_codegen.passes.fused import fit, fused, joined
from tests.passes.programs import outputs, program_of
from tests.support.rows import row

NODES = (("input", 0), ("input", 1), ("add", 0, 1))
ADD = Step("sum", "a + b.", (("a", 1), ("b", 1)), (("c", 1),), NODES, (2,))


def steps(program):
    """How many steps a program applies."""
    return sum(isinstance(s, Apply) for s, _ in statements(program.body))


def test_fewer_steps_give_the_same_numbers():
    for tail in ("m1_n3", "m3_n4", "arcs3"):
        for name in ("forward_dynamics_derivatives", "inverse_dynamics_hessian"):
            program = inlined(program_of(name, tail))
            fewer = fused(program)
            with row(name, tail):
                assert steps(fewer) < steps(program) and len(fewer.arrays) <= len(program.arrays)
                assert outputs(fewer) == outputs(program)


def test_steps_are_joined_only_where_the_second_reads_what_the_first_stored():
    x = Array("x", "local", 6)

    def call(a, b, c, adds=False):
        return Apply(ADD, (x.part(a, 1), x.part(b, 1)), (x.part(c, 1),), (adds,))

    assert fit(call(0, 1, 2), call(2, 0, 3))
    assert fit(call(0, 1, 2), call(3, 4, 0))  # overwrites what was read
    assert not fit(call(0, 1, 2, adds=True), call(2, 0, 3))
    assert not fit(call(0, 1, 2), call(3, 4, 2))
    assert not fit(call(0, 1, 2), replace(call(2, 0, 3), columns=as_index(1)))
    pair = Apply(ADD, (x.part(2, 1, 2), x.part(0, 1)), (x.part(3, 1),), (False,))
    wide = replace(pair, reads=(replace(pair.reads[0], size=2), pair.reads[1]))
    assert not fit(call(0, 1, 2), wide)


def test_steps_of_other_directions_stay_apart():
    def twice(lanes):
        x, y = (Array(f"{name}{lanes}", "local", 1, lanes=lanes) for name in "xy")
        return Apply(ADD, (x[0], x[0]), (y[0],), (False,))

    assert fit(twice(0), twice(2)) and fit(twice(2), twice(0))
    assert not fit(twice(2), twice(5))


def test_ways_to_join_two_steps_have_names_of_their_own():
    x, y = Array("x", "input", 3), Array("y", "local", 2)
    first = Apply(ADD, (x.part(0, 1), x.part(1, 1)), (y.part(0, 1),), (False,))
    left = Apply(ADD, (y.part(0, 1), x.part(2, 1)), (y.part(1, 1),), (False,))
    right = replace(left, reads=(x.part(1, 1), y.part(0, 1)))
    names = {joined(first, second).step.name for second in (left, right)}
    assert len(names) == 2


def test_short_loops_are_written_out_with_the_lanes_that_each_iteration_needs():
    x, y = Array("x", "input", 2, lanes=4), Array("y", "output", 2, lanes=4)
    k = Index((("k", 1),))
    call = Apply(ADD, (x.part(k, 1), x.part(0, 1)), (y.part(k, 1),), (False,), 2 * k + 2)
    loop = Loop("k", as_index(0), as_index(2), False, (call,))
    first, second = fused(Program("f", "", (x, y), (loop,))).body
    assert (first.columns, second.columns) == (as_index(2), as_index(4))
    assert (first.writes, second.writes) == ((y.part(0, 1),), (y.part(1, 1),))


def test_what_is_added_to_a_fill_is_stored():
    x, y = Array("x", "input", 2), Array("y", "output", 1)
    call = Apply(ADD, (x.part(0, 1), x.part(1, 1)), (y[0],), (True,))
    (step,) = fused(Program("f", "", (x, y), (Fill(y[0], (0,)), call, call))).body
    assert step.adds == (False,)
    numbers = {"x": [2.0, 3.0]}
    assert Run(Program("f", "", (x, y), (step,)), Numbers(), numbers).values["y"] == [10.0]
