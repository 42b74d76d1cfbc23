"""Compiles the C of a model into a shared library, or finds it in the cache."""

from __future__ import annotations

import contextlib
import hashlib
import os
import shlex
import subprocess
from collections.abc import Iterator, Sequence
from pathlib import Path

from ..errors import CompileFailed, ModelError, SerpentailError
from .cache import REMEDY_CACHE, cache_folder, digest, library_name, temporary_file, trusted
from .toolchain import Toolchain, check_profile, examine, recall, run_command, run_commands

SHARED_FLAGS = ("-fPIC", "-shared")
LONGEST_REPORT = 6000  # characters of a compiler's output that an error shows
REMEDY_FAILED = (
    "Generate the model again if its files were edited; else try another compiler with CC=..."
)


def compile_library(
    sources: Sequence[Path], include: Path, profile: str = "fast", cache: Path | None = None
) -> Path:
    """Return the shared library of sources and headers, compiled unless the cache has it.

    `profile` is "fast" or "reproducible"; `cache` defaults to $SERPENTAIL_CACHE, then the user's
    cache. Raises CompilerNotFound, CompileFailed, ModelError (unreadable sources), SerpentailError
    (profile, cache).
    """
    check_profile(profile)
    folder = cache_folder(cache)
    text = _text_digest(sources, include)
    noted = recall(profile, folder)
    library = trusted(folder / _key(text, noted)) if noted else None
    if library:
        return library
    # A note may describe a compiler since upgraded behind a wrapper, so nothing is built on
    # its word.
    toolchain = examine(profile, folder)
    return trusted(folder / _key(text, toolchain)) or _build(
        sources, include, text, toolchain, folder
    )


def describe_compiler(profile: str = "fast") -> dict[str, object]:
    """Return the command (less its folder), version and flags that `compile_library` would use."""
    check_profile(profile)
    toolchain = examine(profile, cache_folder(None))
    return {
        "command": shlex.join(_public_command(toolchain.command)),
        "version": toolchain.version.splitlines()[0],
        "flags": [*toolchain.flags, *SHARED_FLAGS],
    }


def _text_digest(sources: Sequence[Path], include: Path) -> str:
    """Return the digest of the sources, in order, and of the headers that they can reach."""
    if not sources or not include.is_dir():
        raise ModelError(f"no sources, or no header folder {include}; generate the model again")
    try:
        named = [(path.name, path) for path in sources] + list(_headers(sources, include))
        return digest(
            [(name, hashlib.sha256(path.read_bytes()).hexdigest()) for name, path in named]
        )
    except OSError as error:
        raise ModelError(
            f"cannot read {error.filename}: {error.strerror}; generate it again"
        ) from error


def _headers(sources: Sequence[Path], include: Path) -> Iterator[tuple[str, Path]]:
    """Yield name and path of the headers below `include` and beside the sources, sorted."""
    for path in sorted(include.rglob("*.h")):
        yield path.relative_to(include).as_posix(), path
    for folder in dict.fromkeys(path.parent for path in sources):
        for path in sorted(folder.glob("*.h")):
            yield f"./{path.name}", path


def _key(text: str, toolchain: Toolchain) -> str:
    """Return the digest of the C text and of all that its machine code depends on."""
    command = _public_command((os.path.realpath(toolchain.command[0]), *toolchain.command[1:]))
    flags = (*toolchain.flags, *SHARED_FLAGS)
    return digest([text, command, toolchain.version, flags, toolchain.target, _c_library()])


def _public_command(command: tuple[str, ...]) -> tuple[str, ...]:
    """Return `command` with the folder of its program left out."""
    return (os.path.basename(command[0]), *command[1:])


def _c_library() -> str:
    """Return the C library's version: what is linked to a newer one may not load with an older."""
    with contextlib.suppress(AttributeError, ValueError, OSError):
        return os.confstr("CS_GNU_LIBC_VERSION") or ""
    return ""


def _build(
    sources: Sequence[Path], include: Path, text: str, toolchain: Toolchain, folder: Path
) -> Path:
    """Compile into a file of our own; one rename then shows others the whole library."""
    place = folder / _key(text, toolchain)
    try:
        with temporary_file(folder) as part:
            _compile(sources, include, toolchain, part)
            if _text_digest(sources, include) != text:
                raise ModelError(f"{sources[0].parent} changed while it was compiled; run again")
            library = place / library_name(part)
            place.mkdir(exist_ok=True)
            return part.replace(library)
    except OSError as error:
        reason = error.strerror or str(error)
        message = f"cannot write to the cache of compiled models {folder}: {reason}; {REMEDY_CACHE}"
        raise SerpentailError(message) from error


def _compile(sources: Sequence[Path], include: Path, toolchain: Toolchain, part: Path) -> None:
    """Compile the sources at the same time and link them into `part`, or raise CompileFailed."""
    compiler = (*toolchain.command, *toolchain.flags)
    with contextlib.ExitStack() as objects:
        # one object for each source
        files = [str(objects.enter_context(temporary_file(part.parent, ".o"))) for _ in sources]
        headers = ("-fPIC", "-I", str(include.absolute()))
        commands = [
            (*compiler, *headers, "-c", str(source.absolute()), "-o", file)
            for source, file in zip(sources, files, strict=True)
        ]
        for command, finished in zip(commands, run_commands(commands), strict=True):
            if finished.returncode:
                raise _failure(command, finished)

        # the library
        command = (*compiler, *SHARED_FLAGS, *files, "-o", str(part), "-lm")
        finished = run_command(command)
        if finished.returncode or not part.is_file() or part.stat().st_size == 0:
            raise _failure(command, finished)


def _failure(command: tuple[str, ...], finished: subprocess.CompletedProcess[str]) -> CompileFailed:
    """Return the error that shows the command and the compiler's own words."""
    words = _trimmed(finished.stderr.strip() or "the compiler said nothing and wrote no library")
    outcome = f"the C compiler failed with exit code {finished.returncode}"
    error = CompileFailed(f"{outcome}\n{words}\nCommand: {shlex.join(command)}\n{REMEDY_FAILED}")
    error.command, error.returncode, error.stderr = command, finished.returncode, finished.stderr
    return error


def _trimmed(text: str) -> str:
    """Return `text` with its middle left out where it is too long to read."""
    half = LONGEST_REPORT // 2
    if len(text) <= LONGEST_REPORT:
        return text
    return f"{text[:half]}\n[... {len(text) - 2 * half} characters left out ...]\n{text[-half:]}"
