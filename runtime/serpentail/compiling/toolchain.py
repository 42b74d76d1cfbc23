"""The C compiler: which one works here, and what its flags stand for on this machine."""

from __future__ import annotations

import contextlib
import importlib.util
import json
import os
import shlex
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from ..basics.checks import one_of
from ..basics.errors import CompilerNotFound, SerpentailError
from .cache import COMPILERS, digest, publish, refuse_others, workshop
from .commands import run_all
from .safe_files import regular_bytes

# -std=c99 alone turns contraction off, so the fast profile asks for it by name.
PROFILES = {
    "fast": (
        "-std=c99",
        "-O2",
        "-ffp-contract=fast",
        "-fno-tree-vectorize",
        "-fno-math-errno",
        "-fno-trapping-math",
    ),
    "reproducible": ("-std=c99", "-O2", "-ffp-contract=off"),
}
# The first of these that the compiler takes joins the profile. Only zig takes `baseline`: unasked,
# it builds for the processor at hand, where gcc and clang build for any processor of its family.
CPU_FLAGS = {"fast": ("-march=native", "-mcpu=native"), "reproducible": ("-mcpu=baseline",)}
PROGRAMS = ("cc", "gcc", "clang")
REMEDY_NOT_FOUND = (
    "Install one (Debian, Ubuntu: `apt install gcc`; macOS: `xcode-select --install`; anywhere: "
    "`pip install ziglang`) or set CC to the command of a C compiler. "
    "Without a compiler the CasADi functions of a model still evaluate."
)
# What a compiler is given of the environment: much else that it reads, such as CPATH, changes what
# it makes.  Of these the places do not, and the rest is part of every key.
PLACES = (
    *("PATH", "HOME", "TMPDIR", "XDG_CACHE_HOME", "XDG_CONFIG_HOME", "PYTHONPATH"),
    *("APPDATA", "LOCALAPPDATA", "PATHEXT", "SYSTEMROOT", "TEMP", "TMP", "USERPROFILE"),  # Windows
)
KEPT = ("LD_LIBRARY_PATH", "SDKROOT", "DEVELOPER_DIR", "MACOSX_DEPLOYMENT_TARGET")
KEPT_OF = ("CCACHE_", "SCCACHE_", "ZIG_", "NIX_")  # wrappers of compilers


@dataclass(frozen=True)
class Toolchain:
    """A compiler as examined for one profile: how to call it and what its output depends on."""

    command: tuple[str, ...]
    flags: tuple[str, ...]
    version: str
    target: str  # digest of what the flags stand for on this machine: processor, instruction set


def check_profile(profile: str) -> None:
    """Raise SerpentailError unless `profile` is known."""
    one_of("profile", profile, PROFILES, SerpentailError)


# The compiler, and what its flags resolve to.


def candidates() -> Iterator[tuple[str, ...]]:
    """Yield the commands to try: $CC alone if set, else those on PATH, then the ziglang wheel."""
    chosen = os.environ.get("CC", "").strip()
    if chosen:
        yield _split(chosen)
        return
    yield from ((path,) for path in map(shutil.which, PROGRAMS) if path)
    if importlib.util.find_spec("ziglang"):
        yield (sys.executable, "-m", "ziglang", "cc")


def _split(chosen: str) -> tuple[str, ...]:
    """Return the words of $CC, the first one as a path if it can be found."""
    try:
        program, *arguments = shlex.split(chosen)
    except ValueError as error:
        raise CompilerNotFound(
            f"CC={chosen!r} is not a command: {error}. {REMEDY_NOT_FOUND}"
        ) from error
    return (shutil.which(program) or program, *arguments)


def examine(profile: str, folder: Path) -> Toolchain:
    """Return the first candidate that answers when asked; leave notes on all that were."""
    refusals = []
    for command in candidates():
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
    """Return the message that names what was tried, and the remedy."""
    chosen = os.environ.get("CC", "").strip()
    if chosen:
        return f"CC={chosen!r} does not work as a C compiler: {refusals[0]}. {REMEDY_NOT_FOUND}"
    absent = [f"{program} (not on PATH)" for program in PROGRAMS if not shutil.which(program)]
    zig = [] if importlib.util.find_spec("ziglang") else ["the ziglang wheel (not installed)"]
    return (
        f"no C compiler works here; tried "
        f"{', '.join([*absent, *refusals, *zig])}. {REMEDY_NOT_FOUND}"
    )


def _ask(command: tuple[str, ...], profile: str) -> Toolchain:
    """Return what `command` reports about itself; CompilerNotFound if that fails."""
    answer = run_command((*command, "--version"))
    if answer.returncode or not answer.stdout.strip():
        reason = (answer.stderr.strip() or "no answer to --version")[:300]
        raise CompilerNotFound(f"`{shlex.join(command)}` ({reason})")
    flags = PROFILES[profile] + _cpu_flag(command, profile)
    return Toolchain(command, flags, answer.stdout.strip(), _target(command, flags))


def _cpu_flag(command: tuple[str, ...], profile: str) -> tuple[str, ...]:
    """Return the first of the profile's processor flags that the compiler takes in silence."""
    nothing = ("-E", "-x", "c", os.devnull)
    usual = run_command((*command, *nothing)).stderr
    for flag in CPU_FLAGS[profile]:
        answer = run_command((*command, flag, *nothing))
        if answer.returncode == 0 and answer.stderr == usual:
            return (flag,)
    return ()


def _target(command: tuple[str, ...], flags: tuple[str, ...]) -> str:
    """Return a digest of what the flags resolve to: gcc's list, else the predefined macros."""
    questions = (("-Q", "--help=target"), ("-dM", "-E", "-x", "c", os.devnull))
    answers = (run_command((*command, *flags, *question)) for question in questions)
    listings = (answer.stdout for answer in answers if answer.returncode == 0 and answer.stdout)
    return digest(next(listings, None) or _processor())


def run_command(command: Sequence[str]) -> subprocess.CompletedProcess[str]:
    """Return the finished command, run in the C locale; 127 if it could not be started."""
    return run_commands([command])[0]


def run_commands(
    commands: Sequence[Sequence[str]], tick: Callable[[], object] = lambda: None
) -> list[subprocess.CompletedProcess[str]]:
    """Return the finished commands, run at the same time; 127 if one could not be started.

    tick: called now and then meanwhile.
    """
    places = {name: os.environ[name] for name in PLACES if name in os.environ}
    surroundings = {**places, **kept_surroundings(), "LC_ALL": "C"}
    try:
        return run_all(commands, surroundings, tick)
    except OSError as error:
        reason = error.strerror or str(error)
        return [subprocess.CompletedProcess(each, 127, "", reason) for each in commands]


def kept_surroundings() -> dict[str, str]:
    """Return the environment variables that may change what a compiler makes."""
    return {
        name: value
        for name, value in sorted(os.environ.items())
        if name in KEPT or name.startswith(KEPT_OF)
    }


# Notes: properties of a compiler, kept so that later calls start no process.


def recall(profile: str, folder: Path) -> Toolchain | None:
    """Return the first working candidate by stored notes of such a processor; None to ask again."""
    for command in candidates():
        note = _read_note(_note_path(folder, command, profile))
        if note is None:
            return None
        if note["works"]:
            return Toolchain(command, tuple(note["flags"]), note["version"], note["target"])
    return None


def _note_path(folder: Path, command: tuple[str, ...], profile: str) -> Path:
    """Return the place of a note, named after programs, flags to choose from and processor."""
    programs = [_file_identity(path) for path in map(shutil.which, command) if path]
    choices = (PROFILES[profile], CPU_FLAGS[profile])
    machine = (_processor(), kept_surroundings())
    return folder / COMPILERS / f"{digest([command, programs, choices, *machine])}.json"


def _file_identity(path: str) -> tuple[str, int, int]:
    """Return values that change if the program at `path` is replaced."""
    with contextlib.suppress(OSError):
        status = os.stat(path)
        return os.path.realpath(path), status.st_mtime_ns, status.st_size
    return path, 0, 0


def _read_note(path: Path) -> dict[str, Any] | None:
    """Return a whole note, or None."""
    try:
        note = json.loads(regular_bytes(path).decode())
    except (OSError, ValueError, RecursionError):
        return None
    refuse_others(path.parent, path)
    return note if _is_whole(note) else None


def _is_whole(note: object) -> bool:
    """Tell whether a note has all its entries, of the right types."""
    if not isinstance(note, dict) or not isinstance(note.get("works"), bool):
        return False
    texts = (note.get("version"), note.get("target"))
    flags = note.get("flags")
    return isinstance(flags, list) and all(isinstance(text, str) for text in (*texts, *flags))


def _write_note(
    folder: Path, command: tuple[str, ...], profile: str, toolchain: Toolchain | None
) -> None:
    """Store what was learnt; ignore a cache that cannot be written, until a build needs it."""
    blank = Toolchain(command, (), "", "")
    note = {"works": toolchain is not None, **asdict(toolchain or blank)}
    path = _note_path(folder, command, profile)
    with contextlib.suppress(OSError), workshop(folder) as part:
        made = part / path.name
        made.write_text(json.dumps(note), encoding="utf-8")
        made.chmod(0o600)
        publish(made, path, lambda _: False)


def _processor() -> str:
    """Return the processor's model and features, else the machine's name; starts no process."""
    with contextlib.suppress(OSError):
        return Path("/sys/devices/system/cpu/modalias").read_text()
    with contextlib.suppress(OSError):
        names = (
            "model name",
            "flags",
            "Features",
            "CPU implementer",
            "CPU part",
            "cpu\t",
            "isa",
            "uarch",
        )
        lines = Path("/proc/cpuinfo").read_text(errors="replace").splitlines()
        return "\n".join(sorted({line for line in lines if line.startswith(names)}))
    if hasattr(os, "uname"):
        return " ".join(os.uname())
    return os.environ.get("PROCESSOR_IDENTIFIER", sys.platform)  # on Windows
