"""Directions in turn, and tangents at rest left out: the same numbers by few operations."""

import pytest

from serpentail_codegen.ir.cost import executed
from serpentail_codegen.ir.interpret import unroll
from serpentail_codegen.ir.program import Apply, Array, Fill, Index, Loop, Program, Unit, as_index
from serpentail_codegen.ir.step import Step
from serpentail_codegen.ir.tape import operation_count
from serpentail_codegen.passes.directions import directions_in_turn
from serpentail_codegen.passes.still import without_still
from serpentail_codegen.passes.unread import without_unread_fills
from tests.passes.programs import TAILS, outputs, program_of
from tests.support.rows import row

WIDE = (
    "inverse_dynamics_derivatives",
    "forward_dynamics_derivatives",
    "inverse_dynamics_hessian",
    "airborne_rates_derivatives",  # these two write single lanes, too
    "airborne_rates_hessian",
)
# Operations over those that a line without loops needs, from which all zeros are gone.
MOST = {
    ("inverse_dynamics_derivatives", "m3_n4"): 1.2,
    ("forward_dynamics_derivatives", "m3_n4"): 1.2,
    ("inverse_dynamics_derivatives", "m1_n3"): 1.35,
    ("forward_dynamics_derivatives", "m1_n3"): 1.35,
    ("inverse_dynamics_hessian", "m3_n4"): 1.55,
}
LESS = {
    "inverse_dynamics_hessian": 0.97,
    "inverse_dynamics_parameter_derivatives": 0.95,
    "forward_dynamics_derivatives": 1.0,
}


@pytest.mark.parametrize("tail", TAILS)
def test_directions_in_turn_give_the_same_numbers(tail):
    for name in WIDE:
        program = program_of(name, tail)
        narrow = directions_in_turn(program)
        with row(name):
            assert not any(a.lanes for a in narrow.arrays)
            assert outputs(narrow) == outputs(program)


def test_few_operations_work_on_zeros():
    for (name, tail), most in MOST.items():
        narrow = directions_in_turn(program_of(name, tail))
        tape, results, guards = unroll(narrow)
        ends = [n for nodes in results.values() for n in nodes] + [node for _, node in guards]
        with row(name, tail):
            assert executed(narrow) <= most * operation_count(tape.nodes, ends)


def test_a_step_that_lost_its_tangents_has_no_columns_left():
    step = Step("twice", "2 x", (("x", 1),), (("y", 1),), (("input", 0), ("add", 0, 0)), (1,))
    x, y = Array("x", "input", 1), Array("y", "output", 1)
    seed = Array("seed", "local", 1, lanes=3)
    call = Apply(step, (x[0],), (y[0],), (False,), as_index(2))
    program = Program("f", "", (x, y, seed), (Unit(seed[0], as_index(0)), call))
    assert directions_in_turn(program).body[-1] == Apply(step, (x[0],), (y[0],), (False,))


def test_fills_that_are_overwritten_go_and_others_stay():
    x, y, z = Array("x", "input", 1), Array("y", "output", 3), Array("z", "local", 1)
    step = Step("copy", "x", (("x", 1),), (("y", 1),), (("input", 0),), (0,))
    k = Index((("k", 1),))
    kept = Fill(y.whole(), (0,) * 3)
    body = (Apply(step, (x[0],), (y.part(k, 1),), (0,)),)
    loop = Loop("k", as_index(0), as_index(2), False, body)
    program = Program("f", "", (x, y, z), (Fill(z[0], (0,)), kept, loop))
    assert without_unread_fills(program).body == (kept, loop)
    everywhere = Loop("k", as_index(0), as_index(3), False, body)
    program = Program("f", "", (x, y, z), (kept, everywhere))
    assert without_unread_fills(program).body == (everywhere,)


def test_what_is_at_rest_is_left_out():
    for tail in ("m1_n3", "m3_n4", "arcs3"):
        for name, less in LESS.items():
            program = program_of(name, tail)
            found = without_still(program)
            with row(name, tail):
                assert outputs(found) == outputs(program)
                assert executed(found) <= less * executed(program)


def test_zeros_are_stored_where_a_step_gave_nothing_else():
    inputs, nodes = (("x", 1), ("d_x", 1), ("d_z", 1)), [("input", k) for k in range(3)]
    nodes += [("mul", 0, 2), ("add", 1, 1)]
    step = Step("s", "x d_z, 2 d_x.", inputs, (("y", 1), ("d_y", 1)), tuple(nodes), (3, 4))
    x = Array("x", "input", 1)
    d_x, d_z = (Array(name, "local", 1, lanes=3) for name in ("d_x", "d_z"))
    out = [Array(name, "output", 1, lanes=3) for name in ("a", "b")]
    call = Apply(step, (x[0], d_x[0], d_z[0]), (out[0][0], out[1][0]), (False, False))
    start = Unit(d_x[0], as_index(0)), Fill(d_z[0], (0,))
    program = Program("f", "", (x, d_x, d_z, *out), (*start, call))
    _, found, zeros = without_still(program).body
    assert found.reads == (d_x[0],) and found.writes == (out[1][0],)
    assert zeros == Fill(out[0][0], (0,))
