"""The C that evaluates several states or runs side by side, in lanes of vectors.

It takes a second or two to compile, so it is compiled when it is first worth that.
"""

import ctypes
import threading
from collections.abc import Callable

from .manifest import CheckedFolder
from .snapshot import model_library

MIN_BATCH = 1000  # states: from here on a batch pays for compiling
LAZY_SOURCES = ("batch", "flights")  # sources of a model that are compiled when they are needed
NO_BATCH: dict = {"states": 1, "work": {}}  # of models without C
RecordFunction = Callable[[int], int]  # takes the address of a record, returns a status


class LazyLibrary:
    """A source of one model that is compiled when it is first needed, not with the model."""

    def __init__(self, checked: CheckedFolder, profile: str, part: str):
        self.checked, self.profile = checked, profile
        self.source = f"src/{checked.manifest['prefix']}_{part}.c"
        self.library: ctypes.CDLL | None = None
        self.lock = threading.Lock()

    def function(self, name: str) -> RecordFunction:
        """Return a function that takes the address of a record and returns a status."""
        with self.lock:
            if self.library is None:
                path = model_library(self.checked, [self.source], self.profile)
                self.library = ctypes.CDLL(str(path))
        function = getattr(self.library, name)
        function.argtypes = [ctypes.c_void_p]
        return function


class BatchLibrary:
    """The C of one model that evaluates batches, and that simulates batches of flights."""

    def __init__(self, checked: CheckedFolder, profile: str):
        self.prefix = checked.manifest["prefix"]
        batch = checked.manifest.get("batch", NO_BATCH)
        self.states: int = batch["states"]
        self.work: dict[str, int] = batch["work"]
        self.batch, self.rollouts = (LazyLibrary(checked, profile, part) for part in LAZY_SOURCES)

    def entry(self, name: str, count: int) -> RecordFunction | None:
        """Return the C function for a batch of so many states, None where it is not worth it."""
        if name not in self.work or count < (
            MIN_BATCH if self.batch.library is None else self.states
        ):
            return None
        return self.batch.function(f"{self.prefix}_side_by_side_{name}")
