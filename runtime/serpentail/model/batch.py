"""The C that evaluates several states or runs side by side, in lanes of vectors.

It takes a second or two to compile, so it is compiled when it is first worth that.
"""

import ctypes
import threading
from collections.abc import Callable
from typing import Any
from weakref import WeakSet

from ..basics.errors import ModelError
from ..compiling.compiler import opened
from ..compiling.threads import after_fork
from .lazy import lazy_property
from .manifest import CheckedFolder, remedy
from .snapshot import library_in_cache, model_library

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
        return library_in_cache(self.checked, [self.source], self.profile) is not None

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

    def address(self, name: str) -> int:
        """Return the address of the C function for strided states, for kernels in C.

        It takes the record of a call, and for each of its arrays the stride between states.
        KeyError if the model has no batches of that function.
        """
        source = self.sources[self.parts[name]]
        function: Any = source.function(f"{self.prefix}_side_by_side_{name}_apart")
        return ctypes.cast(function, ctypes.c_void_p).value or 0

    def entry(self, name: str, count: int) -> RecordFunction | None:
        """Return the C function for a batch of this size; None if it is not worthwhile."""
        if name not in self.work:
            return None
        source = self.sources[self.parts[name]]
        if count < (MIN_BATCH if source.library is None else self.states):
            return None
        return source.function(f"{self.prefix}_side_by_side_{name}")
