"""What a scene file becomes: defaults, order of functions, names, round trips."""

import json
import pickle

import pytest

from serpentail_codegen.scene.parameters import PARAMETERS
from serpentail_codegen.scene.parse import load_scene, parse_scene, scene_for, scene_to_dict
from serpentail_codegen.scene.problems import SceneError
from serpentail_codegen.scene.resolve import resolve_parameters
from serpentail_codegen.scene.scene import KEYS, ONLY, Scene
from serpentail_codegen.scene.signatures.table import DEFAULT
from tests.support.scenes import SCENES, VALID


def test_defaults_of_the_other_keys(read):
    scene = read(VALID)
    assert scene == Scene("rat", "articulated", 2, 3, DEFAULT, resolve_parameters({}, 6))
    assert (scene.coordinates, scene.baked, scene.real, scene.emission) == (
        "joint",
        False,
        "double",
        "auto",
    )
    assert scene.profile == "fast"


def test_functions_come_in_canonical_order(read):
    assert read('functions = ["energy", "mass_matrix"]\n' + VALID).functions == (
        "mass_matrix",
        "energy",
    )


def test_name_is_the_file_stem_or_the_name_given(read):
    assert read(VALID).name == "rat"
    assert read('name = "kick_2"\n' + VALID).name == "kick_2"


def test_scene_for_make_model():
    scene = scene_for(
        "articulated", 3, 4, baked=True, functions=["energy"], parameters={"gravity": 0}
    )
    assert (scene.name, scene.segments, scene.links) == ("articulated_m3_n4", 3, 4)
    assert (scene.baked, scene.functions, scene.parameters["gravity"]) == (True, ("energy",), 0.0)
    words = r"needs \"articulated\" or \"continuum\" or \"mixed\"$"
    with pytest.raises(SceneError, match=rf"^kind: value 'Elastic-2': {words}"):
        scene_for("Elastic-2", 3, 4)


def test_scenes_are_frozen_and_hashable():
    scene, same = scene_for("articulated", 3, 4), scene_for("articulated", 3, 4)
    assert len({scene, same, scene_for("articulated", 4, 3)}) == 2
    with pytest.raises(AttributeError):
        scene.links = 5
    with pytest.raises(TypeError):
        scene.parameters["gravity"] = 0


@pytest.mark.parametrize(
    "parameters", [{"tail_mass": 0.1 + 0.2}, {"link_inertia": [1e-8 / 3, 2e-10, 1]}, {}]
)
def test_round_trip_is_exact(parameters):
    scene = scene_for("articulated", 2, 7, real="float", emission="loops", parameters=parameters)
    table = json.loads(json.dumps(scene_to_dict(scene), allow_nan=False))
    assert parse_scene(table, "another") == scene
    assert scene_to_dict(parse_scene(table, "another")) == table
    assert pickle.loads(pickle.dumps(scene)) == scene


@pytest.mark.parametrize(("segments", "links"), [(1, 3), (3, 4)])
def test_the_paper_rats(segments, links):
    scene = load_scene(SCENES / f"kangaroo_rat_m{segments}_n{links}.toml")
    assert (scene.segments, scene.links) == (segments, links)
    assert scene.name == f"kangaroo_rat_m{segments}_n{links}"
    assert scene.functions == DEFAULT
    assert scene.parameters == resolve_parameters({}, scene.segments * scene.links)


def test_the_full_scene_file_shows_every_key():
    text = "".join(
        (SCENES / f"{name}.toml").read_text()
        for name in ("kangaroo_rat_m1_n3", "contact_m1_n3", "tapered_tail")
    )
    tables = {
        "name",
        "parameters",
        "plan",
        "simulate",
        "identify",
        "phase",
        "sweep",
        "taper",
        "body",
    }
    words = [
        *(set(KEYS) - {*tables, *ONLY["continuum"].keys}),
        *(p.name for p in PARAMETERS),
    ]
    assert [word for word in words if f"{word} =" not in text] == []


@pytest.mark.parametrize("name", ["plan", "simulate", "identify"])
def test_tables_of_motions_are_left_to_the_runtime(refuse, name):
    alone = {"kind": "articulated", "segments": 1, "links": 3}
    assert parse_scene(alone | {name: {"anything": 1}}, "rat") == parse_scene(alone, "rat")
    wrong = refuse(f'kind = "articulated"\nsegments = 1\nlinks = 1\n{name} = 3\n')
    assert f"under a line [{name}]" in str(wrong[name])
    assert (SCENES / "righting_m1_n3.toml").is_file() and load_scene(
        SCENES / "righting_m1_n3.toml"
    ).links == 3


def test_tables_of_phases_are_left_to_the_runtime(refuse):
    alone = {"kind": "articulated", "segments": 1, "links": 3}
    assert parse_scene(alone | {"phase": [{"anything": 1}]}, "rat") == parse_scene(alone, "rat")
    for value in ("3", "[3]", "{name = 1}"):
        wrong = refuse(f'kind = "articulated"\nsegments = 1\nlinks = 1\nphase = {value}\n')
        assert "under lines [[phase]]" in str(wrong["phase"])
