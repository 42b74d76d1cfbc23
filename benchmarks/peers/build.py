"""Compiles the C and C++ of peers into shared libraries, kept from run to run."""

from __future__ import annotations

import hashlib
import os
import shlex
import shutil
import subprocess
import sys
from collections.abc import Sequence
from importlib import metadata
from pathlib import Path

HERE = Path(__file__).resolve().parent
TUNED = HERE / "pinocchio_chain.cpp"
PLAIN = HERE / "pinocchio_plain.cpp"
DERIVATIVES = HERE / "pinocchio_derivatives.cpp"
CACHE = Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "serpentail" / "peers"
SHARED_FLAGS = ("-fPIC", "-shared")
C_FLAGS = ("-std=gnu11", "-O2")
CXX_FLAGS = (
    "-std=c++17",
    # no symbol is shared with a Pinocchio library of another ABI in this process
    "-fvisibility=hidden",
    "-O3",
    "-march=native",
    "-DNDEBUG",
)
# Reasons and figures for these are at the top of pinocchio_chain.cpp.
TUNED_FLAGS = (
    "-fno-tree-slp-vectorize",
    "-finline-limit=2000",
    "--param=inline-unit-growth=400",
    "--param=large-function-growth=2000",
)
# What the C++ source includes: a file of the headers, the distribution it comes with, the folder
# to search.
HEADERS = (
    ("pinocchio/multibody.hpp", "libpinocchio", "cmeel.prefix/include"),  # from release 4 on
    ("boost/variant.hpp", "cmeel-boost", "cmeel.prefix/include"),
    ("Eigen/Core", "cmeel-eigen", "cmeel.prefix/include/eigen3"),
)


class PeerUnavailable(RuntimeError):
    """A peer cannot be built or timed on this machine; the message says what to install."""


def build_library(source: Path, output_dir: Path) -> Path:
    """Compile a .c or .cpp file to a shared library, unless output_dir has it; PeerUnavailable says
    why not.
    """
    source, output_dir = Path(source), Path(output_dir)
    compiler, flags = _toolchain(source)
    texts = [path.read_text() for path in (source, *sorted(source.parent.glob("*.hpp")))]
    key = hashlib.sha256(repr((_identity(compiler, flags), texts)).encode()).hexdigest()[:16]
    library = output_dir / f"{source.stem}-{key}.so"
    if not library.exists():
        output_dir.mkdir(parents=True, exist_ok=True)
        partial = library.with_suffix(f".{os.getpid()}.tmp")
        run([*compiler, *flags, str(source), "-o", str(partial)])
        partial.replace(library)
    return library


def _toolchain(source: Path) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Compiler and flags for a source, by its suffix."""
    if source.suffix == ".c":
        return _compiler("CC", ("cc", "gcc", "clang")), (*C_FLAGS, *SHARED_FLAGS)
    folders = dict.fromkeys(_header_folder(*header) for header in HEADERS)
    search = (flag for folder in folders for flag in ("-isystem", str(folder)))
    flags = CXX_FLAGS + (TUNED_FLAGS if source in (TUNED, DERIVATIVES) else ())
    return _compiler("CXX", ("g++", "c++", "clang++")), (*flags, *SHARED_FLAGS, *search)


def _compiler(variable: str, programs: Sequence[str]) -> tuple[str, ...]:
    """The command in an environment variable, else the first of the programs that is installed."""
    asked = shlex.split(os.environ.get(variable, ""))
    for command in [asked] if asked else [[program] for program in programs]:
        if shutil.which(command[0]):
            return tuple(command)
    sought = asked[0] if asked else ", ".join(programs)
    raise PeerUnavailable(
        f"No compiler found ({sought}): install g++, or set {variable} to a command."
    )


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


def _identity(compiler: Sequence[str], flags: Sequence[str]) -> tuple:
    """What a library depends on besides its source: compiler, flags, processor, headers."""
    native = [flag for flag in flags if flag.startswith("-march")]
    version = run([*compiler, "--version"])
    target = run([*compiler, *native, "-E", "-v", "-x", "c", os.devnull]) if native else ""
    headers = [metadata.version(name) for _, name, _ in HEADERS] if native else []
    return tuple(compiler), tuple(flags), version, target, headers


def run(command: Sequence[str]) -> str:
    """Output of a command; PeerUnavailable with the end of its complaints where it fails."""
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        raise PeerUnavailable(f"{shlex.join(command)}\nfailed:\n{done.stderr[-3000:]}")
    return done.stdout + done.stderr
