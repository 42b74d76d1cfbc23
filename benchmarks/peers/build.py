"""Compiles the C and C++ of peers into shared libraries, kept from run to run."""

from __future__ import annotations

import hashlib
import os
import shlex
import sys
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from importlib import metadata
from pathlib import Path
from typing import TypeVar

from serpentail.compiling.commands import run_all

from .compilers import Compiler, PeerUnavailable, compilers

Made = TypeVar("Made")

HERE = Path(__file__).resolve().parent
TUNED = HERE / "pinocchio_chain.cpp"
PLAIN = HERE / "pinocchio_plain.cpp"
DERIVATIVES = HERE / "pinocchio_derivatives.cpp"
CACHE = Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "serpentail" / "peers"
PATIENCE = 900  # seconds for one file
SHARED_FLAGS = ("-fPIC", "-shared")
# -std=gnu11 lets gcc fuse multiply-adds, and clang only where it is told
C_FLAGS = ("-std=gnu11", "-O2", "-ffp-contract=fast")
CXX_FLAGS = (
    "-std=c++17",
    # no symbol is shared with a Pinocchio library of another ABI in this process
    "-fvisibility=hidden",
    "-O3",
    "-ffp-contract=fast",
    "-DNDEBUG",
)
# Reasons and figures for these are at the top of pinocchio_chain.cpp; clang has no more of them.
TUNED_FLAGS = {
    "gcc": (
        "-fno-tree-slp-vectorize",
        "-finline-limit=2000",
        "--param=inline-unit-growth=400",
        "--param=large-function-growth=2000",
    ),
    "clang": ("-fno-slp-vectorize",),
}
# What the C++ source includes: a file of the headers, the distribution it comes with, the folder
# to search.
HEADERS = (
    ("pinocchio/multibody.hpp", "libpinocchio", "cmeel.prefix/include"),  # from release 4 on
    ("boost/variant.hpp", "cmeel-boost", "cmeel.prefix/include"),
    ("Eigen/Core", "cmeel-eigen", "cmeel.prefix/include/eigen3"),
)


class TookTooLong(PeerUnavailable):
    """A compiler did not finish a file."""


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
    output_dir: Path,
    compiler: Compiler | None = None,
    flags: Sequence[str] = (),
) -> Path:
    """Compile a .c or .cpp file to a shared library, unless output_dir has it; PeerUnavailable says
    why not.

    compiler: the first that is here, by default; flags: after the source, such as libraries.
    """
    source, output_dir = Path(source), Path(output_dir)
    compiler = compiler or compilers()[0]
    command, search = _toolchain(source, compiler)
    texts = [path.read_text() for path in (source, *sorted(source.parent.glob("*.hpp")))]
    headers = [metadata.version(name) for _, name, _ in HEADERS] if search else []
    machine = _target(compiler)
    identity = (compiler.name, compiler.version, command[1], flags, machine, headers, texts)
    key = hashlib.sha256(repr(identity).encode()).hexdigest()[:16]
    library = output_dir / f"{source.stem}-{compiler.name}-{key}.so"
    if not library.exists():
        output_dir.mkdir(parents=True, exist_ok=True)
        partial = library.with_suffix(f".{os.getpid()}.tmp")
        program, own = command
        run([*program, *own, *search, str(source), *flags, "-o", str(partial)])
        partial.replace(library)
    return library


def _toolchain(source: Path, compiler: Compiler) -> tuple[tuple, tuple[str, ...]]:
    """Return program and flags for a source, by its suffix, and where it finds headers."""
    if source.suffix == ".c":
        return (compiler.c, (*C_FLAGS, compiler.target, *SHARED_FLAGS)), ()
    tuned = TUNED_FLAGS[compiler.name] if source in (TUNED, DERIVATIVES) else ()
    folders = dict.fromkeys(_header_folder(*header) for header in HEADERS)
    search = tuple(flag for folder in folders for flag in ("-isystem", str(folder)))
    return (compiler.cxx, (*CXX_FLAGS, compiler.target, *tuned, *SHARED_FLAGS)), search


def _header_folder(header: str, distribution: str, folder: str) -> Path:
    """Where an installed distribution keeps a header that the C++ source includes."""
    remedy = f"`{Path(sys.executable).name} -m pip install {distribution}` brings it."
    try:
        found = Path(str(metadata.distribution(distribution).locate_file(folder)))
    except metadata.PackageNotFoundError:
        raise PeerUnavailable(f"{distribution} is not installed; {remedy}") from None
    if not (found / header).is_file():
        raise PeerUnavailable(f"{distribution} is installed without the header {header}; {remedy}")
    return found


def _target(compiler: Compiler) -> str:
    """Return the macros by which a compiler tells for which processor it builds."""
    return run([*compiler.c, compiler.target, "-dM", "-E", "-x", "c", os.devnull])


def run(command: Sequence[str]) -> str:
    """Output of a command; PeerUnavailable with the end of its complaints, TookTooLong
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
