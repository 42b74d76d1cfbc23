"""Functions that a model lacks are added to it: it is generated again with them, and compiled."""

import threading
from collections.abc import Callable, Sequence
from ctypes import CDLL
from functools import cache
from typing import TYPE_CHECKING

from serpentail_scene.purposes import together
from serpentail_scene.signatures.table import ALL

from ..compiling.threads import after_fork
from .compiled_functions import CompiledFunctions, generated_functions
from .library import BatchLibrary, open_library
from .manifest import CheckedFolder

if TYPE_CHECKING:
    from .model import Model

Grow = Callable[[Sequence[str]], CheckedFolder]  # generates a model with these functions
_gate = cache(threading.Lock)  # one thread of a process at a time adds functions
after_fork(_gate.cache_clear)


def grown(model: "Model", names: Sequence[str]) -> None:
    """Add functions to a model; an error or an interruption leaves it as it was."""
    with _gate():
        lacking = [name for name in names if name not in model.generated]
        if not lacking:
            return  # another thread was first
        scene = model.manifest["scene"]
        known = {*lacking} <= {*ALL} - {*scene["functions"]}  # without C nothing runs these
        if model.grow is None or not known:
            raise model.without(*lacking)
        more = together(scene, lacking[0]) if len(lacking) == 1 else lacking
        checked = model.grow([name for name in ALL if name in {*scene["functions"], *more}])
        library = None if model.library is None else open_library(checked, model.profile)
        batches = BatchLibrary(checked, model.profile, model.batch_library.threads)
        take_over(model, checked, library, batches)


def take_over(
    model: "Model", checked: CheckedFolder, library: CDLL | None, batch_library: BatchLibrary
) -> None:
    """Let a model have this code, at once: no thread sees parts of the code before."""
    vars(model).update(
        checked=checked,
        folder=checked.folder,
        manifest=checked.manifest,
        library=library,
        batch_library=batch_library,
        kernels=CompiledFunctions(model, checked, library, batch_library),
        generated=generated_functions(checked.manifest),
    )
    vars(model).pop("stepping", None)  # it is made anew
