"""Runs the generator in its own process, and keeps its models in the cache.

This package imports neither the generator nor its libraries.
"""

import os
import sys
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from serpentail_scene.digest import GENERATOR, generator_digest

from ..basics.errors import ModelError
from ..basics.progress import Stage
from ..compiling.cache import (
    BUILDS,
    alone,
    cache_folder,
    digest,
    read_note,
    workshop,
    write_note,
)
from ..compiling.commands import run_all
from ..model.manifest import CheckedFolder, in_cache, read_folder, snapshot
from ..model.parameters import merged
from .scene_text import scene_text

REMEDY = "pip install serpentail, or generate where it is and give the folder to st.load"


def generated(scene: Mapping[str, Any], name: str, given: Mapping[str, object]) -> CheckedFolder:
    """Return the checked files of a scene's model, generated unless the cache has them.

    given: parameters for the load, which are checked before a generation.
    """
    text, cache = scene_text(scene), cache_folder()
    try:
        key = digest([generator_digest(), name, text])
    except ModuleNotFoundError as error:
        raise _without(error.name) from error
    stored = in_cache(read_note(cache, BUILDS, key), cache)
    if stored:
        return stored
    loaded = {**scene, "parameters": merged(scene.get("parameters", {}), given)} if given else scene
    loaded_text = scene_text(loaded)
    with alone(cache, key):
        stored = in_cache(read_note(cache, BUILDS, key), cache)
        return stored or _made(cache, key, name, text, loaded_text)


def _made(cache: Path, key: str, name: str, text: str, loaded: str) -> CheckedFolder:
    """Generate the model of a text, and store it under a key; ``loaded`` is only checked."""
    with workshop(cache) as part:
        scene, given = part / f"{name}.toml", part / "given" / f"{name}.toml"
        given.parent.mkdir()
        scene.write_text(text, encoding="utf-8")
        given.write_text(loaded, encoding="utf-8")
        checked = read_folder(generate(scene, part / "made", given))
    place = snapshot(checked, cache)
    write_note(cache, BUILDS, key, checked.manifest_hash)
    return replace(checked, folder=place)


def generate(scene: Path, output: Path, given: Path | None = None) -> Path:
    """Generate the model of a scene file below a folder, and return the model's own folder.

    given: the scene with the parameters for the load, which are checked before. ModelError has the
    generator's message if it refuses a scene.
    """
    progress = output.with_name("progress")
    options = ["--output", output, "--progress", progress]
    options += [] if given is None else ["--given", given]
    with Stage("derive", scene.stem) as stage:
        words = [*command(), *map(str, options), "--", str(scene)]
        done = run_all([words], os.environ, lambda: _report(stage, progress))[0]
    folders = [path.parent for path in output.glob("*/manifest.json")]
    if done.returncode or len(folders) != 1:
        ended = f"the generator ended with status {done.returncode} (below 0: a signal)"
        message = (done.stderr or done.stdout).strip() or f"{ended}: is there memory for it?"
        for path in (scene, given):
            message = message.replace(f"{path}", scene.name)
        raise ModelError(f"{scene.stem} could not be generated: {message}")
    return folders[0]


def command() -> list[str]:
    """Return the command of the generator, without its arguments."""
    if find_spec(GENERATOR) is None:
        raise _without(GENERATOR)
    return [sys.executable, "-P", "-m", GENERATOR]  # -P: do not import from the working folder


def _without(package: str | None) -> ModelError:
    return ModelError(f"no model can be generated without the package {package}: {REMEDY}")


def _report(stage: Stage, progress: Path) -> None:
    """Report the progress that the generator has written down."""
    with suppress(OSError, ValueError):
        part, function = progress.read_text().split()
        return stage.tell(float(part), f"{stage.subject}: {function}")
    return stage.tell()
