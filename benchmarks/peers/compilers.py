"""The compilers of the peers' C and C++: gcc, and the clang that comes with the wheel ziglang."""

import functools
import importlib.util
import shutil
import subprocess
import sys
from typing import NamedTuple

from benchmarks.processors import march

REMEDY = ".venv/bin/pip install --editable '.[peers]' brings clang"


class PeerUnavailable(RuntimeError):
    """A peer cannot be built or timed on this machine; the message says what to install."""


class Compiler(NamedTuple):
    """One compiler: its commands for C and for C++, and the first line of its version."""

    name: str
    c: tuple[str, ...]
    cxx: tuple[str, ...]
    version: str

    @property
    def target(self) -> str:
        """The flag that names the processor; zig writes the levels of x86-64 in its own way."""
        level = march()
        return f"-march={level.replace('-', '_') if self.name == 'clang' else level}"


@functools.cache
def compilers() -> tuple[Compiler, ...]:
    """Return those that are here, gcc first; there is at least one."""
    zig = (sys.executable, "-m", "ziglang")
    found = []
    if shutil.which("gcc") and shutil.which("g++"):
        found.append(Compiler("gcc", ("gcc",), ("g++",), version(("gcc",))))
    if importlib.util.find_spec("ziglang"):
        found.append(Compiler("clang", (*zig, "cc"), (*zig, "c++"), version((*zig, "cc"))))
    if not found:
        raise PeerUnavailable(f"neither gcc with g++ nor clang is here: {REMEDY}")
    return tuple(found)


def version(command: tuple[str, ...]) -> str:
    """Return the first line that a compiler says of itself."""
    told = subprocess.run([*command, "--version"], capture_output=True, text=True, check=True)
    return told.stdout.splitlines()[0]


def told(there: tuple[Compiler, ...]) -> str:
    """Say by which compilers peers were made, and what is missing."""
    words = "; ".join(f"{compiler.name}: {compiler.version}" for compiler in there)
    if len(there) > 1:
        return f"peers by the faster of {words}"
    lack = f": {REMEDY}" if there[0].name == "gcc" else ""
    return f"peers by {there[0].name} only{lack}. {words}"
