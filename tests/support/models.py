"""Generated models for tests, each generated once for all tests, processes and runs.

They are in ``.build/models/<digest of the generator>/<digest of the scene>``, so that a change of
the generator makes all of them again. No test writes to them: a test that must takes a copy.
"""

import hashlib
import json
import os
import shlex
import shutil
import time
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

from serpentail_codegen.pipeline import generate
from serpentail_codegen.scene.parse import scene_for
from serpentail_codegen.scene.scene import Scene
from serpentail_scene.digest import generator_digest

BUILD = Path(__file__).parents[2] / ".build"
QUICK = shlex.quote(str(Path(__file__).with_name("cc_quick")))
KEPT = 3600.0  # s: models of another generator stay that long, because its tests may still run


def choose_compiler(quick: bool) -> None:
    """Let all processes share one cache, and compile without optimisation unless CC is set."""
    os.environ["SERPENTAIL_CACHE"] = str(BUILD / "cache")  # not the developer's own
    if quick:
        os.environ.setdefault("CC", QUICK)


def model_folder(segments: int, links: int | None, **options) -> Path:
    """Return the generated folder of an articulated tail, or of a continuum without ``links``."""
    return _of_options(segments, links, json.dumps(options, sort_keys=True))


@cache
def _of_options(segments: int, links: int | None, options: str) -> Path:
    kind = "articulated" if links else "continuum"
    return folder_of(scene_for(kind, segments, links, **json.loads(options)))


def folder_of(scene: Scene) -> Path:
    """Return the generated folder of a scene."""
    place = shelf() / digest(repr(scene))
    if not place.exists():
        # One rename publishes the whole folder; the second process deletes its own.
        with TemporaryDirectory(dir=shelf(), prefix=".") as temporary:
            own = Path(temporary) / "made"
            generate(scene, own)
            try:
                own.rename(place)
            except OSError:
                if not place.exists():
                    raise
    return place / scene.name


@cache
def shelf() -> Path:
    """Return the folder of all models of this generator, and delete those of earlier ones."""
    own = BUILD / "models" / generator_digest()[:32]
    own.mkdir(parents=True, exist_ok=True)
    os.utime(own)
    for other in own.parent.iterdir():
        if time.time() - other.stat().st_mtime > KEPT:
            shutil.rmtree(other, ignore_errors=True)
    return own


def digest(text: str) -> str:
    """Return a name for a text."""
    return hashlib.sha256(text.encode()).hexdigest()[:32]
