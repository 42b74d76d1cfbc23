"""Which motions are shown: checks of what users give, and saved motions with their models."""

import dataclasses
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, TypeAlias

from ..basics.errors import ModelError, ViewError
from ..model.checked import checked_model
from ..model.load import model_from
from ..model.manifest import read_folder, restored
from ..model.model import Model
from ..model.parameters import independent
from ..motion.trajectory import Trajectory

GENERATED = Path("generated")
FILE = (str, os.PathLike)
Shown: TypeAlias = Trajectory | str | os.PathLike[str]  # a motion, or the file that has it
Motions: TypeAlias = Shown | Sequence[Shown] | Mapping[str, Shown]


def checked_motions(motions: Any, names: Any, model: Any) -> tuple[list[Trajectory], Any]:
    """Return the motions as a list, read if they are files, and their names, if there are any.

    ViewError if there is none, something else or a file that cannot be read, and for names twice.
    """
    if isinstance(motions, Mapping):
        if names is not None:
            raise ViewError("names: given twice: motions is a dict, whose keys are the names")
        motions, names = list(motions.values()), list(motions)
    listed = list(motions) if isinstance(motions, list | tuple) else [motions]
    if names is None and listed and all(isinstance(each, FILE) for each in listed):
        names = list(map(str, listed))
    for k, motion in enumerate(listed):
        if isinstance(motion, FILE):
            listed[k] = saved_motion(motion, model=model)
        elif not isinstance(motion, Trajectory):
            raise ViewError(
                f"motions[{k}]: type {type(motion).__name__}: needs a Trajectory, such as "
                "plan.trajectory or rollouts[0], or an .npz file"
            )
    if not listed:
        raise ViewError("motions: none: needs one Trajectory or more")
    return listed, names


def checked_names(names: Any, motions: list[Trajectory]) -> list[str]:
    """Return a name for each motion; ViewError unless they are as many, and different."""
    if names is None:
        kinds = ["planned" if m.info.get("kind") == "plan" else "run" for m in motions]
        return [
            kind if kinds.count(kind) == 1 else f"{kind} {k + 1}" for k, kind in enumerate(kinds)
        ]
    listed = list(names) if isinstance(names, list | tuple) else []
    texts = all(isinstance(name, str) and name.strip() for name in listed)
    if not texts or len(listed) != len(motions) or len(set(listed)) != len(listed):
        raise ViewError(f"names: value {names!r:.200}: needs {len(motions)} names that differ")
    return listed


def checked_models(motions: list[Trajectory], model: Any) -> list[Model]:
    """Return the model of each motion, else ``model``; ViewError if one has none that fits."""
    models = []
    for k, motion in enumerate(motions):
        used = motion.model if motion.model is not None else model
        if used is None:
            raise ViewError(
                f"motions[{k}]: was loaded from a file, which has no model: give "
                "model=st.load(folder)"
            )
        if used is model:
            checked_model(model, ViewError)
        if motion.q.shape[1] != used.nq:
            raise ViewError(
                f"motions[{k}]: q has {motion.q.shape[1]} numbers, {used.name} has {used.nq}: "
                "give its own model"
            )
        models.append(used)
    return models


def saved_motion(
    file: str | os.PathLike[str], folder: str | None = None, model: Any = None
) -> Trajectory:
    """Return the motion of a file with its model; ViewError if one of them is missing.

    folder: the model's generated folder; None: the cache and generated/ are searched.
    model: the model itself, if the caller has it.
    """
    try:
        motion = Trajectory.load(file)
    except (OSError, ValueError) as error:
        raise ViewError(f"file: value {str(file)!r}: {error}") from error
    return dataclasses.replace(motion, model=model or _saved_model(motion, folder))


def _saved_model(motion: Trajectory, folder: str | None) -> Model:
    """Return the model of a saved motion, with the motion's parameters."""
    name, made = str(motion.info.get("model", "?")), str(motion.info.get("manifest_hash", "?"))
    try:
        checked = read_folder(Path(folder)) if folder else restored(made, GENERATED / name)
    except ModelError as error:
        if folder:
            raise
        raise ViewError(
            f"model: what made this motion of {name!r} is neither in the cache nor in "
            f"{GENERATED / name}: give its generated folder, --folder FOLDER"
        ) from error
    baked = checked.manifest["scene"]["baked"]
    parameters = independent(checked.manifest, motion.info.get("parameters", {}))
    return model_from(checked, None if baked else parameters)
