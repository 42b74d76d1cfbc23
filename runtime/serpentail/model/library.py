"""Opens the compiled C of a model with ctypes, and names its status codes."""

import ctypes

from ..basics.errors import ModelError
from ..compiling.compiler import opened
from .batch import LAZY_SOURCES
from .manifest import CheckedFolder, remedy
from .snapshot import model_library

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
