"""Batches: states side by side give what each of them gives alone, in any number, from any thread,
errors included.
"""

import json
from dataclasses import replace

import numpy as np
import pytest

from serpentail_codegen.functions.catalogue import CATALOGUE
from serpentail_codegen.functions.function import assemble
from serpentail_codegen.functions.tail import Tail
from serpentail_codegen.ir.interpret import Numbers, Run
from serpentail_codegen.passes.batch import batched as widened
from serpentail_codegen.passes.batch import unrolled_step
from serpentail_codegen.passes.directions import directions_in_turn, places_lanes
from serpentail_codegen.targets.c.batch import BATCHED

from ...support.models import model_folder
from .tails import GROUND

TAILS = {"articulated": Tail(2, 2), "continuum": Tail(2, 4, "continuum")}


def tail_of(kind, name):
    """A tail, with points that can touch the ground for the functions of contact."""
    return replace(TAILS[kind], contacts=("feet", "tail", "torso") if name in GROUND else ())


# Programs.


def numbers(program, rng):
    """Random arguments of a program, its parameters positive."""
    parameters = {
        a.name: rng.uniform(0.1, 1, a.length).tolist() for a in program.of_role("parameters")
    }
    return parameters | {
        a.name: rng.normal(size=a.length).tolist() for a in program.of_role("input")
    }


@pytest.mark.parametrize("tail", TAILS)
@pytest.mark.parametrize("name", BATCHED)
def test_a_program_of_many_states_means_each_of_them(tail, name):
    single, rng = assemble(CATALOGUE[name], tail_of(tail, name)), np.random.default_rng(1)
    states = [numbers(single, rng) for _ in range(3)]
    for state in states[1:]:
        state.update({a.name: states[0][a.name] for a in single.of_role("parameters")})
    many = dict(states[0])
    for a in single.of_role("input"):
        many[a.name] = list(np.array([state[a.name] for state in states]).T)
    found = Run(widened(directions_in_turn(single), 3), Numbers(np), many).values
    for k, state in enumerate(states):
        alone = Run(single, Numbers(np), state).values
        for a in single.of_role("output"):
            assert [np.broadcast_to(x, 3)[k] for x in found[a.name]] == alone[a.name]


@pytest.mark.parametrize("tail", TAILS)
@pytest.mark.parametrize("name", BATCHED)
def test_a_program_written_out_means_the_same_and_guards_the_same(tail, name):
    single = assemble(CATALOGUE[name], tail_of(tail, name))
    values = numbers(single, np.random.default_rng(2))
    line = unrolled_step(directions_in_turn(single) if places_lanes(single) else single)
    expected, found = (Run(p, Numbers(np), values) for p in (single, line))
    for a in single.of_role("output"):
        np.testing.assert_allclose(
            np.float64(found.values[a.name]), np.float64(expected.values[a.name]), rtol=1e-12
        )
    pairs = [sorted((status, float(x)) for status, x in run.guards) for run in (found, expected)]
    assert len(pairs[0]) == len(pairs[1])
    for (status, x), (other, y) in zip(*pairs, strict=True):
        assert status == other and x == pytest.approx(y, rel=1e-9)


def test_what_depends_on_parameters_alone_stays_narrow():
    arrays = {
        a.name: a.lanes
        for a in widened(assemble(CATALOGUE["inverse_dynamics"], Tail(2, 2)), 8).arrays
    }
    assert arrays["q"] == arrays["force"] == 8
    assert arrays["link"] == arrays["tail_mass"] == 0


@pytest.mark.parametrize(("segments", "links", "straight"), [(3, 4, True), (8, 16, False)])
def test_batches_stay_straight_for_longer_tails_than_single_states(segments, links, straight):
    folder = model_folder(segments, links, functions=["forward_dynamics"])
    manifest = json.loads((folder / "manifest.json").read_text())
    assert manifest["functions"]["forward_dynamics"]["emission"] in ("lanes", "segments")
    assert ("written_out" in (folder / "src" / f"{folder.name}_batch.c").read_text()) == straight


@pytest.mark.parametrize(("segments", "links", "straight"), [(1, 3, True), (3, 4, False)])
def test_batches_of_derivatives_are_straight_for_short_tails_alone(segments, links, straight):
    folder = model_folder(segments, links, functions=["forward_dynamics_derivatives"])
    source = (folder / "src" / f"{folder.name}_batch_derivatives.c").read_text()
    assert ("written_out" in source) == straight
    assert ("for (int d = 0;" in source) != straight
