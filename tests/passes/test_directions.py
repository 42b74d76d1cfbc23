"""Directions in turn: the same numbers without wide arrays, and hardly an operation on zeros."""

import numpy as np
import pytest

from serpentail_codegen.functions.catalogue import CATALOGUE
from serpentail_codegen.functions.function import assemble
from serpentail_codegen.functions.tail import Tail
from serpentail_codegen.ir.cost import executed
from serpentail_codegen.ir.interpret import Numbers, Run, unroll
from serpentail_codegen.ir.program import Apply, Array, Fill, Index, Loop, Program, Unit, as_index
from serpentail_codegen.ir.step import Step
from serpentail_codegen.ir.tape import operation_count
from serpentail_codegen.passes.directions import directions_in_turn
from serpentail_codegen.passes.unread import without_unread_fills

WIDE = (
    "inverse_dynamics_derivatives",
    "forward_dynamics_derivatives",
    "inverse_dynamics_hessian",
    "airborne_rates_derivatives",  # these two write single lanes, too
    "airborne_rates_hessian",
)
TAILS = {
    "m1_n3": Tail(1, 3),
    "m3_n4": Tail(3, 4),
    "m6_n6": Tail(6, 6),
    "arcs3": Tail(3, 4, "continuum"),
}


def outputs(program):
    """All that a program gives for random numbers."""
    rng = np.random.default_rng(4)
    given = (*program.of_role("parameters"), *program.of_role("input"))
    numbers = {a.name: rng.uniform(0.1, 1, a.length).tolist() for a in given}
    values = Run(program, Numbers(np), numbers).values
    return [float(x) for a in program.of_role("output") for x in values[a.name]]


@pytest.mark.parametrize("name", WIDE)
@pytest.mark.parametrize("tail", TAILS)
def test_directions_in_turn_give_the_same_numbers(tail, name):
    program = assemble(CATALOGUE[name].of(TAILS[tail]), TAILS[tail])
    narrow = directions_in_turn(program)
    assert not any(a.lanes for a in narrow.arrays)
    assert outputs(narrow) == outputs(program)


# Operations over those that a line without loops needs, from which all zeros are gone.
MOST = {
    ("inverse_dynamics_derivatives", "m3_n4"): 1.2,
    ("forward_dynamics_derivatives", "m3_n4"): 1.2,
    ("inverse_dynamics_derivatives", "m1_n3"): 1.35,
    ("forward_dynamics_derivatives", "m1_n3"): 1.35,
    ("inverse_dynamics_hessian", "m3_n4"): 1.55,
}


@pytest.mark.parametrize(("name", "tail"), MOST)
def test_few_operations_work_on_zeros(name, tail):
    narrow = directions_in_turn(assemble(CATALOGUE[name].of(TAILS[tail]), TAILS[tail]))
    tape, results, guards = unroll(narrow)
    ends = [n for nodes in results.values() for n in nodes] + [node for _, node in guards]
    assert executed(narrow) <= MOST[name, tail] * operation_count(tape.nodes, ends)


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
    loop = Loop(
        "k", as_index(0), as_index(2), False, (Apply(step, (x[0],), (y.part(k, 1),), (0,)),)
    )
    program = Program("f", "", (x, y, z), (Fill(z[0], (0,)), kept, loop))
    assert without_unread_fills(program).body == (kept, loop)
    everywhere = Loop("k", as_index(0), as_index(3), False, loop.body)
    program = Program("f", "", (x, y, z), (kept, everywhere))
    assert without_unread_fills(program).body == (everywhere,)
