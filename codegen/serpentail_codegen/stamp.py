"""Decides by hashes whether a generated folder is up to date with its scene.

Modification times would mislead: a scene file that is restored is older than the folder that was
made from another version of it.
"""

import hashlib
import json
import sys
from importlib.util import find_spec
from pathlib import Path

from .scene.parse import scene_to_dict
from .scene.scene import Scene

TOOLS = ("sympy", "jinja2")  # packages: another version of one may print another text


def key_of(scene: Scene) -> str:
    """Return the hash of everything that a scene's folder depends on: scene, generator, tools."""
    home = Path(__file__).parent
    sources = sorted(path for path in home.rglob("*") if path.suffix in (".py", ".jinja"))
    tools = [sys.version, *(name for tool in TOOLS for name in _installed(tool))]
    named = [(str(path.relative_to(home)), _digest(path.read_bytes())) for path in sources]
    return _digest(json.dumps([scene_to_dict(scene), tools, named], sort_keys=True).encode())


def _installed(tool: str) -> list[str]:
    """Return a package's name and version; importlib.metadata would take 30 ms for this."""
    found = find_spec(tool)
    if found is None or found.origin is None:
        return []
    return sorted(path.name for path in Path(found.origin).parents[1].glob(f"{tool}-*-info"))


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
