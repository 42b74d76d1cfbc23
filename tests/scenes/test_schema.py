"""The JSON Schema of scene files accepts what the two packages accept, and refuses slips."""

import copy
import json
import tomllib
from functools import cache
from pathlib import Path

import pytest
from jsonschema import Draft7Validator

from serpentail import cli
from serpentail.errors import SerpentailError
from serpentail.scenes.plan import plan_arguments
from serpentail_codegen.scene.parameters import PARAMETERS
from serpentail_codegen.scene.parse import parse_scene
from serpentail_codegen.scene.passive import PASSIVE
from serpentail_codegen.scene.problems import SceneError
from tests.scenes.test_random_tables import GENERATE, PLAN, SIMULATE

SCENES = sorted((Path(__file__).parents[2] / "scenes").glob("*.toml"))


@pytest.fixture
def printed(capsys):
    assert cli.main(["schema"]) == 0
    out, err = capsys.readouterr()
    assert not err
    return out


@cache
def _validator(text):
    schema = json.loads(text)
    Draft7Validator.check_schema(schema)
    return Draft7Validator(schema)


@pytest.fixture
def valid(printed):
    """Return a function that tells if a table is a scene."""
    return _validator(printed).is_valid


@pytest.mark.parametrize("path", SCENES, ids=lambda path: path.stem)
def test_every_scene_is_valid(valid, path):
    assert valid(tomllib.loads(path.read_text()))


def test_json_is_the_same_schema(printed, capsys):
    assert cli.main(["schema", "--json", "-"]) == 0
    out = capsys.readouterr().out
    assert out.count("\n") == 1 and json.loads(out) == json.loads(printed)


LINK = {"links": 2, "length": "1 cm", "mass": 0.001}


@pytest.mark.parametrize(
    ("keys", "sound"),
    [
        ({"segments": [LINK, LINK | {"link_radius": "1 mm"}]}, True),
        ({"segments": [{"links": 2}], "taper": {"radii": "4, 1 mm", "density": 1000}}, True),
        ({"segments": 1, "links": 2, "parameters": {"link_masses": "1, 2 g"}}, True),
        ({"segments": 1, "links": 1, "parameters": {"link_inertias": [[1, 1, 1]]}}, True),
        ({"segments": 1, "links": 1, "base": "fixed", "weightless": True}, True),
        ({"segments": 1}, False),
        ({"segments": [LINK | {"mass": 0}]}, False),
        ({"segments": [LINK | {"colour": 1}]}, False),
        ({"segments": [LINK | {"radii": [0.1]}]}, False),
        ({"segments": [LINK], "taper": {"density": 1000}}, False),
        ({"segments": 1, "links": 2, "parameters": {"link_masses": 1}}, False),
        ({"segments": 1, "links": 2, "base": "floating"}, False),
    ],
)
def test_segments_of_their_own(valid, keys, sound):
    assert valid({"kind": "articulated", **keys}) is sound


def with_value(path, value):
    """Return a whole scene with another value at a path such as "simulate.legs.gamma"."""
    table = copy.deepcopy(GENERATE | {"simulate": SIMULATE, "plan": PLAN})
    *parents, last = (int(name) if name.isdigit() else name for name in path.split("."))
    part = table
    for name in parents:
        part = part.setdefault(name, {}) if isinstance(name, str) else part[name]
    part[last] = value
    return table


GOOD = [
    ("functions", "all"),
    ("targets", ["c"]),
    ("parameters.torso_mass", "105.7 g"),
    ("parameters.tail_mount", [0, "-40.5 mm", "0.45 cm"]),
    ("parameters.torso_semi_axes", "31.5, 49.5, 27 mm"),
    ("parameters.torso_inertia", "700, 700, 700 g cm^2"),
    ("parameters.delta_m", "-30 deg"),
    ("simulate.duration", "20 ms"),
    ("simulate.start.velocity", ["1 cm/s", 0, "3.6 km/h"]),
    ("simulate.legs.gamma", ["210 deg", 3.6]),
    ("simulate.legs.moves.0.rate", "4000 deg/s"),
    ("simulate.controller", [{"begin": 0, "kind": "none"}, {"begin": "1 s", "kind": "damping"}]),
    ("simulate.controller", {"kind": "pfl", "kp": "4e4 1/s^2", "feedforward": False}),
    ("simulate.start.settle", {"rounds": 2, "duration": 0.1}),
    ("plan.goal", "upright"),
    ("plan.goal.attitude", [1, 0, 0, 0]),
    ("plan.goal.tail", ["free", "10 deg"]),
    ("plan.tolerance", "free"),
    ("plan.duration", ["300 ms", 0.58]),
    ("plan.bounds.torque", "20 mN m"),
    ("plan.options", {"ipopt.max_iter": 100}),
    ("plan.intervals", 20),
    ("plan.design", {"tail_length": ["8 cm", 0.25]}),
    ("plan.free_start", {"tail": ["-20 deg", 0.5], "torso_rate": [[0, 0, 0], [1, 1, 2]]}),
]
BAD = [
    ("segmnts", 3),
    ("kind", "snake"),
    ("segments", 0),
    ("links", "3"),
    ("samples", 3),  # of an articulated tail
    ("name", "Rat"),
    ("name", "math"),
    ("functions", ["mass_matrx"]),
    ("contacts", ["feet", "feet"]),
    ("targets", []),
    ("baked", "true"),
    ("coordinates", "bend"),
    ("parameters.tail_mas", 1),
    ("parameters.torso_mass", 0),
    ("parameters.torso_mass", "105.7"),
    ("parameters.torso_mass", "217 deg"),
    ("parameters.tail_mount", [0, 0]),
    ("parameters.tail_mount", "1, 2 mm"),
    ("parameters.mu", "1 m"),
    ("simulate.duratoin", 1),
    ("simulate.duration", "3 m"),
    ("simulate.method", "euler"),
    ("simulate.start.heigth", 1),
    ("simulate.start.pitch", "20 mm"),
    ("simulate.legs.moves.0.dleta", 1),
    ("simulate.controller.kind", "pdf"),
    ("simulate.controller.kp", 1),  # of kind "damping"
    ("simulate.reference.blend", "cubic"),
    ("plan.path", []),
    ("plan.start", {"q": [0]}),
    ("plan.goal", "upwright"),
    ("plan.goal.tale", 1),
    ("plan.free_start.tale", [0, 1]),
    ("plan.free_start.tail", ["0 m", 1]),
    ("plan.bounds.angle", "3 s"),
    ("plan.intervals", 0),
    ("plan.rule", "radaw"),
    ("plan.track", "yes"),
    ("plan.solver", "../x"),
]


@pytest.mark.parametrize(("path", "value"), GOOD, ids=[f"{p} {v}" for p, v in GOOD])
def test_what_is_right_is_valid(valid, path, value):
    """The packages take it too."""
    table = with_value(path, value) | {"contacts": ["feet", "torso"]}
    assert valid(table)
    parse_scene(table, "x")
    plan_arguments(table["plan"])


@pytest.mark.parametrize(("path", "value"), BAD, ids=[f"{p} {v}" for p, v in BAD])
def test_what_is_wrong_is_not_valid(valid, path, value):
    """The packages refuse it too: what needs a model, in tests of their own."""
    table = with_value(path, value)
    assert valid(with_value("segments", 2)) and not valid(table)
    if path.startswith(("simulate", "plan.intervals", "plan.rule", "plan.track")):
        return
    with pytest.raises((SceneError, SerpentailError)):
        parse_scene(table, "x")
        plan_arguments(table["plan"])


@pytest.mark.parametrize("key", ["kind", "segments", "links"])
def test_what_is_missing_is_not_valid(valid, key):
    table = with_value("segments", 2)
    del table[key]
    assert not valid(table)


def test_a_wrong_goal_is_told_both_forms():
    """A word where a table belongs names both."""
    with pytest.raises(SerpentailError, match=r"needs a table, under .*, or 'upright'$"):
        plan_arguments(with_value("plan.goal", "upwright")["plan"])


def test_editors_show_what_each_parameter_is(printed):
    shown = json.loads(printed)["properties"]["parameters"]["properties"]
    assert set(shown) == {p.name for p in (*PARAMETERS, *PASSIVE)}
    for p in (*PARAMETERS, *PASSIVE):
        assert shown[p.name]["description"] == f"{p.meaning} ({p.unit})"
