"""From C and C++ sources and the Pinocchio installed here to timed closures of forward dynamics."""

from __future__ import annotations

import ctypes
import functools
import hashlib
import os
import shlex
import shutil
import subprocess
import sys
from collections.abc import Mapping, Sequence
from importlib import metadata
from pathlib import Path
from typing import NamedTuple

import numpy as np

HERE = Path(__file__).resolve().parent
TUNED, PLAIN, TIMER_SOURCE = (
    HERE / "pinocchio_chain.cpp",
    HERE / "pinocchio_plain.cpp",
    HERE.parent / "native" / "timer.c",
)
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
# In the order of the array that pinocchio_chain_new takes.
PARAMETERS = (
    "gravity",
    "torso_mass",
    "torso_inertia",
    "tail_mount",
    "tail_mass",
    "tail_length",
    "link_inertia",
)


class PeerUnavailable(RuntimeError):
    """A peer cannot be built or timed on this machine; the message says what to install."""


class Closure(NamedTuple):
    """Addresses of an `int f(void *context, q, v, tau, v_dot)` of doubles and of its context."""

    function: int
    context: int | None = None


class States(NamedTuple):
    """Rows of q (count, 7 + 2m), v (count, 6 + 2m) and tau (count, 2m)."""

    q: np.ndarray
    v: np.ndarray
    tau: np.ndarray


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


class PinocchioBench:
    """The articulated tail in Pinocchio: v_dot, H and C of one state, and closures for the
    timer.
    """

    def __init__(self, segments: int, links: int, parameters: Mapping, library: Path | None = None):
        """Build the chain from parameters by name (SI), link_inertia among them."""
        self.nv = 6 + 2 * segments
        self._library = _declared(library or build_library(TUNED, CACHE))
        values = np.hstack([parameters[name] for name in PARAMETERS])
        self._chain = self._library.pinocchio_chain_new(segments, links, _pointer(values))
        if not self._chain:
            raise PeerUnavailable(
                f"Pinocchio could not build a chain of {segments} x {links} links."
            )

    @property
    def closure(self) -> Closure:
        """The fastest path to v_dot."""
        return self._closure("pinocchio_forward_dynamics")

    @property
    def crba_closure(self) -> Closure:
        """The path through Pinocchio's CRBA of the full chain."""
        return self._closure("pinocchio_forward_dynamics_crba")

    @property
    def derivatives_closure(self) -> Closure:
        """The path to the Jacobians of v_dot through computeRNEADerivatives; of PLAIN and
        DERIVATIVES.
        """
        return self._closure("pinocchio_forward_dynamics_derivatives")

    @property
    def own_derivatives_closure(self) -> Closure:
        """The path to the Jacobians of v_dot by own sums; of DERIVATIVES."""
        return self._closure("pinocchio_forward_dynamics_derivatives_own")

    def forward_dynamics_derivatives(self, q, v, tau, path: str = "") -> tuple[np.ndarray, ...]:
        """Jacobians of v_dot, all relative to the torso: dq (nv, nv), dv (nv, nv), dtau (nv, nv -
        6); path: "_own".
        """
        self._call(f"pinocchio_forward_dynamics_derivatives{path}", (self.nv,), q, v, tau)
        results = tuple(np.empty((self.nv, columns)) for columns in (self.nv, self.nv, self.nv - 6))
        self._library.pinocchio_derivatives_result(self._chain, *map(_pointer, results))
        return results

    def forward_dynamics(self, q, v, tau) -> np.ndarray:
        """v_dot (nv) by the fastest path."""
        return self._call("pinocchio_forward_dynamics", (self.nv,), q, v, tau)

    def forward_dynamics_crba(self, q, v, tau) -> np.ndarray:
        """v_dot (nv) by the path through CRBA."""
        return self._call("pinocchio_forward_dynamics_crba", (self.nv,), q, v, tau)

    def mass_matrix(self, q) -> np.ndarray:
        """H (nv, nv)."""
        return self._call("pinocchio_mass_matrix", (self.nv, self.nv), q)

    def bias_force(self, q, v) -> np.ndarray:
        """C (nv), gravity included."""
        return self._call("pinocchio_bias_force", (self.nv,), q, v)

    def close(self) -> None:
        """Free the chain; closures of it must not be called any more."""
        self._library.pinocchio_chain_free(self._chain)
        self._chain = None

    def __enter__(self) -> PinocchioBench:
        """Return itself."""
        return self

    def __exit__(self, *_error) -> None:
        """Free the chain."""
        self.close()

    def _closure(self, name: str) -> Closure:
        return Closure(
            ctypes.cast(getattr(self._library, name), ctypes.c_void_p).value, self._chain
        )

    def _call(self, name: str, shape: tuple[int, ...], *inputs) -> np.ndarray:
        arrays = [np.ascontiguousarray(x, dtype=float) for x in inputs]
        out = np.empty(shape)
        if getattr(self._library, name)(self._chain, *map(_pointer, arrays), _pointer(out)):
            raise FloatingPointError(f"{name}: the mass matrix is not positive definite")
        return out


def time_rounds(
    closures: Sequence[Closure], states: States, rounds: int, calls: int
) -> list[tuple[float, float]]:
    """(minimum, median) over the rounds of the ns per call of each closure, in rounds A B C, A B C,
    ...
    """
    arrays = States(*(np.ascontiguousarray(x, dtype=float) for x in states))
    count = len(arrays.q)
    if not closures or min(rounds, calls, count) < 1 or any(len(x) != count for x in arrays):
        raise ValueError(
            "closures, rounds, calls and states: one at least, and as many q as v and tau"
        )
    both = np.empty((2, len(closures)))
    failures = _timer().time_rounds(
        len(closures),
        (_Closure * len(closures))(*(tuple(closure) for closure in closures)),
        ctypes.byref(_States(count, *(x.shape[1] for x in arrays), *map(_pointer, arrays))),
        rounds,
        calls,
        *map(_pointer, both),
    )
    if failures:
        raise RuntimeError(
            "out of memory" if failures < 0 else f"{failures} calls reported a failure"
        )
    return [(float(least), float(median)) for least, median in both.T]


def random_states(segments: int, count: int = 64, seed: int = 0) -> States:
    """Tumbling torsos with moderately bent tails, the same ones for the same arguments."""
    rng = np.random.default_rng([seed, segments])
    q = rng.uniform(-1, 1, (count, 7 + 2 * segments))
    q[:, 3:7] = rng.normal(size=(count, 4))
    q[:, 3:7] /= np.linalg.norm(q[:, 3:7], axis=1, keepdims=True)
    v = rng.uniform(-10, 10, (count, 6 + 2 * segments))
    return States(q, v, rng.uniform(-1e-3, 1e-3, (count, 2 * segments)))


class _Closure(ctypes.Structure):
    """`struct closure` of timer.c."""

    _fields_ = (("function", ctypes.c_void_p), ("context", ctypes.c_void_p))


class _States(ctypes.Structure):
    """`struct states` of timer.c."""

    _fields_ = (
        *((name, ctypes.c_size_t) for name in ("count", "nq", "nv", "n_tau")),
        *((name, ctypes.c_void_p) for name in States._fields),
    )


@functools.cache
def _timer() -> ctypes.CDLL:
    """timer.c, compiled and declared."""
    library = ctypes.CDLL(str(build_library(TIMER_SOURCE, CACHE)))
    library.time_rounds.argtypes = [
        ctypes.c_int,
        ctypes.POINTER(_Closure),
        ctypes.POINTER(_States),
        *[ctypes.c_int] * 2,
        *[ctypes.c_void_p] * 2,
    ]
    return library


def _declared(path: Path) -> ctypes.CDLL:
    """The library of a Pinocchio source; every pointer is passed as an address."""
    library = ctypes.CDLL(str(path))
    library.pinocchio_chain_new.restype = ctypes.c_void_p
    library.pinocchio_chain_new.argtypes = [ctypes.c_int, ctypes.c_int, ctypes.c_void_p]
    library.pinocchio_chain_free.restype = None
    pointers = {"chain_free": 1, "mass_matrix": 3, "bias_force": 4}
    pointers |= {
        "forward_dynamics": 5,
        "forward_dynamics_crba": 5,
        "forward_dynamics_derivatives": 5,
    }
    pointers |= {"forward_dynamics_derivatives_own": 5, "derivatives_result": 4}
    for name in (name for name in pointers if hasattr(library, f"pinocchio_{name}")):
        getattr(library, f"pinocchio_{name}").argtypes = [ctypes.c_void_p] * pointers[name]
    return library


def _pointer(array: np.ndarray) -> int:
    """Address of a contiguous array's first element; the caller keeps the array."""
    return array.ctypes.data


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
