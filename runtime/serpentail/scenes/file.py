"""Reading a scene file, and the model that belongs to it."""

from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from serpentail_scene.keys import KEYS
from serpentail_scene.units import in_unit

from ..basics.checks import Refusals, refusal, shown
from ..basics.errors import ModelError, SerpentailError
from ..building.build import built
from ..building.examples import tables_of_scene
from ..model.load import load, model_from
from ..model.manifest import read_folder
from ..model.model import Model
from ..model.parameters import merged
from .keys import Key, read, sized

# keys of a scene that its generated code depends on, and that a folder is compared by
MADE_OF = (
    *("kind", "segments", "links", "samples", "contacts", "friction", "bend_range"),
    *("coordinates", "taper", "base", "weightless"),
)
# tables of verbs, and the keys that each needs
NEEDS = {
    "simulate": "start and duration",
    "plan": "start and duration",
    "identify": "tables [[identify.marker]]",
    "sweep": "a table [sweep.over]",
}
UNSIZED: Mapping[str, float] = {}  # of a body that is not scaled


def read_scene(path: str | Path, error: type[Exception]) -> tuple[dict[str, Any], Path]:
    """Return the tables of a scene file or example, and its path.

    ``error`` if it cannot be read.
    """
    try:
        return tables_of_scene(path)
    except SerpentailError as reason:
        raise error(str(reason)) from reason


def subtable(scene: Mapping, name: str, path: Path, error: type[Exception]) -> dict:
    """Return a table of a scene; ``error`` if it is missing."""
    table = scene.get(name)
    if not isinstance(table, Mapping):
        others = [verb for verb in NEEDS if verb != name and verb in scene]
        remedy = "".join(f", or try `serpentail {verb}`" for verb in others)
        raise error(f"{path} has no table [{name}]; add one, with {NEEDS[name]}{remedy}")
    return dict(table)


def model_of(scene: Mapping, path: Path, folder: str | Path | None, parameters: Mapping) -> Model:
    """Return the model of a scene, with the scene's parameters, then those given here.

    folder: the generated folder; None: the model is built, or taken from the cache. ModelError if
    the folder belongs to another scene.
    """
    if folder is None:
        return model_from(*built(scene, path.stem, parameters))
    made = read_folder(Path(folder)).manifest["scene"]
    for key in [key for key in MADE_OF if key in scene]:
        default = KEYS[key].default  # manifests leave some out
        if not _same(_in_radians(key, scene[key]), made.get(key, default)):
            raise ModelError(
                f"{folder} has {key} = {made.get(key)!r}, {path} has {shown(scene[key])}: generate "
                "it again, or leave the folder out"
            )
    if made["baked"] or "body" in scene:  # it has the scene's own
        return load(folder, parameters)
    of_scene = scene.get("parameters", {})
    if not isinstance(of_scene, Mapping):
        raise refusal("parameters", of_scene, "a table, under a line [parameters]", ModelError)
    return load(folder, merged(of_scene, parameters))


def values_of(
    table: Mapping, key: Key, where: str, size: Mapping[str, float], refused: Refusals
) -> dict[str, Any]:
    """Return the values of a table, in the units of its keys and in the size of a body."""
    return dict(sized(read(table, key, where, refused), key, size))


def size_of(model: Model) -> dict[str, float]:
    """Return the factors of each "kg", "m" and "s" of a scaled scene; empty without scaling."""
    return dict(model.manifest.get("size", {}))


def _same(value: Any, made: Any) -> bool:
    """Tell whether a scene's value equals that of a manifest; the order of a list is ignored."""
    if isinstance(value, list) and isinstance(made, list):
        return all(value.count(x) == made.count(x) for x in (*value, *made))
    return bool(value == made)


def _in_radians(key: str, value: Any) -> Any:
    """Return the value of a key; an angle with a unit as a number in rad."""
    with suppress(ValueError):  # then it differs from what the model was made with
        return in_unit(value, "rad") if key == "bend_range" else value
    return value
