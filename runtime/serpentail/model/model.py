"""Models: what a generated folder, its parameters and its compiled C make together."""

import ctypes
from collections.abc import Mapping
from contextlib import suppress
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from ..errors import ModelError, SerpentailError
from ..extras import needed
from .batch import BatchLibrary
from .cache import cache_folder
from .cores import checked_threads
from .functions import Array, Functions
from .kept import kept
from .kernel import Kernel
from .layout import Layout
from .library import open_library
from .manifest import CheckedFolder, read_folder
from .parameters import (
    RunParameters,
    Value,
    flat,
    independent,
    merged,
    real_type,
    resolve,
)
from .sizes import warn_of_sizes
from .snapshot import restored, snapshot
from .tail import links_of, words_of

if TYPE_CHECKING:
    from .casadi import CasadiFunctions
    from .stepping.step import Stepping


def load(
    folder: str | PathLike[str],
    parameters: Mapping[str, object] | None = None,
    profile: str | None = None,
    compiled: bool = True,
    threads: int | None = None,
) -> "Model":
    """Return the model of a generated folder, its C compiled (or taken from the cache) and loaded.

    parameters: name -> number or 3 numbers, in SI or with units, such as "3.5 g"; override the
    scene's, without recompiling.
    profile: "fast" (this CPU, FMA) or "reproducible" (same bits everywhere); None: the scene's.
    compiled: False needs no C compiler; then only ``model.casadi`` evaluates.
    threads: most that its batches and many runs use; None: $SERPENTAIL_THREADS, else one a core
    that this process may use, one in workers of process pools.
    Raises ModelError (folder missing, stale or changed; parameter unknown or unphysical),
    CompilerNotFound, CompileFailed.  Warns UnusualSize of what no animal or robot has, UnlikeBodies
    where torso and tail are so unlike in size that H loses digits.
    """
    try:
        folder = Path(folder)
    except TypeError:
        raise ModelError(
            f"folder: value {folder!r:.60}: needs the path of a generated folder"
        ) from None
    return model_from(read_folder(folder), parameters, profile, compiled, threads)


def model_from(
    checked: CheckedFolder,
    parameters: Mapping[str, object] | None,
    profile: str | None = None,
    compiled: bool = True,
    threads: int | None = None,
) -> "Model":
    """Return the model of a folder that was checked, as ``load`` does."""
    manifest = checked.manifest
    values = resolve(manifest, parameters)
    warn_of_sizes(manifest, values, 3)  # who calls st.load
    profile = manifest["scene"]["profile"] if profile is None else profile
    if not isinstance(compiled, bool | np.bool_):
        raise ModelError(f"compiled: value {compiled!r:.60}: needs True or False")
    if compiled and "c" not in manifest["scene"]["targets"]:
        raise _without_c(manifest)
    threads = None if threads is None else checked_threads("threads", threads, ModelError)
    library = open_library(checked, profile) if compiled else None
    batches = BatchLibrary(checked, profile, threads)
    return Model(checked, values, library, profile, batches)


def _unpickled(
    manifest_hash: str,
    folder: Path,
    parameters: Mapping[str, object],
    profile: str,
    options: tuple[bool, int | None],
) -> "Model":
    """Return a pickled model, of the manifest that it was pickled with."""
    return model_from(restored(manifest_hash, folder), parameters, profile, *options)


def _without_c(manifest: Mapping[str, Any]) -> ModelError:
    """Return the error that a model has no C."""
    return ModelError(
        f"{manifest['prefix']} was generated without C: load it with compiled=False for "
        'model.casadi, or add "c" to `targets` of the scene, then generate it again'
    )


class Model(Functions):
    """Equations of motion H(q) v_dot + C(q, v) = [0 (6); tau] + J^T f of one tail, SI units.

    q (nq = 7 + 2m): position of B in the world, quaternion (w, x, y, z) of any norm but 0, tail
    coordinates: joint angles (alpha_i, beta_i) of links, bend components (a_i, b_i) of arcs, or
    polar angles (phi_i, theta_i) of a continuum whose scene has coordinates = "polar", which is for
    comparison only. v (nv = 6 + 2m): velocity of B in the world, angular velocity in
    the body frame, rates of the tail coordinates. Every method also takes arrays with a leading
    batch axis; a single state is repeated over a batch.  All raise StateError on a wrong shape or a
    value that is not finite, ModelError where the scene left the function out. With the profile
    "fast" the last digits of a state may depend on the size of its batch. Threads may share a
    model. Whatever becomes of its folder, it goes on as it was checked, and so does a pickled one.
    """

    def __init__(
        self,
        checked: CheckedFolder,
        parameters: Mapping[str, Any],
        library: ctypes.CDLL | None,
        profile: str = "fast",
        batch_library: BatchLibrary | None = None,
    ):
        manifest = checked.manifest
        self.checked, self.folder, self.manifest = checked, checked.folder, manifest
        self.parameters, self.library, self.profile = parameters, library, profile
        # what the tail is made of
        self.name: str = manifest["prefix"]
        self.kind: str = manifest["scene"]["kind"]
        self.segments: int = manifest["dimensions"]["segments"]
        # of each segment: its kind, and its links, 0 of an arc
        self.kinds: tuple[str, ...] = tuple(
            manifest["dimensions"].get("kinds") or (self.kind,) * self.segments
        )
        self.links = links_of(manifest["dimensions"]["links"], self.kinds)
        jointed = self.kind == "articulated"
        self.samples: int | None = None if jointed else manifest["scene"]["samples"]
        # how many joints turn by the coordinates of each segment (m,); 1 of an arc
        links = np.broadcast_to(0 if self.links is None else self.links, self.segments)
        self.joints_each = np.maximum(links, 1)
        self.fixed: bool = manifest["scene"].get("base") == "fixed"
        self.layout = Layout(self.segments, self.fixed)
        self.nq, self.nv = self.layout.nq, self.layout.nv
        self.contacts = {entry["group"]: entry["count"] for entry in manifest["contacts"]}
        # its functions, as compiled
        self.parameter_vector = np.array(flat(manifest, parameters), real_type(manifest))
        self.parameter_vector.setflags(write=False)  # with_parameters makes another model
        self.batch_library = batch_library or BatchLibrary(checked, profile)
        self.kernels: dict[str, Kernel] = {}
        if library is not None:
            libraries = library, self.batch_library
            for name in manifest["functions"]:
                self.kernels[name] = Kernel(libraries, manifest, name, self.parameter_vector)

    def __repr__(self) -> str:
        return f"<serpentail.Model {self.name}: {self.tail_words()}, nv = {self.nv}>"

    def tail_words(self) -> str:
        """Return what the tail is made of, in words."""
        return words_of(self.links, self.segments)

    def with_parameters(self, **changes: ArrayLike) -> "Model":
        """Return this model with other parameters; nothing is compiled.  Warns as ``load`` does."""
        values = resolve(self.manifest, merged(self._independent(), changes))
        warn_of_sizes(self.manifest, values)
        return self._twin(values)

    def _twin(self, parameters: Mapping[str, Any]) -> "Model":
        """Return a model of the same code."""
        return Model(self.checked, parameters, self.library, self.profile, self.batch_library)

    def __copy__(self) -> "Model":
        return self._twin(self.parameters)

    def __deepcopy__(self, _: dict[int, Any]) -> "Model":
        return self._twin(self.parameters)  # nothing in it changes

    def parameters_of_runs(self, changes: Mapping[str, object] | None, runs: int) -> RunParameters:
        """Return the parameters of many runs; changes: name -> (runs,) or (runs, 3), SI."""
        if changes is None or (isinstance(changes, Mapping) and not changes):
            vector = self.parameter_vector
            vectors = vector[None] if runs == 1 else np.broadcast_to(vector, (runs, len(vector)))
            return RunParameters({}, self.parameters, vectors)
        parameters = RunParameters.checked(self.manifest, self._independent(), changes, runs)
        warn_of_sizes(self.manifest, parameters.values, 4)  # who calls st.simulate
        return parameters

    def _independent(self) -> dict[str, Value]:
        """Return the parameters that the others follow from; none where they are baked."""
        if self.manifest["scene"]["baked"]:
            return {}
        return independent(self.manifest, self.parameters)

    def __reduce__(self) -> tuple[Any, ...]:
        with suppress(SerpentailError):  # a folder that is as it was serves too
            snapshot(self.checked, cache_folder(None))
        return _unpickled, (
            self.checked.manifest_hash,
            self.folder.absolute(),
            self._independent(),
            self.profile,
            (self.library is not None, self.batch_library.threads),
        )

    @kept
    def generated(self) -> tuple[str, ...]:
        """Names of all functions that were generated, the rollout of simulations included."""
        return tuple(self.manifest["functions"] | self.manifest.get("work", {}))

    def kernel(self, name: str) -> Kernel:
        """Return a compiled function; ModelError where the scene did not ask for it."""
        kernel = self.kernels.get(name)
        if kernel is None and self.library is None:
            raise ModelError(
                f"{self.name} was loaded with compiled=False: only model.casadi evaluates; load it "
                "again"
            )
        if kernel is None:
            raise self.without(name)
        return kernel

    def refuse_fixed(self, what: str) -> None:
        """Raise ModelError where the base is fixed: only a free torso has what is asked for."""
        if self.fixed:
            raise ModelError(
                f"{what}: {self.name} has a fixed base, which neither flies nor lands: generate it "
                'again with base = "free"'
            )

    def without(self, *names: str) -> ModelError:
        """Return the error that functions are not there."""
        if set(names) & set(self.manifest["scene"]["functions"]):  # what only C can do
            return _without_c(self.manifest)
        has = ", ".join(self.generated)
        return ModelError(
            f"{self.name} was generated without {', '.join(map(repr, names))} (it has {has}): add "
            "it to `functions` of the scene, then generate it again"
        )

    def step(
        self, q: ArrayLike, v: ArrayLike, tau: ArrayLike, h: float, **settings: Any
    ) -> tuple[Array, ...]:
        """(q, v) after a step of h (s) under torques tau (2m,) (N m) that stay; or of k runs.

        q (nq,) or (k, nq), v, tau likewise: each run has torques of its own.  In flight by "rk4",
        with contacts by "implicit_euler", whose state has bristles, too: (q, v, bristles).
        steps: how many, of h each, 1 by default.  out: arrays that the results are written to,
        which may be q and v themselves: then nothing is allocated.  parameters: name -> (k,) or
        (k, 3), or what ``parameters_of_runs`` made of it before.  bristles (2K,), legs (8,), of
        all or of each: as in ``contact_dynamics``; legs move on at their rates.  method: "rk4" or
        "implicit_euler".  threads: at most so many; None: the model's, see ``load``.
        statuses (k,) of ``numpy.intc``: is told how each run went, 0 well, and no run raises.

        Eight flights or more are made in lanes, whose C is compiled at the first such call.
        Raises StateError (shapes, values), SimulationError (h and other settings; a run that
        cannot go on: it stays where it came to, the others are stepped), ModelError (the scene
        left out rollout, or implicit on the ground).
        """
        from .stepping.step import step

        return step(self, (q, v, tau), h, settings)

    @kept
    def stepping(self) -> "Stepping":
        """What ``step`` keeps between calls."""
        from .stepping.step import Stepping

        return Stepping(self)

    @kept
    def casadi(self) -> "CasadiFunctions":
        """``casadi.Function``s by name, parameters folded in: ``model.casadi.energy(q, v)``.

        ExtraMissing without the extra "plan".
        """
        needed("casadi", "plan")
        from .casadi import CasadiFunctions

        return CasadiFunctions(self)
