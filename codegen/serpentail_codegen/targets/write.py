"""Writes a generated folder: only files whose text changed, the manifest with its hashes last."""

import hashlib
import json
import os
from pathlib import Path


def digest(text: str) -> str:
    """Return the SHA-256 of a text."""
    return hashlib.sha256(text.encode()).hexdigest()


def signed(manifest: dict) -> dict:
    """Return a manifest with the SHA-256 of its other entries, which shows a change by hand."""
    entries = {key: value for key, value in manifest.items() if key != "manifest_hash"}
    return entries | {"manifest_hash": digest(json.dumps(entries, sort_keys=True))}


def write_if_changed(path: Path, text: str) -> bool:
    """Write a file atomically unless it holds the text already; return whether it was written."""
    if path.is_file() and path.read_bytes() == text.encode():
        return False
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(f".{path.name}.{os.getpid()}")
    temporary.write_bytes(text.encode())
    os.replace(temporary, path)
    return True


def write_folder(folder: Path, files: dict[str, str], manifest: dict) -> list[str]:
    """Write all files, the manifest last; drop earlier ones; return the changed names."""
    manifest = signed(
        manifest | {"files": {name: digest(text) for name, text in sorted(files.items())}}
    )
    changed = [name for name, text in files.items() if write_if_changed(folder / name, text)]
    _remove_stale(folder, set(files))
    text = json.dumps(manifest, indent=1, ensure_ascii=False) + "\n"
    return changed + (["manifest.json"] if write_if_changed(folder / "manifest.json", text) else [])


def _remove_stale(folder: Path, names: set[str]) -> None:
    try:
        earlier = set(json.loads((folder / "manifest.json").read_text())["files"])
    except (OSError, ValueError, KeyError, TypeError):
        return
    for name in earlier - names:
        target = (folder / name).resolve()
        if folder.resolve() in target.parents:
            target.unlink(missing_ok=True)
