"""Writes a generated folder, whole or not at all, with a manifest of the files' hashes."""

import hashlib
import json
import os
from pathlib import Path

from ..scene.problems import Problem, SceneError
from .exchange import holds, pinned, replace_folder, sweep

MANIFEST = "manifest.json"


def digest(text: str) -> str:
    """Return the SHA-256 of a text."""
    return hashlib.sha256(text.encode()).hexdigest()


def signed(manifest: dict) -> dict:
    """Return a manifest with the SHA-256 of its other entries, which reveals a change by hand."""
    entries = {key: value for key, value in manifest.items() if key != "manifest_hash"}
    return entries | {"manifest_hash": digest(json.dumps(entries, sort_keys=True))}


def write_folder(folder: Path, files: dict[str, str], manifest: dict) -> list[str]:
    """Write all files and the manifest, delete earlier ones, and return the changed names.

    Nothing is written if nothing changed. Files that no manifest names stay. SceneError if the
    folder cannot be written; then it stays unchanged.
    """
    listed = {"files": {name: digest(text) for name, text in sorted(files.items())}}
    described = json.dumps(signed(manifest | listed), indent=1, ensure_ascii=False) + "\n"
    contents = {name: text.encode() for name, text in {**files, MANIFEST: described}.items()}
    place = Path(os.path.realpath(folder))  # the target of a link is exchanged, not the link
    try:
        sweep(place.parent)
        return _written(place, contents)
    except OSError as error:
        reason = f"cannot be written ({error.strerror or error}); choose a folder that can"
        raise SceneError([Problem("generated folder", str(folder), reason)]) from error


def _written(folder: Path, contents: dict[str, bytes]) -> list[str]:
    """Write all files; return the names of those that differed."""
    while True:  # again if another process was quicker
        with pinned(folder) as same:
            changed = [name for name in contents if not holds(folder / name, contents[name])]
            if not changed or replace_folder(folder, contents, _named(folder), same):
                return changed


def _named(folder: Path) -> set[str]:
    """Return the names in the folder's manifest; none where it is damaged."""
    try:
        return {MANIFEST, *json.loads((folder / MANIFEST).read_text(encoding="utf-8"))["files"]}
    except (FileNotFoundError, ValueError, KeyError, TypeError, RecursionError):
        return set()
