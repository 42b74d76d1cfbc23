"""``load`` makes a model of a generated folder: it checks the folder and compiles its C."""

from collections.abc import Mapping
from os import PathLike
from pathlib import Path

import numpy as np

from ..basics.errors import ModelError
from ..compiling.threads import checked_threads
from .compiled_functions import without_c
from .even_arcs import warn_of_even_arcs
from .growth import Grow
from .library import BatchLibrary, open_library
from .manifest import CheckedFolder, read_folder
from .model import Model
from .parameters import resolve, warn_of_parameters


def load(
    folder: str | PathLike[str],
    parameters: Mapping[str, object] | None = None,
    profile: str | None = None,
    compiled: bool = True,
    threads: int | None = None,
) -> Model:
    """Load the model of a generated folder; compile its C, or take it from the cache.

    Parameters
    ----------
    folder : str or path
        Folder that the generator wrote, such as ``"generated/articulated_m3_n4"``.
    parameters : mapping, optional
        Parameter name to number, or to a sequence of numbers, in SI or as text with a unit, such
        as ``"3.5 g"``. They replace the scene's values; nothing is compiled again.
    profile : {"fast", "reproducible"}, optional
        How the C is compiled: "fast" for this CPU, with fused multiply-add; "reproducible" so
        that every machine computes the same bits. Default: the scene's profile.
    compiled : bool, default True
        False needs no C compiler; then only ``model.casadi`` can evaluate functions.
    threads : int, optional
        Largest number of threads for batches and for many runs. Default: the environment
        variable ``SERPENTAIL_THREADS``; without it one thread for each core that this process
        may use, or one thread in a worker of a process pool.

    Returns
    -------
    Model
        The model with its parameters.

    Raises
    ------
    ModelError
        The folder is missing, stale or changed; a parameter is unknown or unphysical; a setting
        is wrong.
    CompilerNotFound
        No C compiler works on this machine.
    CompileFailed
        The C compiler reported an error.

    Warns
    -----
    UnusualSize
        A parameter has a size that no animal or robot has; most often a unit is wrong.
    UnlikeBodies
        Torso and tail differ so much in size that the inertia matrix H loses digits.

    See Also
    --------
    build : Generate, compile and load a model in one call.

    Examples
    --------
    >>> import serpentail as st
    >>> model = st.load("generated/articulated_m1_n3", {"tail_mass": "3.5 g"})  # doctest: +SKIP
    >>> model.nq, model.nv  # doctest: +SKIP
    (9, 8)
    """
    try:
        folder = Path(folder)
    except TypeError:
        raise ModelError(
            f"folder: value {folder!r:.60}: needs the path of a generated folder"
        ) from None
    return model_from(read_folder(folder), parameters, None, profile, compiled, threads)


def model_from(
    checked: CheckedFolder,
    parameters: Mapping[str, object] | None,
    grow: Grow | None = None,
    profile: str | None = None,
    compiled: bool = True,
    threads: int | None = None,
) -> Model:
    """Return the model of a folder that was checked; arguments and errors as of ``load``.

    grow: generates the model with other functions.
    """
    manifest = checked.manifest
    values = resolve(manifest, parameters)
    warn_of_parameters(manifest, values, 3)  # 3: the caller of st.load
    warn_of_even_arcs(manifest, values, 3)
    profile = manifest["scene"]["profile"] if profile is None else profile
    if not isinstance(compiled, bool | np.bool_):
        raise ModelError(f"compiled: value {compiled!r:.60}: needs True or False")
    if compiled and "c" not in manifest["scene"]["targets"]:
        raise without_c(manifest)
    threads = None if threads is None else checked_threads("threads", threads, ModelError)
    library = open_library(checked, profile) if compiled else None
    batches = BatchLibrary(checked, profile, threads)
    return Model(checked, values, library, profile, batches, grow)
