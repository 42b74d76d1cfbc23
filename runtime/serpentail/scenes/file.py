"""Scene files: a path goes in; its tables, and the model that was generated from it, come out."""

import subprocess
import sys
import tomllib
from collections.abc import Mapping
from importlib.util import find_spec
from pathlib import Path

from ..errors import ModelError
from ..model.manifest import read_manifest
from ..model.model import Model, load
from ..model.parameters import merged

MADE_OF = (
    "kind",
    "segments",
    "links",
    "samples",
    "contacts",
    "friction",
    "bend_range",
    "coordinates",
)


def read_scene(path: str | Path, error: type[Exception]) -> dict:
    """Return the tables of a scene file; ``error`` where it cannot be read."""
    try:
        return tomllib.loads(Path(path).read_text(encoding="utf-8-sig"))
    except (OSError, ValueError, RecursionError) as reason:
        words = (
            f"scene file: value {str(path)!r}: cannot be read ({reason}); give a scene file (.toml)"
        )
        raise error(words) from reason


def subtable(scene: Mapping, name: str, path: str | Path, error: type[Exception]) -> dict:
    """Return a table of a scene; ``error`` where it has none."""
    table = scene.get(name)
    if not isinstance(table, Mapping):
        raise error(
            f"{name}: value {table!r}: {path} has no table [{name}]; add one, with start and "
            "duration"
        )
    return dict(table)


def model_of(
    scene: Mapping, path: str | Path, folder: str | Path | None, parameters: Mapping
) -> Model:
    """Return the model of a scene, generated first where its folder, by default generated/<name>,
    is missing.

    Its parameters are the scene's, then those given here.  ModelError where the folder is of
    another scene.
    """
    folder = Path(folder or Path("generated") / str(scene.get("name", Path(path).stem)))
    if not folder.exists():
        _generate(Path(path), folder)
    made = read_manifest(folder)["scene"]
    for key in [
        key
        for key in MADE_OF
        if key in scene and made.get(key) != _in_order(scene[key], made.get(key))
    ]:
        was, remedy = made.get(key), f"generate it again, `make model SCENE={path}`"
        raise ModelError(f"{folder} has {key} = {was!r}, {path} has {scene[key]!r}: {remedy}")
    return load(
        folder, parameters if made["baked"] else merged(scene.get("parameters", {}), parameters)
    )


def _generate(path: Path, folder: Path) -> None:
    """Run the generator, where it is installed, in a process of its own; it tells on stderr what it
    did.
    """
    if find_spec("serpentail_codegen") is None:
        raise ModelError(
            f"{folder} is no generated folder: make it where the generator is, `make model "
            f"SCENE={path}`"
        )
    command = [
        sys.executable,
        "-m",
        "serpentail_codegen",
        str(path),
        "--output",
        str(folder.parent),
    ]
    done = subprocess.run(
        command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False
    )
    if done.returncode or not folder.exists():
        raise ModelError(f"{folder} could not be generated: {done.stdout.strip()}")
    print(done.stdout.strip(), file=sys.stderr)


def _in_order(value, made):
    """A list as the manifest has it, whose order means nothing."""
    same = (
        isinstance(value, list)
        and isinstance(made, list)
        and sorted(map(str, value)) == sorted(map(str, made))
    )
    return made if same else value
