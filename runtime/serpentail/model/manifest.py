"""Reads a generated folder whole, and checks its files against the manifest among them.

The cache has snapshots of such folders, in which pickled models and saved motions find theirs.
"""

import hashlib
import json
import os
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path, PurePosixPath
from types import ModuleType

from .. import __version__
from ..basics.errors import ModelError, SerpentailError
from ..compiling.cache import (
    MODELS,
    cache_folder,
    mark_used,
    publish,
    refuse_others,
    regular_bytes,
    workshop,
)
from .lazy import lazy_property

FORMAT = 2
KEYS = ["prefix", "real", "scene", "dimensions", "parameters", "functions"]
KEYS += ["files", "manifest_hash"]
C_KEYS = ["abi_hash", "work", "batch"]  # of models with C
MOST_READS = 100  # of a folder that is exchanged again and again while it is read


@dataclass(frozen=True, eq=False)
class CheckedFolder:
    """A generated folder as it was when it was checked; later changes of the folder do not matter.

    files: the content of each file that the manifest names, by that name.
    """

    folder: Path
    manifest: dict
    files: Mapping[str, bytes]

    @property
    def manifest_hash(self) -> str:
        """Digest of the manifest, which covers all files."""
        return str(self.manifest["manifest_hash"])

    @lazy_property
    def casadi_module(self) -> ModuleType:
        """The generated module of CasADi functions, executed from the text that was checked."""
        name = f"{self.manifest['prefix']}_casadi"
        module = ModuleType(name)
        exec(compile(self.files[f"{name}.py"], f"<{name}.py>", "exec"), module.__dict__)
        return module

    def contents(self) -> dict[str, bytes]:
        """Return the files of a copy; equal manifests, however laid out, give the same text."""
        manifest = json.dumps(self.manifest, sort_keys=True).encode()
        return {**self.files, "manifest.json": manifest}


def read_folder(folder: Path) -> CheckedFolder:
    """Return a folder's manifest and files; ModelError if one is missing, stale or changed."""
    for _ in range(MOST_READS):
        before = _identity(folder)
        try:
            return _checked(folder)
        except ModelError:
            if _identity(folder) == before:
                raise  # else another folder came in its place meanwhile
    raise ModelError(f"{folder} keeps changing while it is read: load it later")


def _identity(folder: Path) -> tuple[int, ...]:
    """Return what tells whether a path leads to another folder than before."""
    try:
        status = os.stat(folder)
    except (OSError, ValueError):
        return ()
    return status.st_dev, status.st_ino, status.st_mtime_ns, status.st_ctime_ns


def remedy(folder: Path) -> str:
    """Return how to generate a folder again, for messages."""
    return (
        f"delete {folder} and generate it again (`make model`, or python "
        f"-m serpentail_codegen SCENE.toml)"
    )


def _checked(folder: Path) -> CheckedFolder:
    """Return the manifest and the files that it names, each read once."""
    path = folder / "manifest.json"
    try:
        text = regular_bytes(path)
    except (FileNotFoundError, NotADirectoryError, ValueError) as error:
        raise ModelError(
            f"{folder} is not a generated folder (it has no manifest.json): make one by "
            "`serpentail generate SCENE.toml`, or `make model TAIL=articulated M=3 N=4`"
        ) from error
    except OSError as error:
        raise _unreadable(folder, path, error) from error
    try:
        manifest = json.loads(text.decode())
        _check(folder, manifest)
        digests = dict(manifest["files"])
        for name in digests:
            if os.path.isabs(name) or ".." in PurePosixPath(name).parts or "\0" in name:
                raise ValueError(f"the file name {name!r} leads out of the folder")
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
        raise ModelError(f"{path} is damaged ({error}): {remedy(folder)}") from error
    files = {}
    for name, digest in digests.items():
        try:
            files[name] = regular_bytes(folder / name)
        except OSError as error:
            raise _unreadable(folder, folder / name, error) from error
        if hashlib.sha256(files[name]).hexdigest() != digest:
            raise ModelError(
                f"{folder / name} was changed after it was generated: {remedy(folder)}"
            )
    return CheckedFolder(folder, manifest, files)


def _unreadable(folder: Path, path: Path, error: OSError) -> ModelError:
    return ModelError(f"{path!s:.200} cannot be read ({error.strerror}): {remedy(folder)}")


def _check(folder: Path, manifest: dict) -> None:
    """Refuse a manifest of another version, without some keys, or changed."""
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
    content = json.dumps(entries, sort_keys=True).encode()
    if hashlib.sha256(content).hexdigest() != manifest["manifest_hash"]:
        raise ModelError(
            f"{folder / 'manifest.json'} was changed after it was generated: {remedy(folder)}; "
            "parameters are changed "
            "by st.load(folder, parameters=...), sizes by another scene"
        )


# Snapshots.


def snapshot(checked: CheckedFolder, cache: Path) -> Path:
    """Return the folder in the cache with a model's files; make it if it is missing or damaged.

    SerpentailError if it cannot be written.
    """
    place = cache / MODELS / checked.manifest_hash
    if in_cache(checked.manifest_hash, cache) is None:
        with workshop(cache) as part:
            model = part / "model"
            model.mkdir(0o700)
            for name, text in checked.contents().items():
                (model / name).parent.mkdir(parents=True, exist_ok=True)
                (model / name).write_bytes(text)
            publish(model, place, lambda: in_cache(checked.manifest_hash, cache) is not None)
    return place


def in_cache(manifest_hash: str | None, cache: Path) -> CheckedFolder | None:
    """Return the snapshot of a manifest; None if the cache does not have it whole."""
    if manifest_hash is None:
        return None
    place = cache / MODELS / manifest_hash
    refuse_others(cache, place.parent, place)
    with suppress(ModelError):
        checked = read_folder(place)
        if checked.manifest_hash == manifest_hash:
            mark_used(place)
            return checked
    return None


def restored(manifest_hash: str, folder: Path) -> CheckedFolder:
    """Return the model with a manifest's hash, from the cache or else from its folder.

    ModelError if neither has it.
    """
    with suppress(SerpentailError):
        checked = in_cache(manifest_hash, cache_folder())
        if checked:
            return replace(checked, folder=folder)
    checked = read_folder(folder)
    if checked.manifest_hash != manifest_hash:
        raise ModelError(
            f"{folder} was generated again since the model was pickled (its manifest was "
            f"{manifest_hash:.12}, now {checked.manifest_hash:.12}), and the cache no longer has "
            "the pickled one: generate it again as it was, or load and pickle the model anew"
        )
    return checked


def links_of(pieces: int | list[int], kinds: tuple[str, ...]) -> int | tuple[int, ...] | None:
    """Return the links of all segments, or of each, 0 of an arc; None of a continuum."""
    if "articulated" not in kinds:
        return None
    if isinstance(pieces, int):
        return pieces
    return tuple(n if kind == "articulated" else 0 for n, kind in zip(pieces, kinds, strict=True))
