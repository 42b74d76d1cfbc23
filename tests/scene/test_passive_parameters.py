"""Springs, damping and stops of a tail: which a scene has, and values that are refused."""

import json
from math import pi

import jsonschema
import pytest

from serpentail_codegen.pipeline import tail_of
from serpentail_codegen.scene.parse import parse_scene, scene_to_dict
from serpentail_codegen.scene.passive import PASSIVE, PASSIVE_NAMES
from serpentail_codegen.scene.schema import scene_schema
from tests.support.scenes import VALID

STOPS = "tail_stop_lower = -1\ntail_stop_upper = 1\ntail_stop_stiffness = 0.1\n"
# of each part enough to be there
NEEDED = {
    "spring": "tail_stiffness = 0.01\n",
    "damping": "tail_damping = 1e-4\n",
    "stops": STOPS,
}


def with_parameters(lines):
    """A scene of two segments with some lines of parameters."""
    return VALID + "[parameters]\n" + lines


def test_a_scene_has_no_passive_tail_unless_it_asks_for_one(read):
    scene = read(VALID)
    assert scene.passive == () == tail_of(scene).passive
    assert not set(scene.parameters) & set(PASSIVE_NAMES)


@pytest.mark.parametrize("part", NEEDED)
def test_a_parameter_brings_its_part_alone(read, part):
    scene = read(with_parameters(NEEDED[part]))
    assert scene.passive == (part,) == tail_of(scene).passive
    own = {p.name for p in PASSIVE if p.needs == part}
    assert set(scene.parameters) & set(PASSIVE_NAMES) == own


def test_one_number_stands_for_all_coordinates(read):
    parameters = read(with_parameters('tail_stiffness = "20 mN m/rad"\n' + STOPS)).parameters
    assert parameters["tail_stiffness"] == (0.02,) * 4
    assert parameters["tail_rest"] == (0.0,) * 4
    assert parameters["tail_stop_width"] == (0.1,) * 4


def test_each_coordinate_may_have_its_own_with_units(read):
    lines = 'tail_stiffness = [0.02, "30 mN m/rad", 0, 0.01]\ntail_rest = "0, 30, 0, -90 deg"\n'
    parameters = read(with_parameters(lines)).parameters
    assert parameters["tail_stiffness"] == (0.02, 0.03, 0.0, 0.01)
    assert parameters["tail_rest"] == pytest.approx((0, pi / 6, 0, -pi / 2), rel=1e-15)


@pytest.mark.parametrize("part", NEEDED)
def test_a_scene_of_a_passive_tail_is_read_again(read, part):
    scene = read(with_parameters(NEEDED[part]))
    assert parse_scene(json.loads(json.dumps(scene_to_dict(scene))), "other") == scene


@pytest.mark.parametrize(
    ("name", "value"),
    [
        *(
            (p.name, value)
            for p in PASSIVE
            for value in ("nan", "inf", "true", '"3"', "[]", "[1, 2, 3]", "[1, 2, 3, 4, 5]", "{}")
        ),
        *((name, "-1e-9") for name in ("tail_stiffness", "tail_damping")),
        *((name, value) for name in ("tail_stop_stiffness", "tail_stop_width") for value in "0-"),
        ("tail_stiffness", "[1, 1, -1, 1]"),
        ("tail_stiffness", '"3 N m"'),
        ("tail_damping", '"3 N m/rad"'),
    ],
)
def test_values_that_cannot_be_are_refused(refuse, name, value):
    value = "-1" if value == "-" else value
    part = next(p for p in PASSIVE if p.name == name).needs
    kept = [line for line in NEEDED[part].splitlines() if not line.startswith(f"{name} ")]
    problems = refuse(with_parameters("\n".join([f"{name} = {value}", *kept])))
    assert set(problems) == {f"parameters.{name}"}
    assert next(p.unit for p in PASSIVE if p.name == name) in problems[f"parameters.{name}"].remedy


def test_of_wrong_lengths_the_right_one_is_told(refuse):
    problems = refuse(with_parameters("tail_stiffness = [1, 1]"))
    assert (
        "an array of 4 finite numbers or one for all"
        in problems["parameters.tail_stiffness"].remedy
    )


def test_a_rest_needs_a_stiffness(refuse):
    problems = refuse(with_parameters("tail_rest = 0.1"))
    assert set(problems) == {"parameters.tail_stiffness"}
    assert "tail_rest needs it" in problems["parameters.tail_stiffness"].remedy


def test_stops_need_both_ends_and_a_stiffness(refuse):
    problems = refuse(with_parameters("tail_stop_lower = -1"))
    names = ("tail_stop_upper", "tail_stop_stiffness")
    assert set(problems) == {f"parameters.{name}" for name in names}


def test_stops_that_exclude_each_other_are_refused(refuse):
    lines = "tail_stop_lower = [-1, 1, 0.5, -1]\ntail_stop_upper = [1, 1, 0.4, 1]\n"
    problems = refuse(with_parameters(lines + "tail_stop_stiffness = 0.1"))
    assert set(problems) == {f"parameters.tail_stop_lower[{k}]" for k in (1, 2)}
    assert "below tail_stop_upper[2] = 0.4" in problems["parameters.tail_stop_lower[2]"].remedy


def test_polar_coordinates_have_no_passive_tail(refuse):
    text = 'kind = "continuum"\nsegments = 1\ncoordinates = "polar"\n[parameters]\n'
    assert set(refuse(text + "tail_damping = 1e-3")) == {"parameters.tail_damping"}


def test_the_schema_has_the_passive_tail():
    schema = scene_schema()
    table = {"kind": "continuum", "segments": 2}
    for value in (0.1, "0.1 N m/rad", [0.1, "0.1 N m/rad", 0, 0]):
        jsonschema.validate(table | {"parameters": {"tail_stiffness": value}}, schema)
    for value in (-0.1, "0.1 N m", [0.1, -1.0], [0.1]):
        with pytest.raises(jsonschema.ValidationError):
            jsonschema.validate(table | {"parameters": {"tail_stiffness": value}}, schema)
