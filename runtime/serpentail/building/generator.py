"""Runs the generator in its own process: this package imports neither it nor its libraries."""

import os
import sys
from contextlib import suppress
from importlib.util import find_spec
from pathlib import Path

from serpentail_scene.digest import GENERATOR, generator_digest

from ..basics.errors import ModelError
from ..basics.progress import Stage
from ..compiling.commands import run_all

REMEDY = "pip install serpentail, or generate where it is and give the folder to st.load"


def identity() -> str:
    """Return a digest of all that generated text depends on besides the scene.

    ModelError without a generator.
    """
    try:
        return generator_digest()
    except ModuleNotFoundError as error:
        raise ModelError(f"no model can be generated without {error.name}: {REMEDY}") from error


def generate(scene: Path, output: Path, given: Path) -> Path:
    """Generate the model of a scene file below a folder, and return the model's own folder.

    given: the scene with the parameters for the load, which are checked before. ModelError has the
    generator's message if it refuses a scene.
    """
    noted = output.with_name("progress")
    options = ["--output", str(output), "--progress", str(noted), "--given", str(given)]
    with Stage("derive", scene.stem) as stage:
        done = run_all(
            [[*command(), *options, "--", str(scene)]], os.environ, lambda: _tell(stage, noted)
        )[0]
    folders = [path.parent for path in output.glob("*/manifest.json")]
    if done.returncode or len(folders) != 1:
        words = (done.stderr or done.stdout).strip()
        for path in (scene, given):
            words = words.replace(f"{path}", scene.name)
        raise ModelError(f"{scene.stem} could not be generated: {words}")
    return folders[0]


def command() -> list[str]:
    """Return the command of the generator, without its arguments."""
    if find_spec(GENERATOR) is None:
        raise ModelError(f"no model can be generated without {GENERATOR}: {REMEDY}")
    return [sys.executable, "-P", "-m", GENERATOR]  # -P: do not import from the working folder


def _tell(stage: Stage, noted: Path) -> None:
    """Report the progress that the generator has written down."""
    with suppress(OSError, ValueError):
        part, function = noted.read_text().split()
        return stage.tell(float(part), f"{stage.subject}: {function}")
    return stage.tell()
