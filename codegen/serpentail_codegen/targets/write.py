"""Writes a generated folder, whole or not at all, with a manifest of the files' hashes.

The new folder is made beside the old one, and one rename exchanges them: a reader sees the old
model or the new one, also if the process is killed. If the system or the file system (NFS, for
example) cannot exchange folders, there are two renames, and the place is empty between them.
Only what replaces a folder waits for the disk: where none was, a loss of power can lose none.
"""

import ctypes
import errno
import hashlib
import json
import os
import re
import secrets
import shutil
import sys
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path

from serpentail_scene.posix import lock, opened_folder, synchronise

from ..scene.problems import Problem, SceneError

MANIFEST = "manifest.json"
PART = re.compile(r"\.serpentail-[0-9a-f]{24}\.part")
LOST_S = 600.0  # s; an older temporary folder is from a process that was killed
OCCUPIED = (errno.ENOTEMPTY, errno.EEXIST)
NO_EXCHANGE = (errno.ENOSYS, errno.EINVAL, errno.ENOTSUP, errno.EOPNOTSUPP)
WORKING_FOLDER, EXCHANGE = -100, 2  # AT_FDCWD; RENAME_EXCHANGE of Linux, RENAME_SWAP of macOS


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
        place.parent.mkdir(parents=True, exist_ok=True)
        with _alone(place.parent):
            _sweep(place.parent)
            changed = [name for name, content in contents.items() if not _has(place, name, content)]
            if changed:
                _replace(place, contents, changed)
    except OSError as error:
        reason = f"cannot be written ({error.strerror or error}); choose a folder that can"
        raise SceneError([Problem("generated folder", str(folder), reason)]) from error
    return changed


@contextmanager
def _alone(parent: Path) -> Iterator[None]:
    """Let other generations into the same parent wait, where its file system has locks."""
    with opened_folder(parent) as handle:
        with suppress(OSError):
            if handle is not None:
                lock(handle)
        yield


def _sweep(parent: Path) -> None:
    """Delete the temporary folders of killed processes."""
    with suppress(OSError):
        for path in parent.iterdir():
            if PART.fullmatch(path.name) and time.time() - path.lstat().st_mtime > LOST_S:
                shutil.rmtree(path, ignore_errors=True)


def _has(folder: Path, name: str, content: bytes) -> bool:
    """Tell whether a folder has a file of this content."""
    try:
        return (folder / name).is_file() and (folder / name).read_bytes() == content
    except OSError:
        return False


def _replace(folder: Path, contents: Mapping[str, bytes], changed: list[str]) -> None:
    """Put a folder with these files in place of an earlier one, whose user's files come along."""
    beside, earlier, replaces = _name_beside(folder), _earlier(folder), folder.exists()

    def ours(place: str, names: list[str]) -> list[str]:
        inside = os.path.relpath(place, folder)
        paths = {name: os.path.normpath(os.path.join(inside, name)) for name in names}
        return [name for name in names if paths[name] in earlier or paths[name] in contents]

    try:
        with suppress(FileNotFoundError):  # there is no folder yet
            shutil.copytree(folder, beside, symlinks=True, ignore=ours, copy_function=_link)
        for name, content in contents.items():
            path = beside / name
            path.parent.mkdir(parents=True, exist_ok=True)
            if name in changed:
                with open(path, "xb") as file:
                    file.write(content)
                    if replaces:
                        file.flush()
                        os.fsync(file.fileno())
            else:  # it keeps its time, by which `make` goes
                _link(folder / name, path)
        # folders that only earlier files of ours were in
        for name in earlier - contents.keys():
            with suppress(OSError):
                os.removedirs((beside / name).parent)
        for place in {beside, *((beside / name).parent for name in contents)} if replaces else ():
            synchronise(place)
        _swap(beside, folder)
        if replaces:
            synchronise(folder.parent)
    finally:
        shutil.rmtree(beside, ignore_errors=True)  # the old folder by now


def _name_beside(folder: Path) -> Path:
    return folder.with_name(f".serpentail-{secrets.token_hex(12)}.part")


def _link(source: str | Path, path: str | Path) -> None:
    """Give a file a second name, or copy it if the file system cannot."""
    with suppress(FileNotFoundError):  # its user deleted it meanwhile
        try:
            os.link(source, path, follow_symlinks=False)
        except FileExistsError:
            raise
        except OSError:
            shutil.copy2(source, path, follow_symlinks=False)


def _earlier(folder: Path) -> set[str]:
    """Return the names of files in the folder's manifest; none where it is damaged."""
    try:
        names = json.loads((folder / MANIFEST).read_text(encoding="utf-8"))["files"]
        return {name for name in names if (folder / name).resolve().is_relative_to(folder)}
    except (FileNotFoundError, ValueError, KeyError, TypeError, RecursionError):
        return set()


def _swap(beside: Path, folder: Path) -> None:
    """Exchange the places of the two; `beside` is the old folder then, or gone."""
    try:
        beside.rename(folder)  # there is no folder, or an empty one
        return
    except OSError as error:
        if error.errno not in OCCUPIED:
            raise
    if _exchange(beside, folder):
        return
    aside = _name_beside(folder)
    folder.rename(aside)
    try:
        beside.rename(folder)
    except OSError:
        aside.rename(folder)
        raise
    aside.rename(beside)


def _exchange(beside: Path, folder: Path) -> bool:
    """Exchange two folders by one rename; False if the system cannot."""
    paths, exchange = (os.fsencode(beside), os.fsencode(folder)), ctypes.c_uint(EXCHANGE)
    try:
        library = ctypes.CDLL(None, use_errno=True)
        if sys.platform == "darwin":
            failed = library.renamex_np(*paths, exchange)
        else:
            here = WORKING_FOLDER
            failed = library.renameat2(here, paths[0], here, paths[1], exchange)
    except (AttributeError, TypeError):  # an older C library; Windows, which has none
        return False
    code = ctypes.get_errno()
    if failed and code not in NO_EXCHANGE:
        raise OSError(code, os.strerror(code), str(folder))
    return not failed
