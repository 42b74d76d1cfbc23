"""Opens the compiled C of a model, as ctypes has it, and names its status codes."""

import ctypes

from ..errors import ModelError, SerpentailError
from .batch import LAZY_SOURCES
from .manifest import CheckedFolder, remedy
from .snapshot import model_library

NOT_POSITIVE_DEFINITE, NOT_FINITE, OUT_OF_RANGE = 1, 2, 3


def open_library(checked: CheckedFolder, profile: str) -> ctypes.CDLL:
    """Load a model's C, compiled or from the cache; ModelError where it is another's interface."""
    manifest, prefix = checked.manifest, checked.manifest["prefix"]
    lazy = {f"src/{prefix}_{part}.c" for part in LAZY_SOURCES}
    sources = [name for name in checked.files if name.startswith("src/") and name not in lazy]
    path = model_library(checked, sources, profile)
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
            f"{remedy(checked.folder)}"
        )
    return library
