"""Reads a generated folder whole, and checks its files against the manifest among them."""

import hashlib
import json
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from types import ModuleType

from .. import __version__
from ..basics.errors import ModelError
from ..compiling.safe_files import Held, held
from .lazy import lazy_property

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


class Exchanged(ModelError):
    """Another folder came in a folder's place while it was read."""


def read_folder(folder: Path) -> CheckedFolder:
    """Return a folder's manifest and files; ModelError if one is missing, stale or changed."""
    for _ in range(MOST_READS - 1):
        with suppress(Exchanged):
            return _read(folder)
    return _read(folder)


def read_manifest(folder: Path) -> dict:
    """Return a folder's manifest, checked as ``read_folder`` does."""
    return read_folder(folder).manifest


def remedy(folder: Path) -> str:
    """Return how to generate a folder again, for messages."""
    return (
        f"delete {folder} and generate it again (`make model`, or python "
        f"-m serpentail_codegen SCENE.toml)"
    )


def _read(folder: Path) -> CheckedFolder:
    """Return the content of a held folder; Exchanged if it was replaced meanwhile."""
    try:
        with held(folder) as opened:
            try:
                return _checked(folder, opened)
            except ModelError as error:
                if opened.is_there():
                    raise
                raise Exchanged(
                    f"{folder} keeps changing while it is read: load it later"
                ) from error
    except (FileNotFoundError, NotADirectoryError, ValueError) as error:
        raise _no_folder(folder) from error
    except OSError as error:
        raise ModelError(
            f"{folder!s:.200} cannot be read ({error.strerror}): give the path of a generated "
            "folder"
        ) from error


def _no_folder(folder: Path) -> ModelError:
    return ModelError(
        f"{folder} is not a generated folder (it has no manifest.json): make one by "
        "`serpentail generate SCENE.toml`, or `make model TAIL=articulated M=3 N=4`"
    )


def _unreadable(folder: Path, path: Path, error: OSError) -> ModelError:
    return ModelError(f"{path} cannot be read ({error.strerror}): {remedy(folder)}")


def _checked(folder: Path, opened: Held) -> CheckedFolder:
    """Return the manifest and the files that it names, each read once."""
    path = folder / "manifest.json"
    try:
        text = opened.read(path.name)
    except FileNotFoundError as error:
        raise _no_folder(folder) from error
    except OSError as error:
        raise _unreadable(folder, path, error) from error
    try:
        manifest = json.loads(text.decode())
        _check(folder, manifest)
        names = {name: digest for name, digest in manifest["files"].items() if _inside(name)}
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
        raise ModelError(f"{path} is damaged ({error}): {remedy(folder)}") from error
    return CheckedFolder(folder, manifest, {n: _file(folder, opened, n, names[n]) for n in names})


def _inside(name: str) -> bool:
    """Refuse a name of a file that leads out of its folder."""
    path = PurePosixPath(name)
    if path.is_absolute() or ".." in path.parts or "\0" in name:
        raise ValueError(f"the file name {name!r} leads out of the folder")
    return True


def _file(folder: Path, opened: Held, name: str, digest: str) -> bytes:
    """Return a file's content, which must have this digest."""
    path = folder / name
    try:
        content = opened.read(name)
    except OSError as error:
        raise _unreadable(folder, path, error) from error
    if _sha256(content) != digest:
        raise ModelError(f"{path} was changed after it was generated: {remedy(folder)}")
    return content


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
    if _sha256(json.dumps(entries, sort_keys=True).encode()) != manifest["manifest_hash"]:
        raise ModelError(
            f"{folder / 'manifest.json'} was changed after it was generated: {remedy(folder)}; "
            "parameters are changed "
            "by st.load(folder, parameters=...), sizes by another scene"
        )


def _sha256(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()


def links_of(pieces: int | list[int], kinds: tuple[str, ...]) -> int | tuple[int, ...] | None:
    """Return the links of all segments, or of each, 0 of an arc; None of a continuum."""
    if "articulated" not in kinds:
        return None
    if isinstance(pieces, int):
        return pieces
    return tuple(n if kind == "articulated" else 0 for n, kind in zip(pieces, kinds, strict=True))
