"""Passes: directions in turn, tangents at rest left out, steps fused, straight lines scheduled."""

from dataclasses import replace
from functools import cache
from itertools import pairwise

import numpy as np
import pytest

from serpentail_codegen.functions.catalogue import CATALOGUE
from serpentail_codegen.functions.function import assemble
from serpentail_codegen.functions.tail import Tail
from serpentail_codegen.ir import program as ir
from serpentail_codegen.ir.cost import executed
from serpentail_codegen.ir.dataflow import inlined
from serpentail_codegen.ir.interpret import Numbers, Run, unroll
from serpentail_codegen.ir.program import Apply, Array, Fill, Index, Loop, Program
from serpentail_codegen.ir.step import Step
from serpentail_codegen.ir.tape import Tape, live_nodes, operation_count
from serpentail_codegen.passes import schedule
from serpentail_codegen.passes.dead_fills import without_unread_fills
from serpentail_codegen.passes.fuse_steps import fit, fused, joined
from serpentail_codegen.passes.narrow_directions import directions_in_turn
from serpentail_codegen.passes.structural_zeros import without_still
from tests.support.rows import row

ZERO, ONE, TWO = map(ir.as_index, range(3))
NODES = (("input", 0), ("input", 1), ("add", 0, 1))
ADD = Step("sum", "a + b.", (("a", 1), ("b", 1)), (("c", 1),), NODES, (2,))
TAILS = {"m1_n3": Tail(1, 3), "m3_n4": Tail(3, 4), "m6_n6": Tail(6, 6)}
TAILS |= {"arcs3": Tail(3, 4, "continuum")}
SLOW = pytest.mark.slow


@cache
def program_of(name, tail):
    return assemble(CATALOGUE[name].of(TAILS[tail]), TAILS[tail])


def outputs(program):
    """All that a program gives for random numbers."""
    rng = np.random.default_rng(4)
    given = (*program.of_role("parameters"), *program.of_role("input"))
    numbers = {a.name: rng.uniform(0.1, 1, a.length).tolist() for a in given}
    values = Run(program, Numbers(np), numbers).values
    return [float(x) for a in program.of_role("output") for x in values[a.name]]


# Directions in turn, and tangents at rest: the same numbers, few operations on zeros

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
    ("inverse_dynamics_hessian", "m3_n4"): 1.6,  # of 33700; a direction of omega fills its vectors
}
LESS = {
    "inverse_dynamics_hessian": 0.97,
    "inverse_dynamics_parameter_derivatives": 0.95,
    "forward_dynamics_derivatives": 1.0,
}


@pytest.mark.parametrize(
    "tail", [pytest.param(t, marks=[SLOW] * (t in ("arcs3", "m6_n6"))) for t in TAILS]
)
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
    call = Apply(step, (x[0],), (y[0],), (False,), TWO)
    program = Program("f", "", (x, y, seed), (ir.Unit(seed[0], ZERO), call))
    assert directions_in_turn(program).body[-1] == Apply(step, (x[0],), (y[0],), (False,))


def test_fills_that_are_overwritten_go_and_others_stay():
    x, y, z = Array("x", "input", 1), Array("y", "output", 3), Array("z", "local", 1)
    step = Step("copy", "x", (("x", 1),), (("y", 1),), (("input", 0),), (0,))
    k = Index((("k", 1),))
    kept = Fill(y.whole(), (0,) * 3)
    body = (Apply(step, (x[0],), (y.part(k, 1),), (0,)),)
    loop = Loop("k", ZERO, TWO, False, body)
    program = Program("f", "", (x, y, z), (Fill(z[0], (0,)), kept, loop))
    assert without_unread_fills(program).body == (kept, loop)
    everywhere = Loop("k", ZERO, ir.as_index(3), False, body)
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
    start = ir.Unit(d_x[0], ZERO), Fill(d_z[0], (0,))
    program = Program("f", "", (x, d_x, d_z, *out), (*start, call))
    _, found, zeros = without_still(program).body
    assert found.reads == (d_x[0],) and found.writes == (out[1][0],)
    assert zeros == Fill(out[0][0], (0,))


# Fused steps: the same numbers by fewer steps, only where reading comes before writing


def test_fewer_steps_give_the_same_numbers():
    for tail in ("m1_n3", "m3_n4", "arcs3"):
        for name in ("forward_dynamics_derivatives", "inverse_dynamics_hessian"):
            program = inlined(program_of(name, tail))
            fewer = fused(program)
            with row(name, tail):
                before, after = (
                    sum(isinstance(s, Apply) for s, _ in ir.statements(p.body))
                    for p in (program, fewer)
                )
                assert after < before and len(fewer.arrays) <= len(program.arrays)
                assert outputs(fewer) == outputs(program)


def test_steps_are_joined_only_where_the_second_reads_what_the_first_stored():
    x = Array("x", "local", 6)

    def call(a, b, c, adds=False):
        return Apply(ADD, (x.part(a, 1), x.part(b, 1)), (x.part(c, 1),), (adds,))

    assert fit(call(0, 1, 2), call(2, 0, 3))
    assert fit(call(0, 1, 2), call(3, 4, 0))  # overwrites what was read
    assert not fit(call(0, 1, 2, adds=True), call(2, 0, 3))
    assert not fit(call(0, 1, 2), call(3, 4, 2))
    assert not fit(call(0, 1, 2), replace(call(2, 0, 3), columns=ONE))
    pair = Apply(ADD, (x.part(2, 1, 2), x.part(0, 1)), (x.part(3, 1),), (False,))
    wide = replace(pair, reads=(replace(pair.reads[0], size=2), pair.reads[1]))
    assert not fit(call(0, 1, 2), wide)

    def twice(lanes):
        x, y = (Array(f"{name}{lanes}", "local", 1, lanes=lanes) for name in "xy")
        return Apply(ADD, (x[0], x[0]), (y[0],), (False,))

    assert fit(twice(0), twice(2)) and fit(twice(2), twice(0))
    assert not fit(twice(2), twice(5))  # other directions


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
    loop = Loop("k", ZERO, TWO, False, (call,))
    first, second = fused(Program("f", "", (x, y), (loop,))).body
    assert (first.columns, second.columns) == (TWO, ir.as_index(4))
    assert (first.writes, second.writes) == ((y.part(0, 1),), (y.part(1, 1),))


def test_what_is_added_to_a_fill_is_stored():
    x, y = Array("x", "input", 2), Array("y", "output", 1)
    call = Apply(ADD, (x.part(0, 1), x.part(1, 1)), (y[0],), (True,))
    (step,) = fused(Program("f", "", (x, y), (Fill(y[0], (0,)), call, call))).body
    assert step.adds == (False,)
    numbers = {"x": [2.0, 3.0]}
    assert Run(Program("f", "", (x, y), (step,)), Numbers(), numbers).values["y"] == [10.0]


# The schedule of straight lines: every value once, after what it needs


def test_functions_keep_their_dependencies_and_change_their_order():
    for size, alone in (((1, 1), False), ((1, 3), False), ((3, 2), False), ((3, 4), True)):
        tape, outputs, guards = unroll(assemble(CATALOGUE["forward_dynamics"], Tail(*size)))
        nodes, results = tape.nodes, [*outputs["v_dot"], *(node for _, node in guards)]
        live = live_nodes(nodes, results)
        order = schedule.scheduled(nodes, live, results)
        place = {n: k for k, n in enumerate(order)}
        with row(size):
            assert (order == live) == alone  # long lines are left alone
            assert sorted(order) == sorted(live)
            operations = [n for n in order if nodes[n][0] not in schedule.LEAVES]
            assert all(place[a] < place[n] for n in operations for a in nodes[n][1:])


def test_lines_of_much_independent_work_are_left_alone():
    """Pairs of a sum and its product, 8 cycles: enough to be busy in any order, or one less."""
    for more, alone in ((0, False), (1, True)):
        tape, pairs = Tape(), 4 * schedule.MOST_ABREAST + more
        x = [tape.input(k) for k in range(pairs + 1)]
        results = [tape.mul(tape.add(a, b), a) for a, b in pairwise(x)]
        live = live_nodes(tape.nodes, results)
        assert (schedule.scheduled(tape.nodes, live, results) == live) == alone
