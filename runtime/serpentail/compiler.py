"""C sources, headers and the name of a build profile go in; the path of a cached shared library comes out."""

from __future__ import annotations

import contextlib
import hashlib
import importlib.util
import json
import os
import shlex
import shutil
import subprocess
import sys
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from serpentail.errors import CompileFailed, CompilerNotFound, ModelError, SerpentailError

# -std=c99 alone turns contraction off, so the fast profile asks for it by name.
PROFILES = {
    "fast": ("-std=c99", "-O2", "-ffp-contract=fast", "-fno-tree-vectorize", "-fno-math-errno", "-fno-trapping-math"),
    "reproducible": ("-std=c99", "-O2", "-ffp-contract=off"),
}
# The first of these that the compiler takes joins the profile. Only zig takes `baseline`: unasked, it builds
# for the processor at hand, where gcc and clang build for any processor of its family.
CPU_FLAGS = {"fast": ("-march=native", "-mcpu=native"), "reproducible": ("-mcpu=baseline",)}
SHARED_FLAGS = ("-fPIC", "-shared")
PROGRAMS = ("cc", "gcc", "clang")
CACHE_FORMAT = 1  # part of every name in the cache: raise it when the meaning of a name changes
LONGEST_REPORT = 6000  # characters of a compiler's output that an error shows

REMEDY_NOT_FOUND = (
    "Install one (Debian, Ubuntu: `apt install gcc`; macOS: `xcode-select --install`; anywhere: "
    "`pip install ziglang`) or set CC to the command of a C compiler. "
    "Without a compiler the CasADi functions of a model still evaluate."
)
REMEDY_FAILED = "Generate the model again if its files were edited; else try another compiler with CC=..."
REMEDY_CACHE = "set SERPENTAIL_CACHE to a folder you can write"


@dataclass(frozen=True)
class Toolchain:
    """A compiler as examined for one profile: how to call it and what its output depends on."""

    command: tuple[str, ...]
    flags: tuple[str, ...]
    version: str
    target: str  # digest of the processor and instruction set that the flags stand for on this machine


def compile_library(sources: Sequence[Path], include: Path, profile: str = "fast", cache: Path | None = None) -> Path:
    """Return the shared library of `sources` and the headers in `include`, compiled unless the cache has it.

    `profile` is "fast" or "reproducible"; `cache` defaults to $SERPENTAIL_CACHE, then the user's cache.
    Raises CompilerNotFound, CompileFailed, ModelError (unreadable sources), SerpentailError (profile, cache).
    """
    _check_profile(profile)
    folder = _cache_folder(cache)
    text = _text_digest(sources, include)
    noted = _recall(profile, folder)
    library = _trusted(folder / _key(text, noted)) if noted else None
    if library:
        return library
    # A note may describe a compiler since upgraded behind a wrapper, so nothing is built on its word.
    toolchain = _examine(profile, folder)
    return _trusted(folder / _key(text, toolchain)) or _build(sources, include, text, toolchain, folder)


def describe_compiler(profile: str = "fast") -> dict[str, object]:
    """Return the command (less its folder), version and flags that `compile_library` would use."""
    _check_profile(profile)
    toolchain = _examine(profile, _cache_folder(None))
    return {
        "command": shlex.join(_public_command(toolchain.command)),
        "version": toolchain.version.splitlines()[0],
        "flags": [*toolchain.flags, *SHARED_FLAGS],
    }


def _check_profile(profile: str) -> None:
    """Raise SerpentailError unless `profile` is known."""
    if not isinstance(profile, str) or profile not in PROFILES:
        raise SerpentailError(f"unknown build profile {profile!r}; choose one of {', '.join(PROFILES)}")


# The compiler: which one, and what it resolves its flags to.


def _candidates() -> Iterator[tuple[str, ...]]:
    """Yield the commands to try: $CC alone if it is set, else what is on PATH, then the ziglang wheel."""
    chosen = os.environ.get("CC", "").strip()
    if chosen:
        yield _split(chosen)
        return
    yield from ((path,) for path in map(shutil.which, PROGRAMS) if path)
    if importlib.util.find_spec("ziglang"):
        yield (sys.executable, "-m", "ziglang", "cc")


def _split(chosen: str) -> tuple[str, ...]:
    """Return the words of $CC, the first one as a path where it can be found."""
    try:
        program, *arguments = shlex.split(chosen)
    except ValueError as error:
        raise CompilerNotFound(f"CC={chosen!r} is not a command: {error}. {REMEDY_NOT_FOUND}") from error
    return (shutil.which(program) or program, *arguments)


def _examine(profile: str, folder: Path) -> Toolchain:
    """Return the first candidate that answers, asking it afresh, and leave notes on all that were asked."""
    refusals = []
    for command in _candidates():
        try:
            toolchain = _ask(command, profile)
        except CompilerNotFound as error:
            refusals.append(str(error))
            _write_note(folder, command, profile, None)
        else:
            _write_note(folder, command, profile, toolchain)
            return toolchain
    raise CompilerNotFound(_not_found(refusals))


def _not_found(refusals: list[str]) -> str:
    """Return the message that names what was tried and how to mend it."""
    chosen = os.environ.get("CC", "").strip()
    if chosen:
        return f"CC={chosen!r} does not work as a C compiler: {refusals[0]}. {REMEDY_NOT_FOUND}"
    absent = [f"{program} (not on PATH)" for program in PROGRAMS if not shutil.which(program)]
    zig = [] if importlib.util.find_spec("ziglang") else ["the ziglang wheel (not installed)"]
    return f"no C compiler works here; tried {', '.join([*absent, *refusals, *zig])}. {REMEDY_NOT_FOUND}"


def _ask(command: tuple[str, ...], profile: str) -> Toolchain:
    """Return what `command` says about itself, or raise CompilerNotFound with its reason."""
    answer = _run((*command, "--version"))
    if answer.returncode or not answer.stdout.strip():
        reason = (answer.stderr.strip() or "no answer to --version")[:300]
        raise CompilerNotFound(f"`{shlex.join(command)}` ({reason})")
    flags = PROFILES[profile] + _cpu_flag(command, profile)
    return Toolchain(command, flags, answer.stdout.strip(), _target(command, flags))


def _cpu_flag(command: tuple[str, ...], profile: str) -> tuple[str, ...]:
    """Return the first of the profile's processor flags that the compiler takes in silence, or none."""
    nothing = ("-E", "-x", "c", os.devnull)
    usual = _run((*command, *nothing)).stderr
    for flag in CPU_FLAGS[profile]:
        answer = _run((*command, flag, *nothing))
        if answer.returncode == 0 and answer.stderr == usual:
            return (flag,)
    return ()


def _target(command: tuple[str, ...], flags: tuple[str, ...]) -> str:
    """Return a digest of what `flags` resolve to: gcc's list of them, else the macros they define."""
    questions = (("-Q", "--help=target"), ("-dM", "-E", "-x", "c", os.devnull))
    answers = (_run((*command, *flags, *question)) for question in questions)
    listings = (answer.stdout for answer in answers if answer.returncode == 0 and answer.stdout)
    return _digest(next(listings, None) or _processor())


def _run(command: Sequence[str]) -> subprocess.CompletedProcess[str]:
    """Return the finished `command`, run in the C locale; one that cannot start counts as exit code 127."""
    surroundings = {**os.environ, "LC_ALL": "C"}
    try:
        return subprocess.run(
            command,
            env=surroundings,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            encoding="utf-8",
            errors="replace",
            check=False,
        )
    except OSError as error:
        return subprocess.CompletedProcess(command, 127, "", error.strerror or str(error))


# Notes: what a compiler said, kept so that a warm call starts no process.


def _recall(profile: str, folder: Path) -> Toolchain | None:
    """Return the first working candidate as noted earlier on such a processor, or None to ask afresh."""
    for command in _candidates():
        note = _read_note(_note_path(folder, command, profile))
        if note is None:
            return None
        if note["works"]:
            return Toolchain(command, tuple(note["flags"]), note["version"], note["target"])
    return None


def _note_path(folder: Path, command: tuple[str, ...], profile: str) -> Path:
    """Return the note's place, named by the programs' files, the flags to choose from and the processor."""
    programs = [_file_identity(path) for path in map(shutil.which, command) if path]
    choices = (PROFILES[profile], CPU_FLAGS[profile])
    return folder / "compilers" / f"{_digest([command, programs, choices, _processor()])}.json"


def _file_identity(path: str) -> tuple[str, int, int]:
    """Return what changes when the program at `path` is replaced."""
    status = os.stat(path)
    return os.path.realpath(path), status.st_mtime_ns, status.st_size


def _read_note(path: Path) -> dict[str, Any] | None:
    """Return a whole note, or None."""
    try:
        note = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    return note if isinstance(note, dict) and {"works", "flags", "version", "target"} <= note.keys() else None


def _write_note(folder: Path, command: tuple[str, ...], profile: str, toolchain: Toolchain | None) -> None:
    """Keep what was learnt; a cache that cannot be written still serves, until a build needs it."""
    blank = Toolchain(command, (), "", "")
    note = {"works": toolchain is not None, **asdict(toolchain or blank)}
    path = _note_path(folder, command, profile)
    with contextlib.suppress(OSError), _part(path.parent) as part:
        part.write_text(json.dumps(note), encoding="utf-8")
        part.replace(path)


def _processor() -> str:
    """Return the processor's model and features, read without a new process, else the machine's name."""
    with contextlib.suppress(OSError):
        return Path("/sys/devices/system/cpu/modalias").read_text()
    with contextlib.suppress(OSError):
        names = ("model name", "flags", "Features", "CPU implementer", "CPU part", "cpu\t", "isa", "uarch")
        lines = Path("/proc/cpuinfo").read_text(errors="replace").splitlines()
        return "\n".join(sorted({line for line in lines if line.startswith(names)}))
    return " ".join(os.uname())


# The cache: <folder>/<key>/<digest of the library>.so, so one rename publishes a library with its proof.


def _cache_folder(cache: Path | None) -> Path:
    """Return the cache: the argument, else $SERPENTAIL_CACHE, else $XDG_CACHE_HOME or ~/.cache, absolute."""
    own = cache or os.environ.get("SERPENTAIL_CACHE")
    shared = os.environ.get("XDG_CACHE_HOME", "")
    if not os.path.isabs(shared):  # the XDG specification has relative paths ignored
        shared = "~/.cache"
    try:
        return (Path(own) if own else Path(shared) / "serpentail").expanduser().absolute()
    except RuntimeError as error:
        raise SerpentailError(f"no cache of compiled models: {error}; {REMEDY_CACHE}") from error


def _text_digest(sources: Sequence[Path], include: Path) -> str:
    """Return the digest of names and contents of the sources, in order, and of the headers they can reach."""
    if not sources or not include.is_dir():
        raise ModelError(f"no sources, or no header folder {include}; generate the model again")
    try:
        named = [(path.name, path) for path in sources] + list(_headers(sources, include))
        return _digest([(name, hashlib.sha256(path.read_bytes()).hexdigest()) for name, path in named])
    except OSError as error:
        raise ModelError(f"cannot read {error.filename}: {error.strerror}; generate it again") from error


def _headers(sources: Sequence[Path], include: Path) -> Iterator[tuple[str, Path]]:
    """Yield the headers below `include` and beside the sources, each with its name there, sorted."""
    for path in sorted(include.rglob("*.h")):
        yield path.relative_to(include).as_posix(), path
    for folder in dict.fromkeys(path.parent for path in sources):
        for path in sorted(folder.glob("*.h")):
            yield f"./{path.name}", path


def _key(text: str, toolchain: Toolchain) -> str:
    """Return the name of the library's place: the C text and all that its machine code depends on."""
    command = _public_command((os.path.realpath(toolchain.command[0]), *toolchain.command[1:]))
    flags = (*toolchain.flags, *SHARED_FLAGS)
    return _digest([text, command, toolchain.version, flags, toolchain.target, _c_library()])


def _public_command(command: tuple[str, ...]) -> tuple[str, ...]:
    """Return `command` with the folder of its program left out."""
    return (os.path.basename(command[0]), *command[1:])


def _c_library() -> str:
    """Return the C library's version: code linked against a newer one need not load with an older one."""
    with contextlib.suppress(AttributeError, ValueError, OSError):
        return os.confstr("CS_GNU_LIBC_VERSION") or ""
    return ""


def _digest(data: object) -> str:
    """Return the sha256 of `data` as JSON."""
    return hashlib.sha256(json.dumps([CACHE_FORMAT, data]).encode()).hexdigest()


def _trusted(place: Path) -> Path | None:
    """Return a library at `place` that has the content it is named after, so no damaged one."""
    with contextlib.suppress(OSError):
        for path in sorted(place.iterdir()):
            if path.name == _library_name(path):
                return path
    return None


def _library_name(path: Path) -> str:
    """Return the name that the content of `path` deserves."""
    return f"{hashlib.sha256(path.read_bytes()).hexdigest()}.so"


def _build(sources: Sequence[Path], include: Path, text: str, toolchain: Toolchain, folder: Path) -> Path:
    """Compile into a file of our own and publish it by one rename: others see the whole library or none."""
    place = folder / _key(text, toolchain)
    try:
        with _part(folder) as part:
            _compile(sources, include, toolchain, part)
            if _text_digest(sources, include) != text:
                raise ModelError(f"{sources[0].parent} changed while it was compiled; run again")
            library = place / _library_name(part)
            place.mkdir(exist_ok=True)
            return part.replace(library)
    except OSError as error:
        reason = error.strerror or str(error)
        message = f"cannot write to the cache of compiled models {folder}: {reason}; {REMEDY_CACHE}"
        raise SerpentailError(message) from error


@contextlib.contextmanager
def _part(folder: Path) -> Iterator[Path]:
    """Lend an empty file in `folder` under a name that no other process has, gone at the end."""
    folder.mkdir(parents=True, exist_ok=True)
    part = folder / f".{os.urandom(12).hex()}.part"
    part.touch(exist_ok=False)
    try:
        yield part
    finally:
        part.unlink(missing_ok=True)


def _compile(sources: Sequence[Path], include: Path, toolchain: Toolchain, part: Path) -> None:
    """Run the compiler with its output in `part`, or raise CompileFailed."""
    files = [str(path.absolute()) for path in sources]
    flags = (*toolchain.flags, *SHARED_FLAGS, "-I", str(include.absolute()))
    command = (*toolchain.command, *flags, *files, "-o", str(part), "-lm")
    finished = _run(command)
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
