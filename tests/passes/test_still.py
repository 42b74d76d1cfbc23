"""Tangents at rest: the same numbers by fewer operations, arrays as wide as before."""

import pytest

from serpentail_codegen.functions.catalogue import CATALOGUE
from serpentail_codegen.functions.function import assemble
from serpentail_codegen.ir.cost import executed
from serpentail_codegen.ir.program import Apply, Array, Fill, Program, Unit, as_index
from serpentail_codegen.ir.step import Step
from serpentail_codegen.passes.still import without_still

from .test_directions import TAILS, outputs

LESS = {
    "inverse_dynamics_hessian": 0.97,
    "inverse_dynamics_parameter_derivatives": 0.95,
    "forward_dynamics_derivatives": 1.0,
}


@pytest.mark.parametrize("name", LESS)
@pytest.mark.parametrize("tail", ["m1_n3", "m3_n4", "arcs3"])
def test_what_is_at_rest_is_left_out(tail, name):
    program = assemble(CATALOGUE[name].of(TAILS[tail]), TAILS[tail])
    found = without_still(program)
    assert outputs(found) == outputs(program)
    assert executed(found) <= LESS[name] * executed(program)


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
