"""Tables survive the way through a scene file, and options are those of the generator."""

import math
import tomllib
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as some

import serpentail as st
from serpentail.building.fewer_contacts import FUNCTIONS, NEEDED
from serpentail.building.options import Parameters, SceneKeys
from serpentail.building.scene_text import scene_text
from serpentail_codegen.scene.parameters import PARAMETERS
from serpentail_codegen.scene.passive import PASSIVE
from serpentail_codegen.scene.scene import KEYS
from serpentail_codegen.scene.signatures.table import NEEDS

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


@pytest.mark.parametrize("value", [None, 1j, object(), {1}, b"x", 2**63])
def test_what_toml_cannot_say_is_named(value):
    with pytest.raises(st.ModelError, match=r"^a\.b: value "):
        scene_text({"a": {"b": value}})


def test_half_a_character_is_refused():
    with pytest.raises(st.ModelError, match="has no UTF-8"):
        scene_text({"name": "\ud800"})


def test_what_is_nested_without_end_is_refused():
    deep = []
    for _ in range(5000):
        deep = [deep]
    with pytest.raises(st.ModelError, match="nested too deeply"):
        scene_text({"a": deep})


@pytest.mark.parametrize(("letter", "word"), [("m", "segments"), ("n", "links")])
def test_the_letters_of_sizes_are_told_their_words(letter, word):
    with pytest.raises(st.ModelError, match=f"did you mean '{word}'\\?"):
        st.build(**{letter: 2})


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


@pytest.mark.parametrize("contacts", [[], ["feet"], ["tail"], ["torso"]])
def test_a_robot_file_serves_with_fewer_contacts(contacts):
    scene = Path(__file__).parents[2] / "scenes" / "contact_m1_n3.toml"
    model = st.build(scene, contacts=contacts)
    assert list(model.contacts) == contacts
    assert ("mu" in model.parameters) == bool(contacts)
    assert ("hip" in model.parameters) == ("feet" in contacts)
    with pytest.raises(st.ModelError, match="mu: no such parameter"):
        st.build(scene, contacts=[], mu=0.5)
