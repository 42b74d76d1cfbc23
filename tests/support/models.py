"""Generated models for tests: a tail's sizes and a scene's options go in, a folder comes out, made
once a process.
"""

import atexit
import json
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

from serpentail_codegen.pipeline import generate
from serpentail_codegen.scene.parse import scene_for


@cache
def parent() -> Path:
    """Return a temporary folder that is deleted when the process ends."""
    folder = TemporaryDirectory(prefix="serpentail_models_")
    atexit.register(folder.cleanup)
    return Path(folder.name)


def model_folder(segments: int, links: int | None, **options) -> Path:
    """Return the generated folder of an articulated tail, or of a continuum where ``links`` is
    None.
    """
    return _made(segments, links, json.dumps(options, sort_keys=True))


@cache
def _made(segments: int, links: int | None, options: str) -> Path:
    scene = scene_for(
        "articulated" if links else "continuum", segments, links, **json.loads(options)
    )
    folder = parent() / str(sum(1 for _ in parent().iterdir()))
    generate(scene, folder)
    return folder / scene.name
