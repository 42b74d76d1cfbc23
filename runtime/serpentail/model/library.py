"""The compiled C of a model: its status codes, and its libraries, of which some are made late.

The C that evaluates several states or runs side by side, in lanes of vectors, takes a second or two
to compile, so it is compiled when it is first worth that.
"""

import ctypes
import threading
from collections.abc import Callable, Sequence
from pathlib import Path
from weakref import WeakSet

from ..basics.errors import ModelError
from ..compiling.cache import cache_folder
from ..compiling.compiler import library_in_cache, library_of, opened
from ..compiling.threads import after_fork
from .lazy import lazy_property
from .manifest import CheckedFolder, remedy, snapshot

NOT_POSITIVE_DEFINITE, NOT_FINITE, OUT_OF_RANGE = 1, 2, 3
PAUSED, STEP_TOO_SMALL, TOO_MANY_STEPS, STOPPED_AT_EVENT, TORQUE_FAILED = range(32, 37)
STEP_TOO_LONG, BAD_TIMES = 38, 39
WHY = {  # a run cannot go on
    NOT_FINITE: (
        "the state is not finite any more: is the step too long, or a velocity or torque too large?"
    ),
    NOT_POSITIVE_DEFINITE: (
        "the inertia matrix is not positive definite: is the step too long, or a torque too large?"
    ),
    OUT_OF_RANGE: (
        "a segment is bent beyond the scene's bend_range: is the torque "
        "too large, or the range too small?"
    ),
    STEP_TOO_SMALL: (
        "the tolerance would need steps that are too short: is the motion stiff, or rtol too small?"
    ),
    TOO_MANY_STEPS: "most_steps were not enough: is the motion stiff, or rtol too small?",
    STEP_TOO_LONG: (
        "a step turns the torso too far to tell what it touches: is it too long, or omega too "
        "large?"
    ),
    BAD_TIMES: "the samples are too close: in the model's numbers their times do not increase",
    TORQUE_FAILED: "the compiled torque function returned an error status, not 0: check it",
}


MIN_BATCH = 1000  # states: from here on a batch pays for compiling
# sources of a model that are compiled when they are needed
LAZY_SOURCES = (
    "batch",
    "batch_derivatives",
    "batch_airborne",
    "batch_contact",
    "flights",
    "ground",
)
NO_BATCH: dict = {"states": 1, "work": {}, "parts": {}}  # of models without C
RecordFunction = Callable[[int], int]  # takes the address of a record, returns a status


def open_library(checked: CheckedFolder, profile: str) -> ctypes.CDLL:
    """Load a model's C, compiled or from the cache; ModelError if its interface is another."""
    manifest, prefix = checked.manifest, checked.manifest["prefix"]
    lazy = {f"src/{prefix}_{part}.c" for part in LAZY_SOURCES}
    sources = [name for name in checked.files if name.startswith("src/") and name not in lazy]
    library = opened(lambda: model_library(checked, sources, profile))
    abi_hash = getattr(library, f"{prefix}_abi_hash")
    abi_hash.restype = ctypes.c_char_p
    if abi_hash().decode() != manifest["abi_hash"]:
        raise ModelError(
            f"{library._name} has interface {abi_hash().decode()}, the manifest "
            f"{manifest['abi_hash']}: {remedy(checked.folder)}"
        )
    return library


def model_library(checked: CheckedFolder, sources: Sequence[str], profile: str) -> Path:
    """Return the library of some of a model's sources; errors as of ``compile_library``.

    If it has to be compiled, the cache gets a snapshot of the model, too.
    """
    cache, digests = cache_folder(), _digests(checked, sources)

    def texts() -> dict[str, bytes]:
        snapshot(checked, cache)
        return {name: checked.files[name] for name in digests}

    return library_of(digests, texts, profile, cache)


def _digests(checked: CheckedFolder, sources: Sequence[str]) -> dict[str, str]:
    """Return the SHA-256 of sources, and of the headers that they can include."""
    digests = checked.manifest["files"]
    return {name: digests[name] for name in digests if name in sources or name.endswith(".h")}


class LazyLibrary:
    """A part of a model's C that is compiled when it is first worthwhile, not with the model.

    missed: seconds that it would have saved so far.
    """

    def __init__(self, checked: CheckedFolder, profile: str, part: str):
        self.checked, self.profile = checked, profile
        self.source = f"src/{checked.manifest['prefix']}_{part}.c"
        self.library: ctypes.CDLL | None = None
        self.lock = threading.Lock()
        self.missed = 0.0
        _lazy.add(self)

    @property
    def bytes(self) -> int:
        """Length of its text."""
        return len(self.checked.files[self.source])

    @lazy_property
    def at_hand(self) -> bool:
        """Whether the cache had it when that was first asked."""
        digests = _digests(self.checked, [self.source])
        return library_in_cache(digests, self.profile, cache_folder()) is not None

    def function(self, name: str) -> RecordFunction:
        """Return a function that takes the address of a record and returns a status."""
        with self.lock:
            if self.library is None:
                sources = [self.source]
                self.library = opened(lambda: model_library(self.checked, sources, self.profile))
        function = getattr(self.library, name, None)
        if function is None:
            raise ModelError(
                f"{self.checked.folder} has no C function {name}, an older generator made it: "
                f"{remedy(self.checked.folder)}"
            )
        function.argtypes = [ctypes.c_void_p]
        return function


_lazy: WeakSet[LazyLibrary] = WeakSet()


def _open_locks() -> None:
    """Renew the locks in a forked child: the thread that held one is not there to release it."""
    for library in _lazy:
        library.lock = threading.Lock()


after_fork(_open_locks)


class BatchLibrary:
    """The C of one model that evaluates batches, and that simulates or steps batches of runs.

    threads: largest number for a batch; None: as many as the process may use.
    """

    def __init__(self, checked: CheckedFolder, profile: str, threads: int | None = None):
        self.prefix, self.threads = checked.manifest["prefix"], threads
        batch = checked.manifest.get("batch", NO_BATCH)
        self.states: int = batch["states"]
        self.work: dict[str, int] = batch["work"]
        self.parts: dict[str, str] = batch["parts"]
        self.sources = {part: LazyLibrary(checked, profile, part) for part in LAZY_SOURCES}
        self.rollouts = self.sources["flights"]

    def entry(self, name: str, count: int) -> RecordFunction | None:
        """Return the C function for a batch of this size; None if it is not worthwhile."""
        if name not in self.work:
            return None
        source = self.sources[self.parts[name]]
        if count < (MIN_BATCH if source.library is None else self.states):
            return None
        return source.function(f"{self.prefix}_side_by_side_{name}")
