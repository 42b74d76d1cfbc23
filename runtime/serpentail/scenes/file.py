"""Reading a scene file, and loading the model that belongs to it, generated first where needed."""

import shlex
import subprocess
import sys
from collections.abc import Mapping
from contextlib import suppress
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from ..checks import refusal, shown
from ..errors import ModelError
from ..model.manifest import read_manifest
from ..model.model import Model, load
from ..model.parameters import merged
from ..units import in_unit
from .names import checked_name
from .source import tables_of

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
        return tables_of(Path(path))
    except ValueError as reason:
        raise error(f"scene file: value {shown(str(path))}: {reason}") from reason


def subtable(scene: Mapping, name: str, path: str | Path, error: type[Exception]) -> dict:
    """Return a table of a scene; ``error`` where it has none."""
    table = scene.get(name)
    if not isinstance(table, Mapping):
        raise error(
            f"{name}: value {shown(table)}: {path} has no table [{name}]; add one, with start and "
            "duration"
        )
    return dict(table)


def model_of(
    scene: Mapping, path: str | Path, folder: str | Path | None, parameters: Mapping
) -> Model:
    """Return the model of a scene, with the scene's parameters, then those given here.

    folder: by default generated/<name>, which is generated where it is missing.  ModelError where
    the folder is of another scene.
    """
    name = checked_name(scene.get("name", Path(path).stem))
    place = Path(folder or Path("generated") / name)
    if not folder and not place.exists():
        _generate(Path(path), place)
    made = read_manifest(place)["scene"]
    for key in MADE_OF:
        if key in scene and not _same(_in_radians(key, scene[key]), made.get(key)):
            raise ModelError(
                f"{place} has {key} = {made.get(key)!r}, {path} has {shown(scene[key])}: generate "
                f"it again, `{make_model(path)}`"
            )
    if made["baked"]:
        return load(place, parameters)
    return load(place, merged(_own_parameters(scene), parameters))


def make_model(path: str | Path) -> str:
    """Return the command that generates a scene's model."""
    return f"make model SCENE={shlex.quote(str(path))}"


def _own_parameters(scene: Mapping) -> Mapping:
    """Return the parameters that a scene names."""
    own = scene.get("parameters", {})
    if not isinstance(own, Mapping):
        raise refusal("parameters", own, "a table, under a line [parameters]", ModelError)
    return own


def _generate(path: Path, folder: Path) -> None:
    """Run the generator, where it is installed, in a process of its own; what it says is printed.

    On stderr: stdout may be for JSON alone.
    """
    if find_spec("serpentail_codegen") is None:
        raise ModelError(
            f"{folder} is no generated folder: make it where the generator is, `{make_model(path)}`"
        )
    generator = [sys.executable, "-m", "serpentail_codegen"]
    command = [*generator, "--output", str(folder.parent), "--", str(path)]
    done = subprocess.run(
        command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False
    )
    if done.returncode or not folder.exists():
        raise ModelError(f"{folder} could not be generated: {done.stdout.strip()}")
    print(done.stdout.strip(), file=sys.stderr)


def _same(value: Any, made: Any) -> bool:
    """Tell whether a scene's value is that of a manifest; the order of a list means nothing."""
    if isinstance(value, list) and isinstance(made, list):
        return all(value.count(x) == made.count(x) for x in (*value, *made))
    return bool(value == made)


def _in_radians(key: str, value: Any) -> Any:
    """Return the value of a key, of an angle as a number where it has a unit."""
    with suppress(ValueError):  # it is not what the model was made with, then
        return in_unit(value, "rad") if key == "bend_range" else value
    return value
