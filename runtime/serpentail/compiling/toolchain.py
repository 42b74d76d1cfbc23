"""The C compiler: which one works here, and what its output depends on."""

from __future__ import annotations

import contextlib
import importlib.util
import os
import shlex
import shutil
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import cache as memoised
from itertools import compress
from pathlib import Path

from ..basics.errors import CompilerNotFound, SerpentailError
from .cache import COMPILERS, digest, read_note, write_note
from .commands import Finished, run_all

# -std=c99 alone turns contraction off, so the fast profile asks for it by name.
PROFILES = {
    "fast": (
        *("-std=c99", "-O2", "-ffp-contract=fast"),
        *("-fno-tree-vectorize", "-fno-math-errno", "-fno-trapping-math"),
    ),
    "reproducible": ("-std=c99", "-O2", "-ffp-contract=off"),
}
# The first of these that the compiler takes joins the profile. Only zig takes `baseline`: unasked,
# it builds for the processor at hand, where gcc and clang build for any processor of its family.
CPU_FLAGS = {"fast": ("-march=native", "-mcpu=native"), "reproducible": ("-mcpu=baseline",)}
SHARED_FLAGS = ("-fPIC", "-shared")
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
VARIABLES = ("LD_LIBRARY_PATH", "SDKROOT", "DEVELOPER_DIR", "MACOSX_DEPLOYMENT_TARGET")
PREFIXES = ("CCACHE_", "SCCACHE_", "ZIG_", "NIX_")  # of wrappers of compilers
# beginnings of lines of /proc/cpuinfo that tell the processor's model and features
CPU_LINES = ("model name", "flags", "Features", "CPU ", "cpu\t", "isa", "uarch")


@dataclass(frozen=True)
class Toolchain:
    """A compiler as examined for one profile."""

    command: tuple[str, ...]
    flags: tuple[str, ...]
    version: str
    target: str  # digest of what the flags stand for on this machine: processor, instruction set

    def key(self, texts: Mapping[str, str], more: tuple[str, ...]) -> str:
        """Return the digest of all that machine code depends on; no folder is named.

        texts: the SHA-256 of each by its name; more: flags.
        """
        program = os.path.basename(os.path.realpath(self.command[0]))
        command = (program, *self.command[1:], *self.flags, *more, *SHARED_FLAGS)
        machine: list[object] = [self.target, compiler_variables()]
        with contextlib.suppress(AttributeError, ValueError, OSError):
            # a library that is linked to a newer C library may not load
            machine.append(os.confstr("CS_GNU_LIBC_VERSION") or "")
        return digest([sorted(texts.items()), command, self.version, *machine])


def candidates() -> Iterator[tuple[str, ...]]:
    """Yield the commands to try: $CC alone if set, else those on PATH, then the ziglang wheel."""
    chosen = os.environ.get("CC", "").strip()
    if chosen:
        try:
            program, *arguments = shlex.split(chosen)
        except ValueError as error:
            raise CompilerNotFound(
                f"CC={chosen!r} is not a command: {error}. {REMEDY_NOT_FOUND}"
            ) from error
        yield (shutil.which(program) or program, *arguments)
        return
    yield from ((path,) for path in map(shutil.which, PROGRAMS) if path)
    if importlib.util.find_spec("ziglang"):
        yield (sys.executable, "-m", "ziglang", "cc")


def noted_toolchain(profile: str, cache: Path) -> Toolchain | None:
    """Return the compiler that worked when such a machine was examined; starts no process."""
    note = read_note(cache, COMPILERS, _note_key(profile))
    if note is None:
        return None
    command, flags = tuple(note["command"]), tuple(note["flags"])
    return Toolchain(command, flags, note["version"], note["target"])


def examine(profile: str, cache: Path) -> Toolchain:
    """Return the first candidate that answers when asked, and note it for later calls."""
    refusals = []
    for command in candidates():
        try:
            toolchain = _ask(command, profile)
        except CompilerNotFound as error:
            refusals.append(str(error))
            continue
        with contextlib.suppress(SerpentailError):  # a build will tell of such a cache
            write_note(cache, COMPILERS, _note_key(profile), asdict(toolchain))
        return toolchain
    raise CompilerNotFound(_not_found(refusals))


def _note_key(profile: str) -> str:
    """Return the name of a note: the first command to try, flags to choose from, machine.

    What worked in place of a broken command is noted under that one.
    """
    command, programs = next(candidates(), ()), []
    for path in filter(None, map(shutil.which, command)):
        with contextlib.suppress(OSError):
            status = os.stat(path)  # which changes if the program is replaced
            programs.append([os.path.realpath(path), status.st_mtime_ns, status.st_size])
    flags = (PROFILES[profile], CPU_FLAGS[profile])
    return digest([command, programs, flags, processor(), compiler_variables()])


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
    nothing, choice = ("-E", "-x", "c", os.devnull), CPU_FLAGS[profile]
    questions = [("--version",), nothing, *((flag, *nothing) for flag in choice)]
    answer, usual, *replies = run_commands([(*command, *question) for question in questions])
    if answer.returncode or not answer.stdout.strip():
        reason = (answer.stderr.strip() or "no answer to --version")[:300]
        raise CompilerNotFound(f"`{shlex.join(command)}` ({reason})")
    # the first of the profile's processor flags that it takes in silence
    taken = (not each.returncode and each.stderr == usual.stderr for each in replies)
    flags = PROFILES[profile] + tuple(compress(choice, taken))[:1]
    # what the flags resolve to: gcc's list, else the predefined macros
    target = processor()
    for question in (("-Q", "--help=target"), ("-dM", *nothing)):
        listing = run_command((*command, *flags, *question))
        if listing.returncode == 0 and listing.stdout:
            target = listing.stdout
            break
    return Toolchain(command, flags, answer.stdout.strip(), digest(target))


def run_command(command: Sequence[str]) -> Finished:
    """Return the finished command, run in the C locale; 127 if it could not be started."""
    return run_commands([command])[0]


def run_commands(
    commands: Sequence[Sequence[str]], tick: Callable[[], object] = lambda: None
) -> list[Finished]:
    """Return the finished commands, run at the same time; 127 if one could not be started.

    tick: called now and then meanwhile.
    """
    places = {name: os.environ[name] for name in PLACES if name in os.environ}
    try:
        return run_all(commands, {**places, **compiler_variables(), "LC_ALL": "C"}, tick)
    except OSError as error:
        reason = error.strerror or str(error)
        return [Finished(each, 127, "", reason) for each in commands]


def compiler_variables() -> dict[str, str]:
    """Return the environment variables that may change what a compiler makes."""
    return {
        name: value
        for name, value in sorted(os.environ.items())
        if name in VARIABLES or name.startswith(PREFIXES)
    }


@memoised
def processor() -> str:
    """Return the processor's model and features, else the machine's name; starts no process."""
    with contextlib.suppress(OSError):
        return Path("/sys/devices/system/cpu/modalias").read_text()
    with contextlib.suppress(OSError):
        lines = Path("/proc/cpuinfo").read_text(errors="replace").splitlines()
        return "\n".join(sorted({line for line in lines if line.startswith(CPU_LINES)}))
    if hasattr(os, "uname"):
        return " ".join(os.uname())
    return os.environ.get("PROCESSOR_IDENTIFIER", sys.platform)  # on Windows
