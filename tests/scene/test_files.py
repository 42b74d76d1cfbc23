"""Broken scene files are refused by a SceneError alone, by the runtime in the same words."""

import json
import random

import pytest

from serpentail.errors import ModelError
from serpentail.scenes.file import read_scene
from serpentail_codegen.scene.parse import load_scene, parse_scene, scene_for, scene_to_dict
from serpentail_codegen.scene.problems import SceneError
from serpentail_codegen.scene.scene import Scene
from tests.support.hostile import unreadable
from tests.support.rows import row
from tests.support.scenes import VALID

# fmt: off
VALUES = [
    "true", "false", "nan", "-inf", "0", "-1", "1", "3.5", "1e308", "9" * 400, "0x" + "f" * 4000,
    "12:30:00", '""', '"3"', '"polar"', '"float"', "[]", "{}", "[1, 1, 1]", "[1, 2, 3.1]",
    '["energy"]', "[[[]]]", "[{}]",
]
PIECES = [
    "[[", "]", "=", "#", ".", "\n", "'''", "\\", "\0", "\udcff", "é", "functions", "link_inertia",
    "name", "[parameters]", "[[parameters]]", "[parameters.x]", '"\\u0000" = 1\n',
    *VALUES,
]
# fmt: on


def _mutate(text: str, dice: random.Random) -> str:
    """Replace, insert or swap a few pieces of the text."""
    for _ in range(dice.randint(1, 2)):
        start = dice.randrange(len(text) + 1)
        stop = min(len(text), start + dice.choice([0, 1, 3, 12]))
        piece = dice.choice([dice.choice(PIECES), text[dice.randrange(len(text) + 1) :][:20]])
        text = text[:start] + piece + text[stop:]
    return text


def _change_values(text: str, dice: random.Random) -> str:
    """Give one or two of the lines `key = value` another value, so that the text stays TOML."""
    lines = text.splitlines()
    for i in dice.sample([i for i, line in enumerate(lines) if " = " in line], dice.randint(1, 2)):
        lines[i] = f"{lines[i].partition(' = ')[0]} = {dice.choice(VALUES)}"
    return "\n".join(lines)


def _as_toml(scene: Scene) -> str:
    """Write a scene as a file, one line for each key."""
    table = {"description": "", **scene_to_dict(scene)}
    parts = {"parameters": table.pop("parameters")}
    top, below = (
        "".join(f"{key} = {json.dumps(value)}\n" for key, value in part.items())
        for part in (table, parts["parameters"])
    )
    return f"{top}[parameters]\n{below}"


@pytest.mark.parametrize("mutate", [_mutate, _change_values])
def test_damaged_files_never_raise_anything_but_scene_errors(read, mutate):
    scene, dice, survivors, errors = scene_for("articulated", 3, 4), random.Random(2023), [], []
    text = _as_toml(scene)
    assert read(text) == scene
    for _ in range(1200):
        try:
            survivors.append(read(mutate(text, dice).encode(errors="surrogateescape")))
        except SceneError as error:
            errors.append(error)
    assert any(error.problems[0].field != "scene file" for error in errors)
    assert all(len(str(error).split("\n")) == len(error.problems) > 0 for error in errors)
    assert all(parse_scene(scene_to_dict(found), "another") == found for found in survivors)
    assert survivors


def test_files_that_are_not_toml_are_refused_with_the_place(read):
    rows = [
        ("segments = \n", "line 1, column 12"),
        ("links = 1\nlinks = 2\n", "line 2"),
        (b"links = 1\nkind = '\xff'", "byte 18"),
        ("links = " + "[" * 10_000, "TOML"),
        ("links = " + "9" * 5_000, "TOML"),
        ("links = 1\0", "TOML"),
    ]
    for text, words in rows:
        with row(text[:20]), pytest.raises(SceneError, match=words) as caught:
            read(text)
        assert "rat.toml" in caught.value.problems[0].value
    assert read(b"\xef\xbb\xbf" + VALID.replace("\n", "\r\n").encode()) == read(VALID)


def _said(error):
    """What is wrong and what to do, without the value, which each package shortens in its way."""
    line = str(error.value)
    assert "\n" not in line and len(line) < 500
    field, rest = line.split(": ", 1)
    return field, rest.rsplit(": ", 1)[1] if "scene file" in field else rest[rest.index("needs") :]


def test_both_packages_refuse_what_is_no_scene_file_in_the_same_words(tmp_path):
    for what, path in unreadable(tmp_path).items():
        with row(what):
            with pytest.raises(SceneError) as by_generator:
                load_scene(path)
            assert [problem.field for problem in by_generator.value.problems] == ["scene file"]
            if what == "null":  # a device that ends at once is none either
                assert "no regular file" in str(by_generator.value)
            with pytest.raises(ModelError) as by_runtime:
                read_scene(path, ModelError)
            assert _said(by_generator) == _said(by_runtime)


def test_sizes_of_files_and_depths_of_keys_have_bounds(tmp_path):
    """A file of 1 MB and 100 dots in a line are taken; dots of numbers are none."""
    path = tmp_path / "t.toml"
    numbers = ", ".join(["0.1", "-2.5e-3", "1_0.0", "+3.25E8"] * 5000)
    text = f"{VALID}[plan]\nx = [{numbers}]\n{'a.' * 100}a = 1\n#"
    path.write_text(text + "-" * (1_000_000 - len(text)))
    assert load_scene(path).links == 3
    assert len(read_scene(path, ModelError)[0]["plan"]["x"]) == 20_000
    for wrong in (text + "-" * (1_000_001 - len(text)), f"{VALID}[plan]\n{'a.' * 101}a = 1\n"):
        path.write_text(wrong)
        with pytest.raises(SceneError, match="scene file"):
            load_scene(path)
