"""``build`` makes a model in one call: it generates, compiles and loads it, or uses the cache."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from os import PathLike
from typing import Any, Unpack

from serpentail_scene.parameters import AIR_NAMES, NAMES, PASSIVE_NAMES, name_in
from serpentail_scene.purposes import functions_of

from ..basics.errors import ModelError
from ..model.load import model_from
from ..model.manifest import CheckedFolder
from ..model.model import Model
from ..model.parameters import merged
from .examples import tables_of_scene
from .generator import generated
from .options import Options, separated

# parameters of single links or arcs
PIECES = {
    *("link_masses", "link_lengths", "link_centers", "link_inertias"),
    *("arc_masses", "arc_lengths"),
}
# keys on which no generated code depends
LEFT_OUT = ("plan", "simulate", "identify", "phase", "sweep", "description")
ANY = "contacts"  # any group of points that touch the ground
# parameters that a scene file may have of a group, or of any group
NEEDED = {
    ANY: ("K_n", "D_n", "K_f", "D_f", "mu"),
    "feet": ("L_h2d", "L_d2k", "L_k2a", "L_a2m", "L_m2t", "delta_m", "hip"),
    "torso": ("torso_semi_axes",),
}


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
        each segment), ``links`` (n), ``purpose`` (such as ["plan"]), ``functions`` (names, names
        with "+" to add them, or "all"), ``contacts``, ``samples``,
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
    build at once: each model is made by one of them. A function that was not generated is added
    when it is first asked for.

    Examples
    --------
    >>> import serpentail as st
    >>> model = st.build(tail="articulated", segments=3, links=4)  # doctest: +SKIP
    >>> heavy = st.build("righting_m1_n3", torso_mass=0.06)  # doctest: +SKIP
    """
    tables, path = tables_of_scene(scene) if scene is not None else ({}, None)
    keys, parameters = separated(options, _chains({**tables, **options}))
    if "contacts" in keys and path is not None:
        tables = with_contacts(tables, keys["contacts"])
    try:
        chosen = built(tables | keys, path.stem if path else _name(keys), parameters)
    except ModelError as error:
        if path is None:
            error.args = (re.sub(r"(: |\n)kind: ", r"\1tail: ", str(error)),)  # our word
        raise
    return model_from(*chosen, compiled=compiled, threads=threads)


@dataclass(frozen=True)
class Growth:
    """Generates a model again with other functions; it can be pickled.

    scene: its tables; name: the model's, unless the tables give one.
    """

    scene: Mapping[str, Any]
    name: str

    def __call__(self, functions: Sequence[str]) -> CheckedFolder:
        """Return the checked files of the model with these functions."""
        return generated({**self.scene, "functions": functions}, self.name, {})


def built(
    tables: Mapping[str, Any], name: str, parameters: Mapping[str, object]
) -> tuple[CheckedFolder, Mapping[str, object] | None, Growth | None]:
    """Return the checked files of a scene's model, the parameters to load it with, and its growth.

    ``name`` is the model's name unless the tables give one.
    """
    scene = {key: value for key, value in tables.items() if key not in LEFT_OUT}
    if scene.get("functions") != "all":
        scene["functions"] = functions_of(tables)  # which other tables decide
    own = scene.get("parameters", {})
    if not isinstance(own, Mapping):
        return generated(scene, name, {}), parameters or None, None
    if scene.get("baked") is True and parameters:
        scene |= {"parameters": merged(own, parameters)}
        return generated(scene, name, {}), None, Growth(scene, name)
    shaping = {n: x for n, x in parameters.items() if _shapes(n, scene, own)}
    if shaping:
        scene |= {"parameters": merged(own, shaping)}
    given = {n: x for n, x in parameters.items() if n not in shaping}
    return generated(scene, name, given), given or None, Growth(scene, name)


def _shapes(name: str, scene: Mapping[str, Any], own: Mapping[str, Any]) -> bool:
    """Tell if a parameter that the scene lacks needs other code, because it changes a chain."""
    for chain, table in _chains(scene).items():
        if name.startswith(f"{chain}_") and name not in NAMES and isinstance(table, Mapping):
            full = {name_in(chain, n): n for n in NAMES}.get(name, name)
            return _shapes(full, table, {f"tail_{key}": key for key in table} | dict(table))
    axes = ("mount_angles", "gravity_vector")
    if name in (*axes, "joint_ratios", *PASSIVE_NAMES, *AIR_NAMES):
        return name not in own
    if name not in PIECES or name in own:
        return False
    segments = scene.get("segments")
    tables = segments if isinstance(segments, list | tuple) else []
    return "taper" not in scene and all(set(t) <= {"kind", "links", "ratios"} for t in tables)


def _chains(scene: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return the tables of a scene's chains; none in place of what is no table."""
    chains = scene.get("chain", {})
    return chains if isinstance(chains, Mapping) else {}


def with_contacts(tables: Mapping[str, Any], contacts: Any) -> dict[str, Any]:
    """Return a scene's tables with other contacts, without what belongs to groups that it lacks.

    These are parameters, functions and, without any contacts, the friction.
    """
    from serpentail_scene.signatures.table import NEEDS

    scene = dict(tables) | {"contacts": contacts}
    if not isinstance(contacts, list | tuple):  # which the generator refuses
        return scene
    lacking = [
        group for group in NEEDED if group not in contacts and (group != ANY or not contacts)
    ]
    if ANY in lacking:
        scene.pop("friction", None)
    without = [name for group in lacking for name in NEEDED[group]]
    if isinstance(scene.get("parameters"), Mapping):
        own = scene["parameters"]
        scene["parameters"] = {name: own[name] for name in own if name not in without}
    if isinstance(scene.get("functions"), list):
        names = scene["functions"]
        scene["functions"] = [n for n in names if NEEDS.get(str(n).lstrip("+")) not in lacking]
    return scene


def _name(keys: Mapping[str, Any]) -> str:
    """Return the name of a model without a scene file; ``make model`` gives the same one."""
    size = f"_n{keys['links']}" if "links" in keys else ""
    segments = keys.get("segments", "")
    count = len(segments) if isinstance(segments, list | tuple) else segments
    name = f"{keys.get('kind', 'tail')}_m{count}{size}"
    return re.sub("[^a-z0-9_]", "_", name.lower())[:63]
