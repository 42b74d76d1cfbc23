"""``build`` makes a model in one call: it generates, compiles and loads it, or uses the cache."""

import re
from collections.abc import Mapping
from dataclasses import replace
from os import PathLike
from pathlib import Path
from typing import Any, Unpack

from ..basics.errors import ModelError
from ..compiling.cache import (
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
from ..compiling.locks import alone
from ..compiling.safe_files import regular_bytes
from ..model.load import model_from
from ..model.manifest import CheckedFolder, read_folder
from ..model.model import Model
from ..model.parameters import merged
from ..model.snapshot import restored, snapshot
from .examples import tables_of_scene
from .fewer_contacts import with_contacts
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
    """Generate, compile and load a model; results are cached.

    Parameters
    ----------
    scene : str or path, optional
        A scene file, or the name of an example (see ``examples``). Without it, the options
        describe the tail.
    compiled : bool, default True
        As of ``load``.
    threads : int, optional
        As of ``load``.
    **options
        Keys of a scene, which replace those of the file, and parameters by name (SI). If
        ``contacts`` leaves out a group of the file, such as ``contacts=[]`` for flights, so are
        the file's parameters and functions of that group. Common keys
        are ``tail`` ("articulated", "continuum" or "mixed"), ``segments`` (m, or one table for
        each segment), ``links`` (n), ``functions`` (names, or "all"), ``contacts``, ``samples``,
        ``friction``, ``coordinates``, ``bend_range`` (rad), ``real``, ``emission``, ``profile``,
        ``baked``, ``base``, ``targets`` and ``name``. Parameters such as ``torso_mass=0.06`` need
        no new code.

    Returns
    -------
    Model
        The loaded model.

    Raises
    ------
    ModelError
        A key or parameter is unknown or has a wrong value, or the generator is not installed.
    CompilerNotFound, CompileFailed
        As of ``load``.

    Warns
    -----
    UnusualSize, UnlikeBodies
        As of ``load``.

    Notes
    -----
    The generator runs in its own process for some seconds. Its results are cached under a hash
    of the scene and of the generator, so a second call takes milliseconds. Several processes may
    build at once: each model is made by one of them.

    Examples
    --------
    >>> import serpentail as st
    >>> model = st.build(tail="articulated", segments=3, links=4)  # doctest: +SKIP
    >>> heavy = st.build("righting_m1_n3", torso_mass=0.06)  # doctest: +SKIP
    """
    keys, parameters = separated(options)
    if scene is None:
        chosen = built(keys, _name(keys), parameters)
    else:
        tables, path = tables_of_scene(scene)
        if "contacts" in keys:
            tables = with_contacts(tables, keys["contacts"])
        chosen = built(tables | keys, path.stem, parameters)
    return model_from(*chosen, compiled=compiled, threads=threads)


def built(
    tables: Mapping[str, Any], name: str, parameters: Mapping[str, object]
) -> tuple[CheckedFolder, Mapping[str, object] | None]:
    """Return the checked files of a scene's model, and the parameters to load it with.

    ``name`` is the model's name unless the tables give one.
    """
    scene = {key: value for key, value in tables.items() if key not in LEFT_OUT}
    own = scene.get("parameters", {})
    if not isinstance(own, Mapping):
        return generated(scene, name, {}), parameters or None
    if scene.get("baked") is True and parameters:
        return generated(scene | {"parameters": merged(own, parameters)}, name, {}), None
    shaping = {n: x for n, x in parameters.items() if _shapes(n, scene, own)}
    if shaping:
        scene |= {"parameters": merged(own, shaping)}
    given = {n: x for n, x in parameters.items() if n not in shaping}
    return generated(scene, name, given), given or None


def _shapes(name: str, scene: Mapping[str, Any], own: Mapping[str, Any]) -> bool:
    """Tell if a parameter that the scene lacks needs other code, because it changes the tail."""
    if name == "mount_angles" or name in PASSIVE:
        return name not in own
    if name not in PIECES or name in own:
        return False
    segments = scene.get("segments")
    tables = segments if isinstance(segments, list | tuple) else []
    return "taper" not in scene and all(set(table) <= {"kind", "links"} for table in tables)


def generated(scene: Mapping[str, Any], name: str, given: Mapping[str, object]) -> CheckedFolder:
    """Return the checked files of a scene's model, generated unless the cache has them.

    given: parameters for the load, which are checked before a generation.
    """
    text, cache = scene_text(scene), cache_folder(None)
    key = digest([identity(), name, text])
    found = _noted(cache, key)
    if found:
        return found
    own = scene.get("parameters", {})
    with_given = scene_text({**scene, "parameters": merged(own, given)}) if given else text
    with alone(cache, key):
        return _noted(cache, key) or _made(cache, key, text, name, with_given)


def _made(cache: Path, key: str, text: str, name: str, given: str) -> CheckedFolder:
    """Generate a model, put its files into the cache, and store their hash under a key.

    given: the scene's text with the parameters for the load.
    """
    refuse_others(cache)
    try:
        with workshop(cache) as part:
            scene, note = part / f"{name}.toml", part / f"{key}.json"
            checked = part / "given" / f"{name}.toml"
            checked.parent.mkdir()
            scene.write_text(text, encoding="utf-8")
            checked.write_text(given, encoding="utf-8")
            found = read_folder(generate(scene, part / "made", checked))
            place = snapshot(found, cache)
            note.write_text(found.manifest_hash)
            publish(note, _note(cache, key), lambda _: False)
    except OSError as error:
        raise unwritable(cache, error) from error
    return replace(found, folder=place)


def _noted(cache: Path, key: str) -> CheckedFolder | None:
    """Return the model stored under a key; None if the cache does not have it whole."""
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
    """Return the file that holds the hash of the model stored under a key."""
    return cache / BUILDS / f"{key}.json"


def _name(keys: Mapping[str, Any]) -> str:
    """Return the name of a model without a scene file; ``make model`` gives the same one."""
    size = f"_n{keys['links']}" if "links" in keys else ""
    segments = keys.get("segments", "")
    count = len(segments) if isinstance(segments, list | tuple) else segments
    name = f"{keys.get('kind', 'tail')}_m{count}{size}"
    return re.sub("[^a-z0-9_]", "_", name.lower())[:63]
