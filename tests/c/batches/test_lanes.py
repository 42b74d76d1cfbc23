"""States side by side give what each of them gives alone, in any number, pressing on the ground or
not; programs over lanes of states mean the same, in loops and written out.
"""

import json
from dataclasses import replace
from functools import cache, partial

import numpy as np
import pytest
from hypothesis import given as drawn
from hypothesis import settings
from hypothesis import strategies as st

import serpentail
from serpentail.model.kernel import ArgumentRecord
from serpentail.model.library import NOT_FINITE
from serpentail_codegen.functions.catalogue import CATALOGUE
from serpentail_codegen.functions.function import assemble
from serpentail_codegen.functions.tail import Tail
from serpentail_codegen.ir.cost import executed
from serpentail_codegen.ir.interpret import Numbers, Run
from serpentail_codegen.passes.batch import batched as widened
from serpentail_codegen.passes.batch import unrolled_step
from serpentail_codegen.passes.narrow_directions import directions_in_turn, places_lanes
from serpentail_codegen.targets.c.batch import BATCHED, STATES, of_one_state
from tests.support import zoo
from tests.support.models import folder_of
from tests.support.rows import row

from .tails import GROUND, TOUCHING, alone, batched, evaluated, given, in_lanes, on_ground, states

FREE = ("m2_n2", "fixed")
FREE_SLOW = ("straight", "loops", "segments", "single", "arcs1", "arcs2_loops", "arcs2", "mixed")
FREE_SLOW += ("baked",)
STANDING = ("ground_m2_n2", "small")
STANDING_SLOW = ("ground_arcs", "single_ground", "ground_mixed", "feet", "feet_tail", "smooth")
STANDING_SLOW += ("paper",)


# largest differences by rounding, in units of the last digit of each number's largest value; or one
# unit of that of all numbers, of whose sums a small one may be the rest
LIMITS = {"mixed": 2e4}  # H has a condition number of 2e7, because a segment weighs 0.2 g


def slow(*names):
    """Cases of slow tests."""
    return [pytest.param(name, marks=pytest.mark.slow) for name in names]


def values_of(model, count):
    """States of a model, a third of them with all points on the ground, some, or none."""
    values = states(model, count)
    if not model.contacts:
        return values
    touching = on_ground(model, (TOUCHING * count)[:count])
    for k in range(6):
        arguments = given(model, touching, "contact_dynamics", k)
        forces = model.kernel("contact_dynamics")(*arguments)[2]
        assert TOUCHING[k % 3] == "some" or forces[:, 2].any() == (TOUCHING[k % 3] == "all")
    # what the others move with is at random, their poses are above the ground
    return values | touching


@pytest.mark.parametrize("name", [*FREE, *slow(*FREE_SLOW), *STANDING, *slow(*STANDING_SLOW)])
def test_any_number_of_states_gives_what_each_gives_alone(name, monkeypatch):
    model = serpentail.load(zoo.folder(name))  # its own: later calls would be in lanes
    values, lanes = values_of(model, 37), STATES[model.manifest["real"]]
    own = GROUND if model.contacts else batched(model)
    for function in [name for name in batched(model) if name in own]:
        expected = alone(model, function, values)
        scale, digits = np.abs(expected).max(axis=0), np.finfo(expected.dtype).eps
        for count in (1, 7, lanes, lanes + 5, len(expected)):
            arrays = given(model, values, function, slice(count))
            with row(function, count), monkeypatch.context() as patch:
                if count >= lanes:
                    in_lanes(patch)
                out = evaluated(model, function, arrays)
                assert out.dtype == expected.dtype and np.isfinite(out).all()
                allowed = digits * np.maximum(LIMITS.get(name, 3e3) * scale, np.abs(expected).max())
                assert (np.abs(out - expected[:count]) <= allowed).all()


def test_states_whose_lanes_fail_are_evaluated_again_one_by_one(monkeypatch):
    """As if the lanes of the second group of states failed, and none of them alone."""
    monkeypatch.setattr("serpentail.model.library.MIN_BATCH", 1)
    model, failures = serpentail.load(zoo.folder("m1_n1")), []
    q, lanes = states(model, 37)["q"], model.batch_library.states
    function = model.batch_library.entry("mass_matrix", 37)

    def failing(address):
        record = ArgumentRecord.from_address(address)
        if failures:
            return function(address)
        record.count, record.failed = lanes, lanes
        failures.append(function(address))
        return NOT_FINITE

    monkeypatch.setattr(model.batch_library, "entry", lambda name, count: failing)
    monkeypatch.setattr(model.batch_library, "threads", 1)
    expected = [model.mass_matrix(one) for one in q]
    np.testing.assert_allclose(model.mass_matrix(q), expected, rtol=1e-12, atol=1e-18)
    assert failures == [0]


@pytest.mark.parametrize("name", ["ground_m1_n1", *slow("arcs1", "loops", "ground_arcs")])
def test_the_reproducible_profile_gives_the_same_bits(name, monkeypatch):
    model = serpentail.load(zoo.folder(name), profile="reproducible")
    values = values_of(model, 11)
    in_lanes(monkeypatch)
    for function in batched(model):
        with row(function):
            together = evaluated(model, function, given(model, values, function))
            np.testing.assert_array_equal(together, alone(model, function, values))


standing = cache(lambda: serpentail.load(zoo.folder("ground_m2_n2")))  # only this file has it


@settings(deadline=None, max_examples=40)
@drawn(
    touching=st.lists(st.sampled_from(TOUCHING), min_size=8, max_size=17),
    seed=st.integers(0, 2**32 - 1),
)
def test_forces_are_those_of_the_law_in_any_mixture(touching, seed):
    """Eq. 36 and Coulomb's cone, from the places and velocities of the points alone."""
    model = standing()
    values, p = on_ground(model, touching, seed), model.parameters
    with pytest.MonkeyPatch.context() as patch:
        in_lanes(patch)
        places, moves = model.contact_points(values["q"], values["v"], values["legs"])
        arguments = (values[name] for name in ("q", "v", "tau", "bristles", "legs"))
        _, rates, forces = model.contact_dynamics(*arguments)
    depth = np.maximum(-places[..., 2], 0)
    normal = p["K_n"] * np.sqrt(depth) * np.maximum(depth - p["D_n"] * moves[..., 2], 0)
    np.testing.assert_allclose(forces[..., 2], normal, rtol=1e-9, atol=1e-12)
    bristles = values["bristles"].reshape(*depth.shape, 2)
    trial = -p["K_f"] * (bristles + p["D_f"] * moves[..., :2])
    size, bound = np.linalg.norm(trial, axis=-1), p["mu"] * normal
    friction = trial * np.where(size > bound, bound / size, 1)[..., None]
    np.testing.assert_allclose(forces[..., :2], friction, rtol=1e-7, atol=1e-12)
    relaxing = -(friction + p["K_f"] * bristles) / (p["D_f"] * p["K_f"])
    found_rates = rates.reshape(*depth.shape, 2)
    np.testing.assert_allclose(found_rates, relaxing, rtol=1e-7, atol=1e-12)


# Programs over lanes of states

TAILS = {"articulated": Tail(2, 2), "continuum": Tail(2, 4, "continuum")}


def numbers(program, rng):
    """Random arguments of a program, its parameters positive."""
    ranges = {"parameters": partial(rng.uniform, 0.1, 1), "input": rng.normal}
    arrays = [(a, role) for role in ranges for a in program.of_role(role)]
    return {a.name: ranges[role](size=a.length).tolist() for a, role in arrays}


def assert_means_each_of_many_states(single, rng):
    several = [numbers(single, rng) for _ in range(3)]
    for state in several[1:]:
        state.update({a.name: several[0][a.name] for a in single.of_role("parameters")})
    many = dict(several[0])
    for a in single.of_role("input"):
        many[a.name] = list(np.array([state[a.name] for state in several]).T)
    found = Run(widened(directions_in_turn(single), 3), Numbers(np), many).values
    for k, state in enumerate(several):
        each = Run(single, Numbers(np), state).values
        for a in single.of_role("output"):
            assert [np.broadcast_to(x, 3)[k] for x in found[a.name]] == each[a.name], a.name


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
    """Sizes are the point: those of derivatives are straight for short tails, unless a scene asks
    for loops.
    """
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
    loops = folder_of(zoo.scene("bare", emission="loops", functions=[name]))
    assert "for (int d = 0;" in (loops / "src" / f"bare_{part}.c").read_text()


def test_long_tails_go_by_segments_where_that_is_less_work():
    """Sizes are the point: H of many segments costs more than articulated bodies do."""
    function = CATALOGUE["forward_dynamics"]
    for segments, links, swept in ((3, 4, False), (8, 16, False), (24, 2, True)):
        scene, tail = zoo.scene("bare", segments=segments, links=links), Tail(segments, links)
        chosen = of_one_state(scene, tail, function)
        with row(segments, links):
            assert (chosen != assemble(function, tail)) == swept
            assert executed(chosen) <= executed(assemble(function, tail))
