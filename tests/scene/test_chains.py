"""Tables [chain.NAME] of scenes: what is read, what is refused, and that scenes survive a trip."""

import numpy as np
import pytest

import serpentail as st
from serpentail.basics.errors import ExportError, ModelError, SimulationError, StateError
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
GIVEN = {"drive": "prescribed"}
BONE = {"name": "knee", "length": "4 cm", "mass": "3 g", "radius": "4 mm"}
SPRUNG = BONE | {"stiffness": 1}, BONE | {"name": "b"}


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
        ("chain.a.kind", "limbs", {"a": PLAIN | {"kind": "limbs"}}),
        ("chain.a.kind", None, {"a": {}}),
        ("chain.a.segments", 1, {"a": PLAIN | {"kind": "limb"}}),
        ("chain.a.joints", [BONE], {"a": PLAIN | {"joints": [BONE]}}),
        ("chain.a.drive", "prescribe", {"a": PLAIN | {"drive": "prescribe"}}),
        ("chain.a.drive", "prescribed", {"a": limb(BONE | GIVEN, BONE | {"name": "b"})}),
        ("chain.a.drive", "prescribed", {"a": limb(*SPRUNG) | GIVEN}),
        ("chain.a.damping", -1, {"a": PLAIN | {"damping": -1}}),
        ("chain.tail", "tail", {"tail": PLAIN}),
        ("chain.torso", "torso", {"torso": PLAIN}),
        ("chain.A", "A", {"A": PLAIN}),
        ("chain.a", 3, {"a": 3}),
        ("chain", 3, 3),
        ("chain.a", "a", {"a": PLAIN | {"pair": True}, "a_left": PLAIN}),
        ("chain.a_stop", "a_stop", {"a": PLAIN, "a_stop": PLAIN}),
        (
            "chain.a_b",
            "a_b",
            {"a": limb(BONE | {"name": "b_c"}), "a_b": limb(BONE | {"name": "c"})},
        ),
        ("chain.a", "a", {"a": limb(BONE, BONE | {"name": "knee_dot"})}),
        ("chain.omega", "omega", {"omega": limb(BONE | {"name": "x"})}),
        ("chain", 121, {f"c{k}": PLAIN | {"segments": 3} for k in range(40)}),
    ):
        with row(place, found):
            assert (place, found) in problems(chain=chain)
    moved = {"chain": {"a": PLAIN | GIVEN}, "functions": ["pfl", "mass_matrix"]}
    assert ("functions", "pfl") in problems(**moved)
    assert (
        len(parse_scene(GECKO | {"chain": {f"c{k}": PLAIN for k in range(40)}}, "x").chains) == 40
    )
    assert parse_scene(GECKO | {"chain": {}}, "x").chains == ()


def limb(*joints, **keys):
    return {"kind": "limb", "mount": [0, 0, 0], "joints": list(joints)} | keys


def without(*keys):
    return {key: x for key, x in BONE.items() if key not in keys}


def test_wrong_limbs_are_refused():
    for field, found, table in (
        ("joints", None, {"kind": "limb", "mount": [0, 0, 0]}),
        ("joints", [], limb()),
        ("joints", 3, limb() | {"joints": 3}),
        ("joints[0]", 3, limb(3)),
        ("joints[0].name", None, limb(without("name"))),
        ("joints[0].name", "Knee", limb(BONE | {"name": "Knee"})),
        ("joints[1].name", "knee", limb(BONE, BONE)),
        ("joints[0].axis", "w", limb(BONE | {"axis": "w"})),
        ("joints[0].axis", 1, limb(BONE | {"axis": 1})),
        ("joints[0].axis", "y", limb({"name": "a", "axis": "y"}, BONE | {"axis": "y"})),
        ("joints[0].drive", "motor", limb(BONE | {"drive": "motor"})),
        ("joints[0].mas", 3, limb(BONE | {"mas": 3})),
        ("joints[0].mass", 0, limb(BONE | {"mass": 0})),
        ("joints[0].mass", "3 m", limb(BONE | {"mass": "3 m"})),
        ("joints[1].mass", None, limb(BONE, {"name": "end"})),
        ("joints[0].length", None, limb(without("length"))),
        ("joints[0].length", 0.04, limb(without("mass"))),
        ("joints[0].length", 0.04, limb(BONE | {"tip": [0, 0, 0]})),
        ("joints[0].inertia", None, limb(without("radius"))),
        ("joints[0].inertia", (1.0, 1.0, 1.0), limb(BONE | {"inertia": [1, 1, 1]})),
        ("joints[0].inertia", [1, 1, 3], limb(without("radius") | {"inertia": [1, 1, 3]})),
        ("joints[0].radius", 0.004, limb(without("length") | {"tip": [0, -1, 0]})),
        ("joints[0].rest", 1.0, limb(BONE | {"rest": 1})),
        ("joints[0].stops", (1.0, -1.0), limb(BONE | {"stops": [1, -1], "stop_stiffness": 1})),
        ("joints[0].stop_stiffness", None, limb(BONE | {"stops": [-1, 1]})),
        ("joints[0].rotor", -1, limb(BONE | {"rotor": -1})),
        ("mount", None, {"kind": "limb", "joints": [BONE]}),
        ("mount_angles", [0, 0], limb(BONE, mount_angles=[0, 0])),
        ("stiffness", 1, limb(BONE, stiffness=1)),
        ("on", "fore", limb(BONE, on="fore")),
    ):
        with row(field, found):
            assert (f"chain.a.{field}", found) in problems(chain={"a": table})


def test_what_a_limb_leaves_out_has_defaults():
    """The COM half way, an ellipsoid of the radius, no spring; only one of two has a damper."""
    two = limb(BONE | {"damping": 2e-4}, BONE | {"name": "b", "stops": "-20, 30 deg"})
    two["joints"][1]["stop_stiffness"] = 1
    p = parse_scene(GECKO | {"chain": {"a": two}}, "x").parameters
    assert p["a_link_lengths"] == (0.04, 0.04)
    assert p["a_link_centers"] == (0.02, 0.02)
    across, along = 3e-3 / 5 * (0.02**2 + 0.004**2), 3e-3 / 5 * 2 * 0.004**2
    assert p["a_link_inertias"] == pytest.approx((across, along, across) * 2, rel=1e-15)
    assert p["a_damping"] == (2e-4, 0)
    assert p["a_stop_lower"] == pytest.approx((-1e6, -0.34906585))
    assert "a_rotors" not in p
    assert "a_link_tips" not in p
    offset = parse_scene(GECKO | {"chain": {"a": limb(BONE | {"center": [1, 0, 0]})}}, "x")
    assert offset.parameters["a_link_tips"] == (0, -0.04, 0)
    changed = {"parameters": {"a_link_masses": "5 g"}}
    assert parse_scene(GECKO | {"chain": {"a": limb(BONE)}} | changed, "x").parameters[
        "a_link_masses"
    ] == pytest.approx(5e-3)


HALF = {"a": limb(BONE | {"drive": "passive", "stiffness": 0.01}, BONE | {"name": "b"})}


@pytest.fixture(scope="module")
def half_driven():
    return st.build("gecko_legs", chain=HALF, targets=["c"])


def test_passive_coordinates_have_no_torques(half_driven):
    assert ("functions", "pfl") in problems(chain=HALF, functions=["pfl"])
    assert "pfl" not in parse_scene(GECKO | {"chain": HALF, "functions": "all"}, "x").functions
    model = half_driven
    assert model.layout.driven == (True, True, False, True)
    assert model.layout["a"].names == ("a_knee", "a_b")
    start = {"t_span": 0.01}
    torques = np.array([1e-4, 0, 0, 2e-4])
    st.simulate(
        model, model.neutral().q, np.zeros(model.nv), **start, controller=lambda *_: torques
    )
    wrong = np.array([0, 0, 1e-4, 0])
    for controller in (lambda *_: wrong, st.Damping(1e-3), st.TorqueTable([0, 1], [wrong, wrong])):
        with row(controller), pytest.raises(SimulationError, match="a_knee"):
            st.simulate(
                model, model.neutral().q, np.zeros(model.nv), **start, controller=controller
            )


def test_passive_coordinates_have_no_actions(half_driven):
    q, v = half_driven.neutral()
    with pytest.raises(StateError, match="a_knee"):
        half_driven.step(q, v, [0, 0, 1, 0], 0.01)
    half_driven.step(q, v, [1e-4, 0, 0, 0], 0.01)
    with pytest.raises(ModelError, match="passive"):
        st.environment(half_driven, "righting")


def test_what_trees_lack_is_refused():
    for place, keys in {
        "contacts": {"contacts": ["feet"]},
        "base": {"base": "fixed"},
        "baked": {"baked": True},
        "identify": {"identify": {"markers": "x.csv"}},
        "functions": {"functions": ["tail_point_jacobians"]},
        "parameters.hind_foo": {"parameters": {"hind_foo": 1}},
    }.items():
        with row(place):
            assert place in [field for field, _ in problems(**keys)]
    model = zoo.model("tree")
    for kind, words in {"urdf": "continuum", "mjcf": "continuum", "fmu": "leg_right"}.items():
        with row(kind), pytest.raises(ExportError, match=words):
            st.export(model, kind)


def test_a_scene_with_chains_survives_a_trip():
    for name, scene in {
        "gecko": load_scene(SCENES / "gecko_legs.toml"),
        "larger": parse_scene(GECKO | {"body": {"scale": 2.0}}, "larger"),
        "tree": zoo.scene("tree"),
        "limbs": zoo.scene("limbs"),
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
