"""Reads the manifest of a generated folder, and checks it against the files beside it."""

import hashlib
import json
from pathlib import Path

from .. import __version__
from ..errors import ModelError

FORMAT = 2
KEYS = [
    "prefix",
    "real",
    "scene",
    "dimensions",
    "parameters",
    "functions",
    "files",
    "manifest_hash",
]
C_KEYS = ["abi_hash", "work", "batch"]  # of models with C


def read_manifest(folder: Path) -> dict:
    """Return a folder's manifest; ModelError where it is missing, stale or unlike the files."""
    path = folder / "manifest.json"
    if not path.is_file():
        raise ModelError(
            f"{folder} is no generated folder (it has no manifest.json): make one, as by `make "
            "model TAIL=articulated "
            "M=3 N=4`, or python -m serpentail_codegen SCENE.toml"
        )
    try:
        manifest = json.loads(path.read_text(encoding="utf-8"))
        _check(folder, manifest)
    except (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
        raise ModelError(f"{path} is damaged ({error}): {remedy(folder)}") from error
    return manifest


def remedy(folder: Path) -> str:
    """Say how to make a folder anew."""
    return (
        f"delete {folder} and generate it again (`make model`, or python "
        f"-m serpentail_codegen SCENE.toml)"
    )


def _check(folder: Path, manifest: dict) -> None:
    """Refuse a manifest of another version, one that lacks keys, and one or files that changed."""
    if (manifest["format"], manifest["generator"]) != (FORMAT, __version__):
        made = f"format {manifest['format']}, generator {manifest['generator']}"
        raise ModelError(
            f"{folder} is stale: made by {made}, this is format {FORMAT}, {__version__}: "
            f"{remedy(folder)}"
        )
    needed = KEYS + (C_KEYS if "c" in manifest["scene"]["targets"] else [])
    absent = [key for key in needed if key not in manifest]
    if absent:
        raise ValueError(f"it lacks {', '.join(absent)}")
    entries = {key: value for key, value in manifest.items() if key != "manifest_hash"}
    if _sha256(json.dumps(entries, sort_keys=True).encode()) != manifest["manifest_hash"]:
        raise ModelError(
            f"{folder / 'manifest.json'} was changed after it was generated: {remedy(folder)}; "
            "parameters are changed "
            "by st.load(folder, parameters=...), sizes by another scene"
        )
    for name, digest in manifest["files"].items():
        path = folder / name
        try:
            content = path.read_bytes()
        except OSError as error:
            reason = error.strerror
            raise ModelError(f"{path} cannot be read ({reason}): {remedy(folder)}") from error
        if _sha256(content) != digest:
            raise ModelError(f"{path} was changed after it was generated: {remedy(folder)}")


def _sha256(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()
