"""Reads motions that were saved, and finds their models again."""

import dataclasses
from pathlib import Path

from ..errors import ModelError, ViewError
from ..model.manifest import read_manifest
from ..model.model import Model, load
from ..model.parameters import independent
from ..motion.trajectory import Trajectory

GENERATED = Path("generated")


def read(file: str, folder: str | None = None) -> Trajectory:
    """Return the motion of a file with its model; ViewError where one of them cannot be had."""
    try:
        motion = Trajectory.load(file)
    except (OSError, ValueError) as error:
        raise ViewError(f"file: value {file!r}: {error}") from error
    return dataclasses.replace(motion, model=model_of(motion, folder))


def model_of(motion: Trajectory, folder: str | None = None) -> Model:
    """Return the model of a motion with its parameters.

    folder: its generated folder, by default the one in generated/ that has its name and content.
    ViewError where that is not there, or of another content.
    """
    name = str(motion.info.get("model", "?"))
    place = Path(folder) if folder else GENERATED / name
    if folder is None and not _made(place, motion.info.get("content_hash")):
        raise ViewError(
            f"model: {place} is not what this motion of {name!r} was made with: give its generated "
            "folder, --folder FOLDER"
        )
    baked = read_manifest(place)["scene"]["baked"]
    return load(place, None if baked else independent(motion.info.get("parameters", {})))


def _made(folder: Path, content: object) -> bool:
    """Tell whether a folder is there and has this content."""
    try:
        return bool(read_manifest(folder)["content_hash"] == content)
    except ModelError:
        return False
