"""``Model``: a generated folder, its parameters and its compiled C."""

from __future__ import annotations

import ctypes
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..basics.errors import SerpentailError
from ..basics.extras import needed
from ..basics.near_names import NearNames
from ..compiling.cache import cache_folder
from .chains import layout_of, of_all_coordinates, turns_of
from .growth import Grow, take_over
from .lazy import lazy_property
from .library import BatchLibrary
from .manifest import CheckedFolder, links_of, restored, snapshot
from .methods import ModelMethods
from .parameters import (
    RunParameters,
    Value,
    flat,
    independent,
    merged,
    real_type,
    resolve,
    warn_of_parameters,
)
from .state import Quantities
from .states import ModelStates

if TYPE_CHECKING:
    from .casadi import CasadiFunctions


def _unpickled(
    manifest_hash: str,
    folder: Path,
    parameters: Mapping[str, object],
    profile: str,
    options: tuple[bool, int | None],
    grow: Grow | None,
) -> Model:
    """Return a pickled model: its files are those of the manifest that it was pickled with."""
    from .load import model_from

    return model_from(restored(manifest_hash, folder), parameters, grow, profile, *options)


class Model(ModelMethods, ModelStates, NearNames):
    """Equations of motion of a body with a tail, compiled: H v_dot + C = [0; tau] + J^T f (Eq. 1).

    ``load`` and ``build`` make models. All quantities are in SI units and radians. The world's
    z axis points up. The body frame B has its origin at the torso's centre of mass and its axes
    along the torso's principal axes.

    Attributes
    ----------
    name : str
        Name of the model, which is the prefix of its C functions.
    kind : {"articulated", "continuum", "mixed"}
        Kind of the tail.
    segments : int
        Number m of segments.
    kinds : tuple of str
        Kind of each segment: "articulated", "continuum", or "hinge" in limbs.
    links : int, tuple of int or None
        Links of every segment; a tuple if the numbers differ, with 0 for an arc; None for a
        continuum tail.
    samples : int or None
        Number of sample points of a continuum tail; None for an articulated one.
    joints_each, turns_each : ndarray, shape (m,)
        How many joints share the coordinates of each segment, 1 for an arc; sum of their ratios.
    fixed : bool
        Whether the base is fixed, so that only the tail moves.
    nq, nv, nu : int
        Lengths of ``q``, ``v``, ``tau``: 7 + nt, 6 + nt, nt (``layout.nt``); nt on a fixed base.
    coordinates, velocities, torques : list of str
        Names of their numbers, such as "z", "vz", "alpha_1", "alpha_1_dot" and "tau_alpha_1".
    contacts : dict
        Number of points of each group that can touch the ground: "feet", "tail", "torso", chains.
    parameters : mapping
        Parameter values by name, SI; read-only.
    parameter_vector : ndarray
        The numbers of the C parameter struct in their order; read-only.
    profile : {"fast", "reproducible"}
        How the C was compiled; see ``load``.
    layout : Layout
        Where the parts of ``q``, ``v`` and ``tau`` are; ``model.layout.tail_q`` is the slice of
        the tail coordinates in ``q``. ``model.layout["hind_left"]`` is the part of one chain: its
        slices ``q``, ``v``, ``tau`` and ``points``, and the ``names`` of its coordinates.
    folder : Path
        The generated folder.
    manifest : dict
        Content of its ``manifest.json``.

    Notes
    -----
    A configuration ``q`` (nq,) holds the position of B in the world (m), the quaternion
    (w, x, y, z) from body to world axes, and the nt tail coordinates (rad). The quaternion may
    have any norm except 0. The coordinates of a segment are the joint angles (alpha, beta) that
    all its links share; the bend components (a, b) of an arc, or its polar angles (phi, theta)
    if the scene has ``coordinates = "polar"``, which serves comparisons only; a hinge's angle.

    A velocity ``v`` (nv,) holds the velocity of B in the world (m/s), the angular velocity in
    the body frame (rad/s), and the rates of the tail coordinates (rad/s). On a fixed base ``q``
    and ``v`` hold the tail coordinates and their rates only.

    A derivative with respect to ``q`` is taken in its tangent space: column k is the rate of change
    when ``q`` moves with the velocity e_k. Columns 3 to 5 are rotations of the torso about its body
    axes. N is the number of joints or samples of the tail; K is the number of points that can touch
    the ground, in the order of ``contacts``.

    Every numeric method also takes arrays with a leading batch axis, and repeats a single state
    over the batch. With the profile "fast" the last digits of a result may depend on the size
    of the batch. Every method raises ``StateError`` if a shape is wrong or a value is not
    finite, and ``ModelError`` if the scene left the function out.

    Every numeric method takes ``out``: an array for its result, or a sequence of arrays for its
    results, which it fills and returns. They must be writeable C arrays of the result's type and
    shape, apart from the arguments and from each other; after an error their numbers are undefined.
    Without ``out``, the memory of large results that are gone serves later ones: at most 8 arrays
    of 16 MB each are kept for all models.

    ``crba``, ``nle``, ``rnea`` and ``aba`` are other names of ``mass_matrix``, ``bias_force``,
    ``inverse_dynamics`` and ``forward_dynamics``.

    Several threads may share a model. A model keeps a private copy of the checked files, so it
    and its pickles still work after the folder has changed or is gone.

    Examples
    --------
    >>> import serpentail as st
    >>> model = st.build(tail="articulated", segments=1, links=3)  # doctest: +SKIP
    >>> q, v = [0, 0, 0, 1, 0, 0, 0, 0.1, 0.0], [0] * 8
    >>> model.forward_dynamics(q, v, [0.0, 0.0]).shape  # doctest: +SKIP
    (8,)
    """

    def __init__(
        self,
        checked: CheckedFolder,
        parameters: Mapping[str, Any],
        library: ctypes.CDLL | None,
        profile: str = "fast",
        batch_library: BatchLibrary | None = None,
        grow: Grow | None = None,
    ):
        manifest = checked.manifest
        self.parameters, self.profile, self.grow = parameters, profile, grow
        # the tail
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
        links = np.broadcast_to(0 if self.links is None else self.links, self.segments)
        self.joints_each = np.maximum(links, 1)
        self.turns_each = turns_of(self.joints_each, parameters)
        self.layout = layout_of(manifest, self.kinds)
        self.fixed: bool = self.layout.fixed
        self.nq, self.nv = self.layout.nq, self.layout.nv
        self.contacts = {entry["group"]: entry["count"] for entry in manifest["contacts"]}
        # its compiled functions
        self.parameter_vector = np.array(flat(manifest, parameters), real_type(manifest))
        self.parameter_vector.setflags(write=False)  # with_parameters makes another model
        take_over(self, checked, library, batch_library or BatchLibrary(checked, profile))

    def __repr__(self) -> str:
        return f"<serpentail.Model {self.name}: {self.tail_words()}, nv = {self.nv}>"

    def tail_words(self) -> str:
        """Return in words what the tail is made of, such as "3 x 4 links", or which chains a tree
        has.
        """
        if len(self.layout.chains) > 1:
            return ", ".join(chain.name for chain in self.layout.chains)
        if self.links is None:
            return f"{self.segments} continuum segments"
        if isinstance(self.links, int):
            return f"{self.segments} x {self.links} links"
        if all(self.links):
            return f"{self.segments} segments of {', '.join(map(str, self.links))} links"
        each = (f"{n} links" if n else "an arc" for n in self.links)
        return f"{self.segments} segments: {', '.join(each)}"

    def with_parameters(self, **changes: Quantities) -> Model:
        """Return this model with other parameters; nothing is compiled.

        Parameters
        ----------
        **changes : float or sequence of float
            New values by parameter name, in SI or as text with a unit.

        Returns
        -------
        Model
            A model of the same code; this one does not change.

        Raises
        ------
        ModelError
            A parameter is unknown or unphysical, or the parameters are baked into the code.

        Warns
        -----
        UnusualSize, UnlikeBodies
            As of ``load``.
        """
        varied = self._varied(changes)
        warn_of_parameters(self.manifest, varied.parameters, 2)
        return varied

    def _varied(self, changes: Mapping[str, Any]) -> Model:
        """Return this model with other parameters, whose sizes are not doubted."""
        return self._twin(resolve(self.manifest, merged(self._independent(), changes)))

    def _twin(self, parameters: Mapping[str, Any]) -> Model:
        """Return a model of the same code with these parameters."""
        code, grow = self.kernels, self.grow
        return Model(code.checked, parameters, code.library, self.profile, code.batches, grow)

    def __copy__(self) -> Model:
        return self._twin(self.parameters)

    def __deepcopy__(self, _: dict[int, Any]) -> Model:
        return self._twin(self.parameters)  # nothing in it changes

    def parameters_of_runs(self, changes: Mapping[str, object] | None, runs: int) -> RunParameters:
        """Return the checked parameters of many runs, which ``step`` can take again and again.

        Parameters
        ----------
        changes : mapping or None
            Parameter name to values of shape (runs,) or (runs, 3), SI.
        runs : int
            Number of runs.

        Returns
        -------
        RunParameters
            All parameters of each run.

        Raises
        ------
        ModelError
            A parameter is unknown or unphysical; the message names the run.
        """
        if changes is None or (isinstance(changes, Mapping) and not changes):
            vector = self.parameter_vector
            vectors = vector[None] if runs == 1 else np.broadcast_to(vector, (runs, len(vector)))
            return RunParameters({}, self.parameters, vectors)
        parameters = RunParameters.checked(self.manifest, self._independent(), changes, runs)
        warn_of_parameters(self.manifest, parameters.values, 4)  # 4: the caller of st.simulate
        return parameters

    def _independent(self) -> dict[str, Value]:
        """Return the parameters that determine all others; none if parameters are baked."""
        if self.manifest["scene"]["baked"]:
            return {}
        return independent(self.manifest, self.parameters)

    def __reduce__(self) -> tuple[Any, ...]:
        with suppress(SerpentailError):  # a folder that is as it was serves too
            snapshot(self.checked, cache_folder())
        return _unpickled, (
            self.checked.manifest_hash,
            self.folder.absolute(),
            self._independent(),
            self.profile,
            (self.library is not None, self.batch_library.threads),
            self.grow,
        )

    @lazy_property
    def passive_values(self) -> dict[str, Any]:
        """The parameters, those of springs, damping and stops for the coordinates of all chains."""
        return of_all_coordinates(self.layout, self.parameters)

    @lazy_property
    def casadi(self) -> CasadiFunctions:
        """The model's functions as ``casadi.Function``, by name; needs the extra "plan".

        ``model.casadi.energy`` has the model's parameters folded in. ``symbolic(name)`` and
        ``external(name)`` take a parameter vector as their last input. ExtraMissing is raised if
        CasADi is not installed.
        """
        needed("casadi", "plan")
        from .casadi import CasadiFunctions

        return CasadiFunctions(self)
