"""Tables [chain.NAME] of scenes: what is read, what is refused, and that scenes survive a trip."""

import pytest

import serpentail as st
from serpentail.basics.errors import ExportError
from serpentail_codegen.scene.parse import load_scene, parse_scene, scene_to_dict
from serpentail_codegen.scene.problems import SceneError
from serpentail_scene.source import tables_of
from tests.support import zoo
from tests.support.rows import row
from tests.support.scenes import SCENES

GECKO = tables_of(SCENES / "gecko_legs.toml")
LEG = GECKO["chain"]["hind"]
PLAIN = {"kind": "articulated", "segments": 1, "links": 1, "mount": [0, 0, 0]}
PLAIN |= {"mass": "1 g", "length": "2 cm"}


def problems(**keys):
    with pytest.raises(SceneError) as refused:
        parse_scene(GECKO | keys, "gecko")
    return [(problem.field, problem.value) for problem in refused.value.problems]


def test_wrong_chains_are_refused():
    for place, found, chain in (
        ("chain.hind.on", "fore", {"hind": LEG | {"on": "fore"}}),
        ("chain.hind.on", 3, {"hind": LEG | {"on": 3}}),
        ("chain.hind.pair", 1, {"hind": LEG | {"pair": 1}}),
        ("chain.hind.mas", 3, {"hind": LEG | {"mas": 3}}),
        ("chain.hind.mount", None, {"hind": {k: x for k, x in LEG.items() if k != "mount"}}),
        ("chain.a.mass", None, {"a": {k: x for k, x in PLAIN.items() if k != "mass"}}),
        ("chain.a.mass", -1, {"a": PLAIN | {"mass": -1}}),
        ("chain.a.length", "3 kg", {"a": PLAIN | {"length": "3 kg"}}),
        ("chain.a.kind", "limb", {"a": PLAIN | {"kind": "limb"}}),
        ("chain.a.damping", -1, {"a": PLAIN | {"damping": -1}}),
        ("chain.tail", "tail", {"tail": PLAIN}),
        ("chain.torso", "torso", {"torso": PLAIN}),
        ("chain.A", "A", {"A": PLAIN}),
        ("chain.a", 3, {"a": 3}),
        ("chain", 3, 3),
        ("chain.a", "a", {"a": PLAIN | {"pair": True}, "a_left": PLAIN}),
        ("chain.a_stop", "a_stop", {"a": PLAIN, "a_stop": PLAIN}),
        ("chain", 121, {f"c{k}": PLAIN | {"segments": 3} for k in range(40)}),
    ):
        with row(place, found):
            assert (place, found) in problems(chain=chain)
    assert (
        len(parse_scene(GECKO | {"chain": {f"c{k}": PLAIN for k in range(40)}}, "x").chains) == 40
    )
    assert parse_scene(GECKO | {"chain": {}}, "x").chains == ()


def test_what_trees_lack_is_refused():
    for place, keys in {
        "contacts": {"contacts": ["feet"]},
        "base": {"base": "fixed"},
        "baked": {"baked": True},
        "plan": {"plan": {"duration": 1.0}},
        "identify": {"identify": {"markers": "x.csv"}},
        "functions": {"functions": ["airborne_rates"]},
        "parameters.hind_foo": {"parameters": {"hind_foo": 1}},
    }.items():
        with row(place):
            assert place in [field for field, _ in problems(**keys)]
    model = zoo.model("tree")
    for kind in ("urdf", "mjcf", "fmu"):
        with row(kind), pytest.raises(ExportError, match="leg_right"):
            st.export(model, kind)


def test_a_scene_with_chains_survives_a_trip():
    for name, scene in {
        "gecko": load_scene(SCENES / "gecko_legs.toml"),
        "larger": parse_scene(GECKO | {"body": {"scale": 2.0}}, "larger"),
        "tree": zoo.scene("tree"),
        "changed": parse_scene(GECKO | {"parameters": {"hind_mount": [0, 0.01, 0]}}, "changed"),
    }.items():
        with row(name):
            assert parse_scene(scene_to_dict(scene), scene.name) == scene


def test_a_body_scales_all_chains():
    p = parse_scene(GECKO | {"body": {"mass": "10 g"}}, "ten").parameters
    legs = 2 * (p["hind_link_masses"] + p["fore_link_masses"])
    assert p["torso_mass"] + sum(p["link_masses"]) + legs == pytest.approx(0.01, rel=1e-12)
    larger = parse_scene(GECKO | {"body": {"scale": 2.0}}, "larger").parameters
    assert larger["hind_mount"] == pytest.approx((8.4e-3, -0.04, 0))


def test_models_know_their_chains():
    model = zoo.model("tree")
    left, names = model.layout["leg_left"], model.names
    assert (left.q, left.v, left.tau) == (slice(13, 15), slice(12, 14), slice(6, 8))
    assert left.names == ("leg_left_alpha_1", "leg_left_beta_1")
    assert model.coordinates[left.q] == [*left.names]
    assert names.tail[10:] == ("third_alpha_1", "third_beta_1")
    assert model.state(height=1)["second_a_1"] == 0
    with pytest.raises(KeyError, match="leg_left"):
        model.layout["leg_lef"]
    heavier = model.with_parameters(third_mass="2 g")
    q = model.neutral().q
    assert heavier.mass_matrix(q)[0, 0] - model.mass_matrix(q)[0, 0] == pytest.approx(1e-3)
    assert heavier.parameters["third_link_inertia"][0] > model.parameters["third_link_inertia"][0]
