"""Many states at once: the C that evaluates several states side by side, compiled when first
needed.
"""

import ctypes
import threading
from pathlib import Path

from .compiler import compile_library

# states: from here on a batch pays for compiling the C of batches, which takes a second or two
MIN_BATCH = 1000
LAZY_SOURCES = ("batch", "flights")  # sources of a model that are compiled when they are needed


class LazyLibrary:
    """A source of one model that is compiled when it is first needed, not with the model."""

    def __init__(self, folder: Path, manifest: dict, profile: str, part: str):
        self.folder, self.source, self.profile = folder, f"{manifest['prefix']}_{part}.c", profile
        self.library, self.lock = None, threading.Lock()

    def function(self, name: str):
        """Return a function that takes a record."""
        with self.lock:
            if self.library is None:
                source = self.folder / "src" / self.source
                self.library = ctypes.CDLL(
                    str(compile_library([source], self.folder / "include", self.profile))
                )
        function = getattr(self.library, name)
        function.argtypes = [ctypes.c_void_p]
        return function


class BatchLibrary:
    """The C of one model that evaluates batches, or simulates flights, several states side by
    side.
    """

    def __init__(self, folder: Path, manifest: dict, profile: str):
        self.prefix, self.states, self.work = (
            manifest["prefix"],
            manifest["batch"]["states"],
            manifest["batch"]["work"],
        )
        self.batch, self.rollouts = (
            LazyLibrary(folder, manifest, profile, part) for part in LAZY_SOURCES
        )

    def entry(self, name: str, count: int):
        """Return the C function for a batch of so many states, or None where one state at a time is
        better.
        """
        if name not in self.work or count < (
            MIN_BATCH if self.batch.library is None else self.states
        ):
            return None
        return self.batch.function(f"{self.prefix}_side_by_side_{name}")
