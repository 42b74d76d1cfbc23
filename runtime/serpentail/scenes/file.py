"""Reading a scene file, and loading the model that belongs to it, generated first where needed."""

import subprocess
import sys
import tomllib
from collections.abc import Mapping
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from ..errors import ModelError
from ..model.manifest import read_manifest
from ..model.model import Model, load
from ..model.parameters import merged

# keys of a scene that its generated code depends on, and that a folder is compared by
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
        raise error(
            f"scene file: value {str(path)!r}: cannot be read ({reason}); give a scene file (.toml)"
        ) from reason


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
    """Return the model of a scene, with the scene's parameters, then those given here.

    folder: by default generated/<name>; it is generated where it is missing.  ModelError where it
    is of another scene.
    """
    folder = Path(folder or Path("generated") / str(scene.get("name", Path(path).stem)))
    if not folder.exists():
        _generate(Path(path), folder)
    made = read_manifest(folder)["scene"]
    for key in MADE_OF:
        if key in scene and not _same(scene[key], made.get(key)):
            raise ModelError(
                f"{folder} has {key} = {made.get(key)!r}, {path} has {scene[key]!r}: generate it "
                f"again, `make model SCENE={path}`"
            )
    if made["baked"]:
        return load(folder, parameters)
    return load(folder, merged(scene.get("parameters", {}), parameters))


def _generate(path: Path, folder: Path) -> None:
    """Run the generator, where it is installed, in a process of its own; what it says is printed.

    On stderr: stdout may be for JSON alone.
    """
    if find_spec("serpentail_codegen") is None:
        raise ModelError(
            f"{folder} is no generated folder: make it where the generator is, `make model "
            f"SCENE={path}`"
        )
    generator = [sys.executable, "-m", "serpentail_codegen"]
    command = [*generator, str(path), "--output", str(folder.parent)]
    done = subprocess.run(
        command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False
    )
    if done.returncode or not folder.exists():
        raise ModelError(f"{folder} could not be generated: {done.stdout.strip()}")
    print(done.stdout.strip(), file=sys.stderr)


def _same(value: Any, made: Any) -> bool:
    """Tell whether a scene's value is that of a manifest; the order of a list means nothing."""
    if isinstance(value, list) and isinstance(made, list):
        return sorted(map(str, value)) == sorted(map(str, made))
    return bool(value == made)
