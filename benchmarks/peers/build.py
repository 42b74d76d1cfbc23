"""Compiles the C and C++ of peers by gcc and by the clang of the wheel ziglang.

Users may have either, so the faster one counts in each row. Libraries are kept from run to run in
~/.cache/serpentail/peers. The first run takes minutes, and 5 GB of memory for Pinocchio.
"""

import functools
import hashlib
import importlib.util
import os
import shlex
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from importlib import metadata
from pathlib import Path
from typing import NamedTuple, TypeVar

from benchmarks.processors import march
from serpentail.basics.errors import SerpentailError
from serpentail.compiling.commands import run_all

Made = TypeVar("Made")

HERE = Path(__file__).resolve().parent
CACHE = Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "serpentail" / "peers"
PATIENCE = 900  # seconds for one file
REMEDY = ".venv/bin/pip install --editable '.[peers]' brings clang"
SHARED = ("-fPIC", "-shared")
# -std=gnu11 lets gcc fuse multiply-adds, and clang only where it is told
C_FLAGS = ("-std=gnu11", "-O2", "-ffp-contract=fast", *SHARED)
# hidden: no symbol is shared with a Pinocchio library of another ABI in this process
CXX_FLAGS = ("-std=c++17", "-O3", "-ffp-contract=fast", "-DNDEBUG", "-fvisibility=hidden", *SHARED)
# headers of C++ sources: a file, the distribution that it comes with, the folder to search
HEADERS = (
    ("pinocchio/multibody.hpp", "libpinocchio", "cmeel.prefix/include"),  # from release 4 on
    ("boost/variant.hpp", "cmeel-boost", "cmeel.prefix/include"),
    ("Eigen/Core", "cmeel-eigen", "cmeel.prefix/include/eigen3"),
)


class PeerUnavailable(SerpentailError):
    """A peer cannot be built or timed on this machine; the message says what to install."""


class TookTooLong(PeerUnavailable):
    """A compiler did not finish a file."""


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
    zig, found = (sys.executable, "-m", "ziglang"), []
    if shutil.which("gcc") and shutil.which("g++"):
        found.append(Compiler("gcc", ("gcc",), ("g++",), version(("gcc",))))
    if importlib.util.find_spec("ziglang"):
        found.append(Compiler("clang", (*zig, "cc"), (*zig, "c++"), version((*zig, "cc"))))
    if not found:
        raise PeerUnavailable(f"neither gcc with g++ nor clang is here: {REMEDY}")
    return tuple(found)


def version(command: tuple[str, ...]) -> str:
    """Return the first line that a compiler says of itself."""
    said = subprocess.run([*command, "--version"], capture_output=True, text=True, check=True)
    return said.stdout.splitlines()[0]


def described() -> str:
    """Say by which compilers peers are made, and what is missing."""
    there = compilers()
    words = "; ".join(f"{compiler.name}: {compiler.version}" for compiler in there)
    if len(there) > 1:
        return f"peers by the faster of {words}"
    return f"peers by {there[0].name} only ({REMEDY}). {words}"


def by_each(make: Callable[[Compiler], Made]) -> dict[str, Made]:
    """Return what is made by each compiler that is here, by its name, side by side.

    One that takes too long is left out, and told; the dictionary is empty where all do.
    """
    with ThreadPoolExecutor() as pool:
        begun = {compiler.name: pool.submit(make, compiler) for compiler in compilers()}
    found = {}
    for name, future in begun.items():
        try:
            found[name] = future.result()
        except TookTooLong as error:
            print(f"{name} is left out: {error}", file=sys.stderr)
    return found


def build_library(
    source: Path,
    compiler: Compiler | None = None,
    flags: Sequence[str] = (),
    by_gcc=(),
    by_clang=(),
) -> Path:
    """Compile a .c or .cpp file to a shared library, unless it is kept; PeerUnavailable says why
    not.

    compiler: the first that is here, by default. flags: after the source, such as libraries;
    by_gcc, by_clang: flags of one compiler.
    """
    compiler = compiler or compilers()[0]
    flags = (*(by_gcc if compiler.name == "gcc" else by_clang), *flags)
    if source.suffix == ".c":
        command, headers = (*compiler.c, *C_FLAGS, compiler.target), []
    else:
        folders = dict.fromkeys(_header_folder(*header) for header in HEADERS)
        search = [word for folder in folders for word in ("-isystem", str(folder))]
        command = (*compiler.cxx, *CXX_FLAGS, compiler.target, *search)
        headers = [metadata.version(name) for _, name, _ in HEADERS]
    # the macros tell for which processor a compiler builds
    machine = run([*compiler.c, compiler.target, "-dM", "-E", "-x", "c", os.devnull])
    identity = (compiler.version, command, flags, machine, headers, source.read_text())
    key = hashlib.sha256(repr(identity).encode()).hexdigest()[:16]
    library = CACHE / f"{source.stem}-{compiler.name}-{key}.so"
    if not library.exists():
        CACHE.mkdir(parents=True, exist_ok=True)
        partial = library.with_suffix(f".{os.getpid()}.tmp")
        run([*command, str(source), *flags, "-o", str(partial)])
        partial.replace(library)
    return library


def _header_folder(header: str, distribution: str, folder: str) -> Path:
    """Return where an installed distribution keeps a header that a C++ source includes."""
    remedy = f"`{Path(sys.executable).name} -m pip install {distribution}` brings it."
    try:
        found = Path(str(metadata.distribution(distribution).locate_file(folder)))
    except metadata.PackageNotFoundError:
        raise PeerUnavailable(f"{distribution} is not installed; {remedy}") from None
    if not (found / header).is_file():
        raise PeerUnavailable(f"{distribution} is installed without the header {header}; {remedy}")
    return found


def run(command: Sequence[str]) -> str:
    """Return the output of a command; PeerUnavailable with the end of its complaints, TookTooLong
    beyond PATIENCE.
    """
    end = time.monotonic() + PATIENCE

    def patient() -> None:
        if time.monotonic() > end:
            raise TookTooLong(f"{shlex.join(command)}\ntook over {PATIENCE} s")

    (done,) = run_all([command], os.environ, patient)
    if done.returncode:
        raise PeerUnavailable(f"{shlex.join(command)}\nfailed:\n{done.stderr[-3000:]}")
    return done.stdout + done.stderr
