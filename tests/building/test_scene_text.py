"""Tables survive the way through a scene file, and options are those of the generator."""

import math
import tomllib

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as some

import serpentail as st
from serpentail.building.fewer_contacts import FUNCTIONS, NEEDED, with_contacts
from serpentail.building.options import Parameters, SceneKeys
from serpentail.building.scene_text import scene_text
from serpentail_codegen.scene.parameters import PARAMETERS
from serpentail_codegen.scene.parse import parse_scene
from serpentail_codegen.scene.passive import PASSIVE
from serpentail_codegen.scene.scene import KEYS
from serpentail_codegen.scene.signatures.table import NEEDS
from tests.support.scenes import SCENES

from ..support.rows import row

TEXTS = some.text(some.characters(codec="utf-8"))
VALUES = some.recursive(
    some.booleans() | some.integers(-(2**63) + 1, 2**63 - 1) | some.floats(allow_nan=False) | TEXTS,
    lambda inner: some.lists(inner, max_size=4) | some.dictionaries(TEXTS, inner, max_size=4),
    max_leaves=20,
)


@given(some.dictionaries(TEXTS, VALUES, max_size=5))
def test_tables_survive(tables):
    assert tomllib.loads(scene_text(tables)) == tables


def test_numbers_of_numpy_are_numbers():
    tables = {"a": np.float32(0.5), "b": np.int64(3), "c": np.eye(2), "d": (1, 2.5)}
    back = tomllib.loads(scene_text(tables))
    assert back == {"a": 0.5, "b": 3, "c": [[1.0, 0.0], [0.0, 1.0]], "d": [1, 2.5]}
    assert math.isnan(tomllib.loads(scene_text({"a": math.nan}))["a"])


def test_what_toml_cannot_say_is_named():
    deep = []
    for _ in range(5000):
        deep = [deep]
    rows = [({"b": x}, r"^a\.b: value ") for x in (None, 1j, object(), {1}, b"x", 2**63, -(2**63))]
    for value, words in [*rows, ("\ud800", "has no UTF-8"), (deep, "nested too deeply")]:
        with row(type(value)), pytest.raises(st.ModelError, match=words):
            scene_text({"a": value})


def test_options_are_what_the_generator_knows():
    keys = {"tail" if key == "kind" else key for key in KEYS}
    left = {"description", "parameters", "plan", "simulate", "phase", "identify", "sweep"}
    assert set(SceneKeys.__annotations__) == keys - left
    names = [parameter.name for parameter in (*PARAMETERS, *PASSIVE)]
    assert list(Parameters.__annotations__) == names


def test_what_belongs_to_contacts_is_what_the_generator_says():
    wanted = {group: [p.name for p in PARAMETERS if p.needs == group] for group in NEEDED}
    assert {group: [*names] for group, names in NEEDED.items()} == wanted
    assert {p.needs for p in PARAMETERS} == {"", *NEEDED}
    of_functions = {name: group for group, names in FUNCTIONS.items() for name in names}
    assert of_functions == NEEDS


def test_a_robot_file_serves_with_fewer_contacts():
    path = SCENES / "contact_m1_n3.toml"
    tables = tomllib.loads(path.read_text())
    tables["functions"] = [*NEEDS, "energy"]
    tables["functions"].remove("contact_rates")
    for contacts in ([], ["feet"], ["tail"], ["torso"], ["feet", "tail", "torso"]):
        with row(contacts):
            scene = parse_scene(with_contacts(tables, contacts), "robot")
            assert list(scene.contacts) == contacts
            assert ("mu" in dict(scene.parameters)) == bool(contacts)
            assert ("hip" in dict(scene.parameters)) == ("feet" in contacts)
            assert ("torso_semi_axes" in dict(scene.parameters)) == ("torso" in contacts)
            assert ("contact_points" in scene.functions) == bool(contacts)
            assert ("leg_points" in scene.functions) == ("feet" in contacts)
    assert with_contacts(tables, 3)["contacts"] == 3  # which the generator refuses
    options = {"contacts": [], "functions": ["energy"], "compiled": False}
    assert not st.build(path, **options).contacts
    with pytest.raises(st.ModelError, match="mu: no such parameter"):
        st.build(path, **options, mu=0.5)
