"""Reads motions that were saved, and finds their models again."""

import dataclasses
from pathlib import Path

from ...basics.errors import ModelError, ViewError
from ...model.load import model_from
from ...model.manifest import read_folder, restored
from ...model.model import Model
from ...model.parameters import independent
from ...motion.trajectory import Trajectory

GENERATED = Path("generated")


def read(file: str, folder: str | None = None) -> Trajectory:
    """Return the motion of a file with its model; ViewError if one of them is missing."""
    try:
        motion = Trajectory.load(file)
    except (OSError, ValueError) as error:
        raise ViewError(f"file: value {file!r}: {error}") from error
    return dataclasses.replace(motion, model=model_of(motion, folder))


def model_of(motion: Trajectory, folder: str | None = None) -> Model:
    """Return the model of a motion with its parameters.

    folder: its generated folder; None: the cache and generated/ are searched. ViewError if it is in
    neither.
    """
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
    return model_from(
        checked, None if baked else independent(checked.manifest, motion.info.get("parameters", {}))
    )
