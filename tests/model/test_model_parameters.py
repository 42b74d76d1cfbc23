"""Parameters: what a caller gives reaches the model as it would from a scene, or is refused with
what to do.
"""

import json

import numpy as np
import pytest

import serpentail as st
from serpentail.model.parameters import RunParameters, ellipsoid, flat, resolve
from serpentail_codegen.scene.parameters import PARAMETERS
from serpentail_codegen.scene.resolve import resolve_parameters
from serpentail_codegen.scene.shape import EQUAL
from tests.support.models import model_folder

SEGMENTS, LINKS = 2, 3
INERTIA = (2.5e-07, 3.9e-09, 2.6e-07)


def made(**options):
    """The manifest of a small model."""
    folder = model_folder(SEGMENTS, LINKS, functions=["mass_matrix"], **options)
    return json.loads((folder / "manifest.json").read_text())


@pytest.fixture(scope="module")
def manifest():
    return made()


@pytest.fixture(scope="module")
def thick():
    """The manifest of a scene that gives link_inertia."""
    return made(parameters={"link_inertia": list(INERTIA), "gravity": 0})


def refusal(manifest, changes):
    """The message that refuses changes."""
    with pytest.raises(st.ModelError) as caught:
        resolve(manifest, changes)
    return str(caught.value)


@pytest.mark.parametrize("changes", [None, {}])
def test_defaults_are_the_scenes(manifest, changes):
    assert dict(resolve(manifest, changes)) == dict(resolve_parameters({}, SEGMENTS * LINKS))


def test_scene_and_caller_agree_bit_for_bit(manifest):
    names = ("tail_mass", "tail_length", "link_radius")
    for row in np.random.default_rng(5).uniform(0.001, 2, (200, 3)).tolist():
        given = dict(zip(names, row, strict=True))
        assert dict(resolve(manifest, given)) == dict(resolve_parameters(given, SEGMENTS * LINKS))


@pytest.mark.parametrize("name", ["tail_mass", "tail_length", "link_radius"])
def test_link_inertia_follows_what_it_is_computed_from(manifest, name):
    before, after = resolve(manifest, None), resolve(manifest, {name: 0.1})
    assert after["link_inertia"] == ellipsoid(after, SEGMENTS * LINKS) != before["link_inertia"]


def test_given_link_inertia_replaces_link_radius(manifest):
    values = resolve(manifest, {"link_inertia": INERTIA, "tail_mass": 0.1})
    assert values["link_inertia"] == INERTIA and "link_radius" not in values


def test_link_radius_replaces_a_scenes_link_inertia(thick):
    assert resolve(thick, {"tail_mass": 0.1})["link_inertia"] == INERTIA
    values = resolve(thick, {"link_radius": 0.01})
    assert values["link_inertia"] == ellipsoid(values, SEGMENTS * LINKS)


def test_flat_is_the_struct(manifest):
    values = resolve(manifest, {"tail_mount": (1, 2, 3)})
    of_equal = [p for p in PARAMETERS if EQUAL.numbers_of(p.tail) and not p.needs]
    own = [p.name for p in of_equal if p.name != "link_radius"]
    assert flat(manifest, values) == np.hstack([values[name] for name in own]).tolist()
    assert flat(manifest, values)[5:8] == [1.0, 2.0, 3.0]


@pytest.mark.parametrize(
    "three", [[1, 2, 2.5], (1, 2, 2.5), np.array([1, 2, 2.5]), np.float32([1, 2, 2.5])]
)
def test_three_numbers_in_any_row(manifest, three):
    assert resolve(manifest, {"torso_inertia": three})["torso_inertia"] == (1.0, 2.0, 2.5)


@pytest.mark.parametrize("one", [2, 2.0, np.float32(2), np.int8(2), np.array(2.0)])
def test_one_number_of_any_type(manifest, one):
    value = resolve(manifest, {"tail_mass": one})["tail_mass"]
    assert value == 2.0 and type(value) is float


@pytest.mark.parametrize(
    ("name", "value"),
    [
        *[
            ("tail_mass", bad)
            for bad in (0, -1, np.nan, np.inf, "3", True, None, 1j, [1.0], np.array([1.0]), 10**400)
        ],
        *[
            ("torso_inertia", bad)
            for bad in ("123", {1, 2, 3}, [1, 2], [1, 1, "1"], [[1, 1, 1]], 1.0, [1, 2, 3.1])
        ],
        ("tail_mount", [0, 0, np.nan]),
        ("tail_mount", [[1], [1, 2]]),
        ("gravity", -9.8),
        ("link_inertia", [1, -1, 1]),
    ],
)
def test_wrong_value_is_named_with_its_unit(manifest, name, value):
    message = refusal(manifest, {name: value})
    unit = next(p.unit for p in PARAMETERS if p.name == name)
    assert message.startswith(f"parameters: {name}: value ") and f"({unit})" in message


def test_unknown_name_is_answered_with_the_likely_one(manifest):
    assert "tail_mas: no such parameter; did you mean 'tail_mass'?" in refusal(
        manifest, {"tail_mas": 1}
    )
    for strange in ("colour", 3):
        message = refusal(manifest, {strange: 1})
        assert f"{strange}: no such parameter; there are " in message and "torso_mass" in message


def test_all_problems_come_at_once(manifest):
    wrong = {
        "tail_mas": 1,
        "torso_mass": -1,
        "link_radius": 0.1,
        "link_inertia": INERTIA,
        "gravity": "9.8",
    }
    lines = refusal(manifest, wrong).splitlines()
    assert len(lines) == 4
    for line, name in zip(
        lines, ("tail_mas", "torso_mass", "gravity", "link_radius and link_inertia"), strict=True
    ):
        assert f"{name}: " in line


def test_inertia_beyond_numbers_is_refused(manifest):
    assert "no finite link_inertia" in refusal(manifest, {"tail_length": 1e200})


def test_baked_parameters_are_refused_with_the_remedy():
    baked = made(baked=True)
    assert "`baked = false`" in refusal(baked, {"tail_mass": 0.1})
    assert dict(resolve(baked, {})) == dict(resolve_parameters({}, SEGMENTS * LINKS))


def test_values_cannot_be_changed_in_place(manifest):
    with pytest.raises(TypeError):
        resolve(manifest, None)["tail_mass"] = 1.0


def test_the_struct_of_a_model_cannot_be_written_to():
    model = st.load(model_folder(SEGMENTS, LINKS, functions=["mass_matrix"]))
    for vector in (model.parameter_vector, model.with_parameters(gravity=0).parameter_vector):
        with pytest.raises(ValueError, match="read-only"):
            vector[0] = 1.0


def test_masked_values_are_refused(manifest):
    inertia = np.ma.masked_array(INERTIA, [False, True, False])
    assert "link_inertia: value masked_array" in refusal(manifest, {"link_inertia": inertia})


ELASTIC = {"tail_stiffness": 0.01, "tail_stop_lower": -1, "tail_stop_upper": [1, 2, 1, 2]}
ELASTIC |= {"tail_stop_stiffness": "0.1 N m/rad"}


@pytest.fixture(scope="module")
def elastic():
    """The manifest of a tail with springs and stops."""
    return made(parameters=ELASTIC)


def test_one_number_stands_for_all_tail_coordinates(elastic):
    values = resolve(elastic, {"tail_stiffness": "20 mN m/rad", "tail_rest": [0, "30 deg", 0, 1]})
    assert values["tail_stiffness"] == (0.02,) * 4
    assert values["tail_rest"] == pytest.approx((0, np.pi / 6, 0, 1))
    assert values["tail_stop_upper"] == (1.0, 2.0, 1.0, 2.0)
    assert dict(resolve(elastic, None)) == dict(resolve_parameters(ELASTIC, 6, segments=2))


def test_runs_have_one_number_or_one_a_coordinate_each(elastic):
    values = resolve(elastic, None)
    for given in ([0.02, 0.03, 0.04], np.outer([0.02, 0.03, 0.04], np.ones(4))):
        runs = RunParameters.checked(elastic, values, {"tail_stiffness": given}, 3)
        assert (runs.changes["tail_stiffness"] == np.outer([0.02, 0.03, 0.04], np.ones(4))).all()


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        (
            {"tail_stiffness": -1e-9},
            "tail_stiffness: value -1e-09: needs 4 finite numbers, or",
        ),
        ({"tail_stiffness": [1, 1, 1]}, "4 finite numbers, or one for all"),
        ({"tail_stiffness": float("nan")}, "tail_stiffness: value nan"),
        ({"tail_stop_stiffness": 0}, "above 0"),
        ({"tail_stop_lower": 1.5}, "tail_stop_lower 1.5 is not below tail_stop_upper 1 of tail"),
        ({"tail_damping": 1e-3}, "tail_damping: no such parameter"),
        ({"tail_rest": "3 N m"}, "a torque where an angle is needed"),
    ],
)
def test_values_of_the_passive_tail_that_cannot_be(elastic, changes, says):
    assert says in refusal(elastic, changes)


def test_stops_of_a_run_that_exclude_each_other(elastic):
    values = resolve(elastic, None)
    with pytest.raises(st.ModelError, match="is not below tail_stop_upper 2 of tail coordinate 1"):
        lower = np.array([[0, 0, 0, 0], [0, 3, 0, 0]])
        RunParameters.checked(elastic, values, {"tail_stop_lower": lower}, 2)


@pytest.mark.parametrize(
    ("given", "end"),
    [
        ({"torso_inertia": "1 g cm2"}, "none above the sum of the other two; here is 1 number"),
        ({"torso_inertia": [1e-5, 1e-5, 9e-5]}, "the other two; here 9e-05 is above 2e-05"),
        ({"torso_inertia": [1e-5, 1e-5, 0]}, "above 0, none above the sum of the other two"),
        ({"tail_mount": [1, 2]}, "needs 3 finite numbers (m); here are 2 numbers"),
        ({"tail_mount": [1, 2, np.nan]}, "needs 3 finite numbers (m)"),
    ],
)
def test_what_failed_of_several_rules_is_told(manifest, given, end):
    assert refusal(manifest, given).endswith(end)
