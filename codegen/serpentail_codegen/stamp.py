"""Decides by hashes whether a generated folder is up to date with its scene.

Modification times would mislead: a scene file that is restored is older than the folder that was
made from another version of it.
"""

import hashlib
import json
from pathlib import Path

from serpentail_scene.digest import generator_digest

from .scene.parse import scene_to_dict
from .scene.scene import Scene


def key_of(scene: Scene) -> str:
    """Return the hash of everything that a scene's folder depends on."""
    depends = [scene_to_dict(scene), generator_digest()]
    return _digest(json.dumps(depends, sort_keys=True).encode())


def is_made(folder: Path, key: str) -> bool:
    """Tell whether a folder was generated under this key, and none of its files changed since."""
    try:
        return _place(folder).read_text() == key + _contents(folder)
    except (OSError, ValueError, KeyError, TypeError):
        return False


def note(folder: Path, key: str) -> None:
    """Record that a folder was generated under this key."""
    place = _place(folder)
    place.parent.mkdir(exist_ok=True)
    place.write_text(key + _contents(folder))


def _place(folder: Path) -> Path:
    """Return the path of a folder's stamp. It is beside the folder, which holds only generated
    files.
    """
    return folder.parent / ".stamps" / folder.name


def _contents(folder: Path) -> str:
    """Return the hash of a folder's manifest and of all files that it names."""
    manifest = (folder / "manifest.json").read_bytes()
    names = json.loads(manifest)["files"]
    return _digest(manifest + b"".join((folder / name).read_bytes() for name in names))


def _digest(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()
