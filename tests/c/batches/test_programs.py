"""Programs over lanes of states mean what they mean of each state, in loops and written out."""

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
from tests.support import zoo
from tests.support.models import folder_of
from tests.support.rows import row

from .tails import GROUND

TAILS = {"articulated": Tail(2, 2), "continuum": Tail(2, 4, "continuum")}


def numbers(program, rng):
    """Random arguments of a program, its parameters positive."""
    parameters = {
        a.name: rng.uniform(0.1, 1, a.length).tolist() for a in program.of_role("parameters")
    }
    return parameters | {
        a.name: rng.normal(size=a.length).tolist() for a in program.of_role("input")
    }


def assert_means_each_of_many_states(single, rng):
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
            assert [np.broadcast_to(x, 3)[k] for x in found[a.name]] == alone[a.name], a.name


def assert_means_the_same_written_out(single, rng):
    """And guards the same."""
    values = numbers(single, rng)
    line = unrolled_step(directions_in_turn(single) if places_lanes(single) else single)
    found, expected = (Run(program, Numbers(np), values) for program in (line, single))
    for a in single.of_role("output"):
        pair = (np.float64(run.values[a.name]) for run in (found, expected))
        np.testing.assert_allclose(*pair, rtol=1e-12, err_msg=a.name)
    guards = [sorted((status, float(x)) for status, x in run.guards) for run in (found, expected)]
    assert [status for status, _ in guards[0]] == [status for status, _ in guards[1]]
    np.testing.assert_allclose(*([x for _, x in some] for some in guards), rtol=1e-9)


@pytest.mark.parametrize("tail", ["articulated", pytest.param("continuum", marks=pytest.mark.slow)])
def test_programs_of_lanes_mean_the_same(tail):
    for name in BATCHED:
        contacts = ("feet", "tail", "torso") if name in GROUND else ()
        single = assemble(CATALOGUE[name], replace(TAILS[tail], contacts=contacts))
        with row(name):
            assert_means_each_of_many_states(single, np.random.default_rng(1))
            assert_means_the_same_written_out(single, np.random.default_rng(2))


def test_what_depends_on_parameters_alone_stays_narrow():
    arrays = {
        a.name: a.lanes
        for a in widened(assemble(CATALOGUE["inverse_dynamics"], Tail(2, 2)), 8).arrays
    }
    assert arrays["q"] == arrays["force"] == 8
    assert arrays["link"] == arrays["tail_mass"] == 0


def test_batches_stay_straight_for_longer_tails_than_single_states():
    """Sizes are the point: batches of derivatives are straight for short tails alone."""
    sizes = [("forward_dynamics", "batch", (3, 4), (8, 16))]
    sizes += [("forward_dynamics_derivatives", "batch_derivatives", (1, 3), (3, 4))]
    for name, part, *both in sizes:
        for straight, (segments, links) in zip((True, False), both, strict=True):
            changes = {"segments": segments, "links": links, "functions": [name]}
            folder = folder_of(zoo.scene("bare", **changes))
            manifest = json.loads((folder / "manifest.json").read_text())
            source = (folder / "src" / f"bare_{part}.c").read_text()
            with row(name, segments, links):
                assert ("written_out" in source) == straight
                if name == "forward_dynamics":
                    assert manifest["functions"][name]["emission"] in ("lanes", "segments")
                else:
                    assert ("for (int d = 0;" in source) != straight
