"""Files that are broken in any way are refused by a SceneError, and by nothing else."""

import json
import random
import subprocess
import sys

import pytest

from serpentail_codegen.scene.parse import parse_scene, scene_for, scene_to_dict
from serpentail_codegen.scene.problems import SceneError
from serpentail_codegen.scene.scene import Scene

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
    parameters = table.pop("parameters")
    top, below = (
        "".join(f"{key} = {json.dumps(value)}\n" for key, value in part.items())
        for part in (table, parameters)
    )
    return f"{top}[parameters]\n{below}"


@pytest.mark.parametrize("mutate", [_mutate, _change_values])
def test_damaged_files_never_raise_anything_but_scene_errors(read, mutate):
    scene, dice, survivors, errors = scene_for("articulated", 3, 4), random.Random(2023), [], []
    text = _as_toml(scene)
    assert read(text) == scene
    for _ in range(2000):
        try:
            survivors.append(read(mutate(text, dice).encode(errors="surrogateescape")))
        except SceneError as error:
            errors.append(error)
    assert any(error.problems[0].field != "scene file" for error in errors)
    assert all(len(str(error).split("\n")) == len(error.problems) > 0 for error in errors)
    assert all(
        parse_scene(scene_to_dict(survivor), "another") == survivor for survivor in survivors
    )
    assert survivors


def test_importing_the_loader_does_not_import_sympy():
    code = "import sys; import serpentail_codegen.scene.parse; print('sympy' in sys.modules)"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert run.stdout.strip() == "False"
