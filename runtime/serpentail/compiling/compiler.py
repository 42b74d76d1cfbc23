"""Compiles C into a shared library, or finds it in the cache; what was read is what runs."""

from __future__ import annotations

import contextlib
import ctypes
import hashlib
import logging
import os
import shlex
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from ..basics.checks import one_of
from ..basics.errors import CompileFailed, ModelError, SerpentailError
from ..basics.progress import Stage
from .cache import (
    LIBRARIES,
    alone,
    cache_folder,
    digest,
    find,
    refuse_open,
    regular_bytes,
    store,
    workshop,
)
from .cache_limit import keep_within, limit
from .commands import Finished
from .toolchain import (
    PROFILES,
    SHARED_FLAGS,
    Toolchain,
    examine,
    noted_toolchain,
    run_commands,
)

Texts = Mapping[str, bytes]  # sources and headers by paths; headers are searched below include/

LONGEST_REPORT = 6000  # characters of a compiler's output that an error shows
# begins a stage's subject: zig's first link, for which it compiles a C library, takes that long
LAST_RESORT = "by ziglang, half a minute at the first time: "
REMEDY_FAILED = (
    "Generate the model again if its files were edited; else try another compiler with CC=..."
)


def compile_library(
    sources: Sequence[Path],
    include: Path,
    profile: str = "fast",
    flags: tuple[str, ...] = (),
) -> Path:
    """Return the shared library of sources and headers; compile it unless it is in the cache.

    Headers are those below `include` and next to the sources. `profile` is "fast" or
    "reproducible"; `flags` are added to the profile's. Raises CompilerNotFound, CompileFailed,
    ModelError (unreadable sources), SerpentailError (profile, cache).
    """
    return library_of_texts(_read(sources, include), profile, flags)


def library_of_texts(texts: Texts, profile: str = "fast", flags: tuple[str, ...] = ()) -> Path:
    """Return the library of texts; arguments and errors as of ``compile_library``."""
    digests = {name: hashlib.sha256(text).hexdigest() for name, text in texts.items()}
    return library_of(digests, lambda: texts, profile, cache_folder(), flags)


def _read(sources: Sequence[Path], include: Path) -> Texts:
    """Return the texts of sources and of the headers that they can include."""
    if not sources or not include.is_dir():
        raise ModelError(f"no sources, or no header folder {include}; generate the model again")
    paths = {f"include/{p.relative_to(include).as_posix()}": p for p in include.rglob("*.h")}
    folders = list(dict.fromkeys(path.parent for path in sources))
    for path in (*sources, *(header for folder in folders for header in folder.glob("*.h"))):
        paths[f"src{folders.index(path.parent)}/{path.name}"] = path
    try:
        return {name: regular_bytes(path) for name, path in sorted(paths.items())}
    except OSError as error:
        raise ModelError(
            f"cannot read {error.filename}: {error.strerror}; generate it again"
        ) from error


def library_of(
    digests: Mapping[str, str],
    texts: Callable[[], Texts],
    profile: str,
    cache: Path,
    flags: tuple[str, ...] = (),
) -> Path:
    """Return the library of texts with these SHA-256, which are read only to compile them.

    flags: added to the profile's. One process compiles while others wait for it. Errors as of
    ``compile_library``.
    """
    library = library_in_cache(digests, profile, cache, flags)
    if library:
        return library
    with alone(cache, digest([sorted(digests.items()), profile])):
        library = library_in_cache(digests, profile, cache, flags)
        if library:
            return library
        # A note may describe a compiler since upgraded behind a wrapper, so nothing is built on
        # its word.
        toolchain = examine(profile, cache)
        place = cache / LIBRARIES / toolchain.key(digests, flags)
        found = find(cache, LIBRARIES, place.name)
        return found[0] if found else _build(texts(), toolchain, flags, place)


def library_in_cache(
    digests: Mapping[str, str], profile: str, cache: Path, flags: tuple[str, ...] = ()
) -> Path | None:
    """Return the library of texts with these SHA-256 if it is there; no process is started."""
    one_of("profile", profile, PROFILES, SerpentailError)
    refuse_open(cache)
    toolchain = noted_toolchain(profile, cache)
    found = toolchain and find(cache, LIBRARIES, toolchain.key(digests, flags))
    return found[0] if found else None


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


def describe_compiler(profile: str = "fast") -> dict[str, object]:
    """Return the command (less its folder), version and flags that `compile_library` would use."""
    one_of("profile", profile, PROFILES, SerpentailError)
    toolchain = examine(profile, cache_folder())
    program, *arguments = toolchain.command
    return {
        "command": shlex.join([os.path.basename(program), *arguments]),
        "version": toolchain.version.splitlines()[0],
        "flags": [*toolchain.flags, *SHARED_FLAGS],
    }


def _build(texts: Texts, toolchain: Toolchain, flags: tuple[str, ...], place: Path) -> Path:
    """Compile texts in a folder of our own, and put the library into an entry of the cache."""
    cache, most = place.parents[1], limit()
    if os.path.lexists(place):
        logging.getLogger("serpentail").warning("%s was damaged: it is made anew", place)
    with workshop(cache) as part:
        for name, text in texts.items():
            path = part / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(text)
        sources = [name for name in texts if not name.endswith(".h")]
        _compile(sources, (*toolchain.command, *toolchain.flags, *flags), part)
        library = store(cache, LIBRARIES, place.name, part / "library.so")
    keep_within(cache, most)
    return library


def _compile(sources: Sequence[str], compiler: Sequence[str], part: Path) -> None:
    """Compile the sources at the same time, and link them into library.so; or CompileFailed."""
    made = part / "library.so"
    objects = [str(part / f"{k}.o") for k in range(len(sources))]
    commands = [
        (*compiler, "-fPIC", "-I", str(part / "include"), "-c", str(part / source), "-o", file)
        for source, file in zip(sources, objects, strict=True)
    ]
    what = ", ".join(Path(source).name for source in sources)
    with Stage("compile", LAST_RESORT * ("ziglang" in compiler) + what) as stage:
        for finished in run_commands(commands, stage.tell):
            if finished.returncode:
                raise _failure(finished, part)
        link = (*compiler, *SHARED_FLAGS, *objects, "-o", str(made), "-lm")
        (finished,) = run_commands([link], stage.tell)
        if finished.returncode or not made.is_file() or made.stat().st_size == 0:
            raise _failure(finished, part)


def _failure(finished: Finished, part: Path) -> CompileFailed:
    """Return the error that shows the command and the compiler's words, in a folder now gone."""
    command = tuple(word.replace(f"{part}{os.sep}", "") for word in finished.args)
    stderr = finished.stderr.replace(f"{part}{os.sep}", "")
    words = _trimmed(stderr.strip() or "the compiler said nothing and wrote no library")
    outcome = f"the C compiler failed with exit code {finished.returncode}"
    error = CompileFailed(f"{outcome}\n{words}\nCommand: {shlex.join(command)}\n{REMEDY_FAILED}")
    error.command, error.returncode, error.stderr = command, finished.returncode, stderr
    return error


def _trimmed(text: str) -> str:
    """Return `text`, without its middle if it is too long to read."""
    half = LONGEST_REPORT // 2
    if len(text) <= LONGEST_REPORT:
        return text
    return f"{text[:half]}\n[... {len(text) - 2 * half} characters left out ...]\n{text[-half:]}"
