"""Opens the compiled C of a model, as ctypes has it, and names its status codes."""

import ctypes
from pathlib import Path

from ..errors import ModelError, SerpentailError
from .batch import LAZY_SOURCES
from .compiler import compile_library
from .manifest import remedy

NOT_POSITIVE_DEFINITE, NOT_FINITE, OUT_OF_RANGE = 1, 2, 3


def open_library(folder: Path, manifest: dict, profile: str) -> ctypes.CDLL:
    """Load a model's C, compiled or from the cache; ModelError where it is another's interface."""
    prefix = manifest["prefix"]
    lazy = {f"src/{prefix}_{part}.c" for part in LAZY_SOURCES}
    sources = [
        folder / name for name in manifest["files"] if name.startswith("src/") and name not in lazy
    ]
    path = compile_library(sources, folder / "include", profile)
    try:
        library = ctypes.CDLL(str(path))
    except OSError as error:
        raise SerpentailError(
            f"the compiled model cannot be loaded ({error}): set SERPENTAIL_CACHE"
        ) from error
    abi_hash = getattr(library, f"{prefix}_abi_hash")
    abi_hash.restype = ctypes.c_char_p
    if abi_hash().decode() != manifest["abi_hash"]:
        raise ModelError(
            f"{path} has interface {abi_hash().decode()}, the manifest {manifest['abi_hash']}: "
            f"{remedy(folder)}"
        )
    return library
