"""Compiles the C of a model into a shared library, or finds it in the cache."""

from __future__ import annotations

import contextlib
import ctypes
import hashlib
import logging
import os
import shlex
import subprocess
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from ..basics.errors import CompileFailed, ModelError, SerpentailError
from ..basics.progress import Stage
from .cache import (
    LIBRARIES,
    cache_folder,
    digest,
    library_in,
    library_name,
    publish,
    refuse_open,
    refuse_others,
    unwritable,
    workshop,
)
from .cache_limit import bound, limit
from .locks import alone
from .safe_files import regular_bytes
from .toolchain import (
    Toolchain,
    check_profile,
    examine,
    kept_surroundings,
    recall,
    run_command,
    run_commands,
)

Places = tuple[Sequence[Path], Path]  # sources, and the folder of their headers

SHARED_FLAGS = ("-fPIC", "-shared")
LONGEST_REPORT = 6000  # characters of a compiler's output that an error shows
REMEDY_FAILED = (
    "Generate the model again if its files were edited; else try another compiler with CC=..."
)


def compile_library(
    sources: Sequence[Path],
    include: Path,
    profile: str = "fast",
    cache: Path | None = None,
    flags: tuple[str, ...] = (),
) -> Path:
    """Return the shared library of sources and headers; compile it unless it is in the cache.

    `profile` is "fast" or "reproducible"; `cache` defaults to $SERPENTAIL_CACHE, then the user's
    cache; `flags` are added to the profile's. Raises CompilerNotFound, CompileFailed, ModelError
    (unreadable sources), SerpentailError (profile, cache).
    """
    text = _text_of(sources, include)
    return library_of(text, lambda: (sources, include), profile, cache_folder(cache), flags)


def library_of(
    text: str,
    places: Callable[[], Places],
    profile: str,
    cache: Path,
    flags: tuple[str, ...] = (),
) -> Path:
    """Return the library of texts with this digest; their folder is read only to compile them.

    flags: added to the profile's. One process compiles while others wait for it. Errors as of
    ``compile_library``.
    """
    check_profile(profile)
    refuse_others(cache)
    refuse_open(cache)
    library = noted(text, profile, cache, flags)
    if library:
        return library
    with alone(cache, digest([text, profile])):
        library = noted(text, profile, cache, flags)
        if library:
            return library
        # A note may describe a compiler since upgraded behind a wrapper, so nothing is built on
        # its word.
        toolchain = _joined(examine(profile, cache), flags)
        return library_in(_place(text, toolchain, cache)) or _build(text, places, toolchain, cache)


def opened(compiled: Callable[[], Path], kind: type[ctypes.CDLL] = ctypes.CDLL) -> Any:
    """Return the library whose path a call of this room returns, open.

    One that cannot be loaded is made anew. SerpentailError if that cannot be loaded either, and
    errors as of the call.
    """
    path = compiled()
    with contextlib.suppress(OSError):
        return kind(str(path))
    with contextlib.suppress(OSError):
        path.unlink()
    try:
        return kind(str(compiled()))
    except OSError as error:
        raise SerpentailError(
            f"the compiled model cannot be loaded ({error}): set SERPENTAIL_CACHE"
        ) from error


def noted(text: str, profile: str, cache: Path, flags: tuple[str, ...] = ()) -> Path | None:
    """Return the library by stored notes about the compiler; no process is started."""
    toolchain = recall(profile, cache)
    if toolchain is None:
        return None
    return library_in(_place(text, _joined(toolchain, flags), cache))


def _joined(toolchain: Toolchain, flags: tuple[str, ...]) -> Toolchain:
    """Return a compiler with more flags."""
    return replace(toolchain, flags=toolchain.flags + flags)


def describe_compiler(profile: str = "fast") -> dict[str, object]:
    """Return the command (less its folder), version and flags that `compile_library` would use."""
    check_profile(profile)
    toolchain = examine(profile, cache_folder(None))
    return {
        "command": shlex.join(_public_command(toolchain.command)),
        "version": toolchain.version.splitlines()[0],
        "flags": [*toolchain.flags, *SHARED_FLAGS],
    }


def text_digest(sources: Sequence[tuple[str, str]], headers: Iterable[tuple[str, str]]) -> str:
    """Return the digest of sources, in order, and of the headers that they can include.

    For each it uses the name (of headers as included) and the SHA-256 of the content.
    """
    return digest([*sources, *sorted(headers)])


def _text_of(sources: Sequence[Path], include: Path) -> str:
    """Return the digest of the texts in folders."""
    if not sources or not include.is_dir():
        raise ModelError(f"no sources, or no header folder {include}; generate the model again")
    try:
        return text_digest(
            [(path.name, _sha256(path)) for path in sources],
            [(name, _sha256(path)) for name, path in _headers(sources, include)],
        )
    except OSError as error:
        raise ModelError(
            f"cannot read {error.filename}: {error.strerror}; generate it again"
        ) from error


def _sha256(path: Path) -> str:
    return hashlib.sha256(regular_bytes(path)).hexdigest()


def _headers(sources: Sequence[Path], include: Path) -> Iterator[tuple[str, Path]]:
    """Yield name and path of the headers below `include` and next to the sources."""
    for path in include.rglob("*.h"):
        yield path.relative_to(include).as_posix(), path
    for folder in dict.fromkeys(path.parent for path in sources):
        for path in folder.glob("*.h"):
            yield f"./{path.name}", path


def _place(text: str, toolchain: Toolchain, cache: Path) -> Path:
    """Return the path of the library, named after all that its machine code depends on."""
    command = _public_command((os.path.realpath(toolchain.command[0]), *toolchain.command[1:]))
    flags = (*toolchain.flags, *SHARED_FLAGS)
    machine = (toolchain.version, flags, toolchain.target, kept_surroundings(), _c_library())
    return cache / LIBRARIES / digest([text, command, *machine])


def _public_command(command: tuple[str, ...]) -> tuple[str, ...]:
    """Return `command` with the folder of its program left out."""
    return (os.path.basename(command[0]), *command[1:])


def _c_library() -> str:
    """Return the C library's version, because a library linked to a newer one may not load."""
    with contextlib.suppress(AttributeError, ValueError, OSError):
        return os.confstr("CS_GNU_LIBC_VERSION") or ""
    return ""


def _build(text: str, places: Callable[[], Places], toolchain: Toolchain, cache: Path) -> Path:
    """Compile in a folder of our own; one rename then shows others the whole library."""
    place, most = _place(text, toolchain, cache), limit()
    if os.path.lexists(place):
        logging.getLogger("serpentail").warning("%s was damaged: it is made anew", place)
    sources, include = places()
    try:
        with workshop(cache) as part:
            made, entry = part / "library.part", part / "entry"
            _compile(sources, include, toolchain, made)
            if _text_of(sources, include) != text:
                raise ModelError(f"{sources[0].parent} changed while it was compiled; run again")
            entry.mkdir(0o700)
            made.chmod(0o700)
            name = library_name(made)
            made.rename(entry / name)
            publish(entry, place, library_in)
        bound(cache, most)
        return library_in(place) or place / name
    except OSError as error:
        raise unwritable(cache, error) from error


def _compile(sources: Sequence[Path], include: Path, toolchain: Toolchain, made: Path) -> None:
    """Compile the sources at the same time and link them into `made`, or raise CompileFailed."""
    compiler = (*toolchain.command, *toolchain.flags)
    headers = ("-fPIC", "-I", str(include.absolute()))
    files = [str(made.with_name(f"{k}.o")) for k in range(len(sources))]
    commands = [
        (*compiler, *headers, "-c", str(source.absolute()), "-o", file)
        for source, file in zip(sources, files, strict=True)
    ]
    with Stage("compile", ", ".join(source.name for source in sources)) as stage:
        done = run_commands(commands, stage.tell)
    for command, finished in zip(commands, done, strict=True):
        if finished.returncode:
            raise _failure(command, finished)

    command = (*compiler, *SHARED_FLAGS, *files, "-o", str(made), "-lm")
    finished = run_command(command)
    if finished.returncode or not made.is_file() or made.stat().st_size == 0:
        raise _failure(command, finished)


def _failure(command: tuple[str, ...], finished: subprocess.CompletedProcess[str]) -> CompileFailed:
    """Return the error that shows the command and the compiler's own words."""
    words = _trimmed(finished.stderr.strip() or "the compiler said nothing and wrote no library")
    outcome = f"the C compiler failed with exit code {finished.returncode}"
    error = CompileFailed(f"{outcome}\n{words}\nCommand: {shlex.join(command)}\n{REMEDY_FAILED}")
    error.command, error.returncode, error.stderr = command, finished.returncode, finished.stderr
    return error


def _trimmed(text: str) -> str:
    """Return `text`, without its middle if it is too long to read."""
    half = LONGEST_REPORT // 2
    if len(text) <= LONGEST_REPORT:
        return text
    return f"{text[:half]}\n[... {len(text) - 2 * half} characters left out ...]\n{text[-half:]}"
