"""A scene is data: both packages allow it the same names, and read the same files."""

import pytest

from serpentail.errors import ModelError
from serpentail.scenes.file import read_scene
from serpentail_codegen.scene.parse import load_scene, scene_for
from serpentail_codegen.scene.problems import SceneError
from tests.support.hostile import GOOD_NAMES, NAMES, unreadable


def _said(error):
    """What is wrong and what to do, without the value, which each package shortens in its way."""
    line = str(error.value)
    assert "\n" not in line and len(line) < 500
    field, rest = line.split(": ", 1)
    return field, rest.rsplit(": ", 1)[1] if "scene file" in field else rest[rest.index("needs") :]


@pytest.mark.parametrize("name", NAMES, ids=lambda name: repr(name)[:20])
def test_no_name_is_taken_that_is_a_path_or_no_identifier(name):
    with pytest.raises(SceneError) as refused:
        scene_for("articulated", 1, 1, name=name)
    assert "needs a text of up to 63" in _said(refused)[1]


@pytest.mark.parametrize("name", GOOD_NAMES)
def test_an_identifier_is_taken(name):
    assert scene_for("articulated", 1, 1, name=name).name == name


def test_both_packages_refuse_what_is_no_scene_file_in_the_same_words(tmp_path):
    for what, path in unreadable(tmp_path).items():
        with pytest.raises(SceneError) as by_generator:
            load_scene(path)
        if what == "null":  # a device that ends at once is none either
            assert "no regular file" in str(by_generator.value)
        with pytest.raises(ModelError) as by_runtime:
            read_scene(path, ModelError)
        assert _said(by_generator) == _said(by_runtime), what


def test_long_arrays_of_numbers_are_no_deep_keys(tmp_path):
    path = tmp_path / "t.toml"
    numbers = ", ".join(["0.1", "-2.5e-3", "1_0.0", "+3.25E8"] * 5000)
    path.write_text(f'kind = "articulated"\nsegments = 1\nlinks = 1\n[plan]\nx = [{numbers}]\n')
    assert load_scene(path).links == 1
    assert len(read_scene(path, ModelError)[0]["plan"]["x"]) == 20_000
