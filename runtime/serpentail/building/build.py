"""`build` makes a model in one line: it generates, compiles and loads, or finds what it made."""

import re
from collections.abc import Mapping
from dataclasses import replace
from os import PathLike
from pathlib import Path
from typing import Any, Unpack

from ..errors import ModelError
from ..model.cache import (
    BUILDS,
    MODELS,
    cache_folder,
    digest,
    mark_used,
    publish,
    refuse_others,
    unwritable,
    workshop,
)
from ..model.locks import alone
from ..model.manifest import CheckedFolder, read_folder
from ..model.model import Model, model_from
from ..model.parameters import merged
from ..model.reading import regular_bytes
from ..model.snapshot import restored, snapshot
from .examples import tables_of_scene
from .generator import generate, identity
from .options import Options, separated
from .scene_text import scene_text

# parameters of single links or arcs
PIECES = {
    *("link_masses", "link_lengths", "link_centers", "link_inertias"),
    *("arc_masses", "arc_lengths"),
}
# parameters of springs, damping and stops
PASSIVE = {"tail_stiffness", "tail_rest", "tail_damping"} | {
    f"tail_stop_{name}" for name in ("lower", "upper", "stiffness", "width")
}
LEFT_OUT = (
    "plan",
    "simulate",
    "identify",
    "phase",
    "sweep",
    "description",
)  # no generated code depends on them


def build(
    scene: str | PathLike[str] | None = None,
    /,
    *,
    compiled: bool = True,
    threads: int | None = None,
    **options: Unpack[Options],
) -> Model:
    """Return a model that is generated, compiled and loaded; what was made before is found again.

    scene: a scene file, or the name of an example (see ``examples``); without one, options
    describe the tail: ``tail`` ("articulated", "continuum" or "mixed"), ``segments`` (m, or a
    table for each) and ``links`` (n).
    options: keys of a scene, which replace those of the file: functions (names, or "all"),
    contacts, samples, friction, coordinates, bend_range (rad), real, emission, profile, baked,
    targets, name; and parameters by name, SI, such as torso_mass=0.06, which need no new code.
    compiled, threads: as of ``load``.

    The generator runs in a process of its own, for seconds; its results are kept in the cache by
    the content of the scene and of the generator, so a second call takes milliseconds.  Any number
    of processes may build at once: each model is made by one of them.
    Raises ModelError (a key or parameter that is unknown or cannot be; no generator), and what
    ``load`` raises.
    """
    keys, parameters = separated(options)
    if scene is None:
        chosen = built(keys, _name(keys), parameters)
    else:
        tables, path = tables_of_scene(scene)
        chosen = built(tables | keys, path.stem, parameters)
    return model_from(*chosen, compiled=compiled, threads=threads)


def built(
    tables: Mapping[str, Any], name: str, parameters: Mapping[str, object]
) -> tuple[CheckedFolder, Mapping[str, object] | None]:
    """Return the checked files of a scene's model, and the parameters to load it with.

    The model is called ``name`` unless the tables have a name.
    """
    scene = {key: value for key, value in tables.items() if key not in LEFT_OUT}
    own = scene.get("parameters", {})
    if not isinstance(own, Mapping):
        return generated(scene, name), parameters or None
    if scene.get("baked") is True and parameters:
        return generated(scene | {"parameters": merged(own, parameters)}, name), None
    shaping = {n: x for n, x in parameters.items() if _shapes(n, scene, own)}
    if shaping:
        scene |= {"parameters": merged(own, shaping)}
    return generated(scene, name), {n: x for n, x in parameters.items() if n not in shaping} or None


def _shapes(name: str, scene: Mapping[str, Any], own: Mapping[str, Any]) -> bool:
    """Tell if a parameter makes another tail of a scene's, whose code has no such parameter."""
    if name == "mount_angles" or name in PASSIVE:
        return name not in own
    if name not in PIECES or name in own:
        return False
    segments = scene.get("segments")
    tables = segments if isinstance(segments, list | tuple) else []
    return "taper" not in scene and all(set(table) <= {"kind", "links"} for table in tables)


def generated(scene: Mapping[str, Any], name: str) -> CheckedFolder:
    """Return the checked files of a scene's model, generated unless the cache has them."""
    text, cache = scene_text(scene), cache_folder(None)
    key = digest([identity(), name, text])
    found = _noted(cache, key)
    if found:
        return found
    with alone(cache, key):
        return _noted(cache, key) or _made(cache, key, text, name)


def _made(cache: Path, key: str, text: str, name: str) -> CheckedFolder:
    """Generate a model, put its files into the cache, and note under a key which they are."""
    refuse_others(cache)
    try:
        with workshop(cache) as part:
            scene, note = part / f"{name}.toml", part / f"{key}.json"
            scene.write_text(text, encoding="utf-8")
            found = read_folder(generate(scene, part / "made"))
            place = snapshot(found, cache)
            note.write_text(found.manifest_hash)
            publish(note, _note(cache, key), lambda _: False)
    except OSError as error:
        raise unwritable(cache, error) from error
    return replace(found, folder=place)


def _noted(cache: Path, key: str) -> CheckedFolder | None:
    """Return the model that was made under a key, if the cache still has it whole."""
    path = _note(cache, key)
    try:
        manifest_hash = regular_bytes(path).decode("ascii")
        refuse_others(cache, path.parent, path)
        place = cache / MODELS / manifest_hash
        if not re.fullmatch("[0-9a-f]{64}", manifest_hash):
            return None
        found = restored(manifest_hash, place)
    except (OSError, UnicodeDecodeError, ModelError):
        return None
    mark_used(path)
    return found


def _note(cache: Path, key: str) -> Path:
    """Return where it is noted what was made under a key."""
    return cache / BUILDS / f"{key}.json"


def _name(keys: Mapping[str, Any]) -> str:
    """Return what a model without a scene file is called: ``make model`` calls it so, too."""
    size = f"_n{keys['links']}" if "links" in keys else ""
    segments = keys.get("segments", "")
    count = len(segments) if isinstance(segments, list | tuple) else segments
    name = f"{keys.get('kind', 'tail')}_m{count}{size}"
    return re.sub("[^a-z0-9_]", "_", name.lower())[:63]
