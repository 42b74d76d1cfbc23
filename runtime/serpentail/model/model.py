"""Models: a generated folder goes in, a model whose methods evaluate its equations of motion comes
out.
"""

from collections.abc import Mapping
from functools import cached_property
from os import PathLike
from pathlib import Path

import numpy as np

from ..checks import finite_array
from ..errors import ModelError, StateError
from .batch import SideBySide
from .kernel import Kernel
from .library import open_library
from .manifest import read_manifest
from .parameters import RunParameters, flat, resolve, warn_of_unlike, without_replaced


def load(
    folder: str | PathLike[str],
    parameters: Mapping[str, object] | None = None,
    profile: str | None = None,
    compiled: bool = True,
) -> "Model":
    """Return the model of a generated folder, its C compiled (or taken from the cache) and loaded.

    parameters: name -> number or 3 numbers, SI; override the scene's, without recompiling.
    profile: "fast" (this CPU, FMA) or "reproducible" (same bits everywhere); None: the scene's.
    compiled: False needs no C compiler; then only ``model.casadi`` evaluates.
    Raises ModelError (folder missing, stale or changed; parameter unknown or unphysical),
    CompilerNotFound,
    CompileFailed.  Warns UnlikeBodies where torso and tail are so unlike in size that H loses
    digits.
    """
    try:
        folder = Path(folder)
    except TypeError:
        raise ModelError(
            f"folder: value {folder!r:.60}: needs the path of a generated folder"
        ) from None
    manifest = read_manifest(folder)
    values = resolve(manifest, parameters)
    warn_of_unlike(values)
    profile = manifest["scene"]["profile"] if profile is None else profile
    if not isinstance(compiled, bool | np.bool_):
        raise ModelError(f"compiled: value {compiled!r:.60}: needs True or False")
    if compiled and "c" not in manifest["scene"]["targets"]:
        raise _without_c(manifest)
    library = open_library(folder, manifest, profile) if compiled else None
    return Model(folder, manifest, values, library, profile)


def _without_c(manifest: Mapping) -> ModelError:
    return ModelError(
        f"{manifest['prefix']} was generated without C: load it with compiled=False for "
        'model.casadi, or add "c" to `targets` of the scene, then generate it again'
    )


class Model:
    """Equations of motion H(q) v_dot + C(q, v) = [0 (6); tau] + J^T f of one tail, SI units.

    q (nq = 7 + 2m): position of B in the world, quaternion (w, x, y, z) of any norm but 0, tail
    coordinates: joint angles (alpha_i, beta_i) of an articulated tail, bend components (a_i, b_i)
    of a continuum, or polar angles (phi_i, theta_i) of one whose scene has coordinates = "polar",
    which is for comparison only. v (nv = 6 + 2m): velocity of B in the world, angular velocity in
    the body frame, rates of the tail coordinates. Every method also takes arrays with a leading
    batch axis; a single state is repeated over a batch.  All raise StateError on a wrong shape or a
    value that is not finite, ModelError where the scene left the function out. With the profile
    "fast" the last digits of a state may depend on the size of its batch. Threads may share a
    model; a pickled one is loaded anew from its folder.
    """

    def __init__(
        self,
        folder: Path,
        manifest: dict,
        parameters: Mapping,
        library,
        profile: str = "fast",
        many=None,
    ):
        self.folder, self.manifest, self.parameters = folder, manifest, parameters
        self.library, self.profile = library, profile
        sizes = manifest["dimensions"]
        self.name = manifest["prefix"]
        self.kind = manifest["scene"]["kind"]
        self.segments = sizes["segments"]
        pieces = sizes["links"]
        self.links, self.samples = (pieces, None) if self.kind == "articulated" else (None, pieces)
        self.nq, self.nv = sizes["nq"], sizes["nv"]
        self.contacts = {entry["group"]: entry["count"] for entry in manifest["contacts"]}
        dtype = np.float32 if manifest["real"] == "float" else np.float64
        self.parameter_vector = np.array(flat(manifest, parameters), dtype)
        made = manifest["functions"] if library else ()
        self.many = many or (SideBySide(folder, manifest, profile) if library else None)
        self.kernels = {
            name: Kernel(library, self.many, manifest, name, self.parameter_vector) for name in made
        }

    def __repr__(self) -> str:
        pieces = f" x {self.links} links" if self.links else " continuum segments"
        return f"<serpentail.Model {self.name}: {self.segments}{pieces}, nv = {self.nv}>"

    def with_parameters(self, **changes) -> "Model":
        """Return this model with other parameters; nothing is compiled.  Warns as ``load`` does."""
        values = resolve(self.manifest, without_replaced(self._given(), changes) | changes)
        warn_of_unlike(values)
        return Model(self.folder, self.manifest, values, self.library, self.profile, self.many)

    def parameters_of_runs(self, changes: Mapping[str, object] | None, runs: int) -> RunParameters:
        """Return the parameters of many runs; changes: name -> (runs,) or (runs, 3), SI, or
        None.
        """
        if changes is None or (isinstance(changes, Mapping) and not changes):
            vectors = np.broadcast_to(self.parameter_vector, (runs, len(self.parameter_vector)))
            return RunParameters({}, self.parameters, vectors)
        found = RunParameters.checked(self.manifest, self._given(), changes, runs)
        warn_of_unlike(found.values, 4)  # who calls st.simulate
        return found

    def _given(self) -> dict:
        """Return the parameters that the others follow from; none where they are baked."""
        if self.manifest["scene"]["baked"]:
            return {}
        computed = "link_inertia" if "link_radius" in self.parameters else ""
        return {name: value for name, value in self.parameters.items() if name != computed}

    def __reduce__(self):
        return load, (self.folder.absolute(), self._given(), self.profile, self.library is not None)

    @property
    def generated(self) -> tuple[str, ...]:
        """Names of all functions that were generated, the rollout of simulations included."""
        return tuple(self.manifest["functions"] | self.manifest.get("work", {}))

    def kernel(self, name: str) -> Kernel:
        """Return a compiled function; ModelError where the scene did not ask for it."""
        found = self.kernels.get(name)
        if found is None and self.library is None:
            raise ModelError(
                f"{self.name} was loaded with compiled=False: only model.casadi evaluates; load it "
                "again"
            )
        if found is None:
            raise self.without(name)
        return found

    def without(self, *names: str) -> ModelError:
        """Return the error that functions are not there."""
        if set(names) & set(self.manifest["scene"]["functions"]):  # what only C can do
            return _without_c(self.manifest)
        has = ", ".join(self.generated)
        return ModelError(
            f"{self.name} was generated without {', '.join(map(repr, names))} (it has {has}): add "
            "it to `functions` of "
            "the scene, then generate it again"
        )

    def mass_matrix(self, q):
        """Inertia matrix H(q) (nv, nv), Eq. 2."""
        return self.kernel("mass_matrix")(q)

    def bias_force(self, q, v):
        """C(q, v) (nv,), Eq. 3: gravity, centrifugal and Coriolis forces."""
        return self.kernel("bias_force")(q, v)

    def inverse_dynamics(self, q, v, v_dot):
        """H v_dot + C (nv,): force (N, world), moment (N m, body), joint torques (N m)."""
        return self.kernel("inverse_dynamics")(q, v, v_dot)

    def forward_dynamics(self, q, v, tau, f_ext=None):
        """v_dot (nv,) of Eq. 1 for joint torques tau (2m,).

        f_ext (6 + 3 (N + 1),): force at B (N, world), moment (N m, body), a force (N, world) at
        every tail point; see ``external_force``.
        """
        if f_ext is None:
            return self.kernel("forward_dynamics")(q, v, tau)
        return self.kernel("forward_dynamics_external")(q, v, tau, f_ext)

    def external_force(self, force=(0, 0, 0), moment=(0, 0, 0), tail=None):
        """Return f_ext: force at B (3, N, world), moment (3, N m, body), tail forces (N + 1, 3, N,
        world) or None.
        """
        points = self.manifest["dimensions"]["total"] + 1
        shapes = {"force": (3,), "moment": (3,), "tail": (points, 3)}
        given = {
            "force": force,
            "moment": moment,
            "tail": np.zeros((points, 3)) if tail is None else tail,
        }
        arrays = {
            name: finite_array(f"external_force: {name}", value) for name, value in given.items()
        }
        for name, shape in shapes.items():
            if arrays[name].shape != shape:
                raise StateError(
                    f"external_force: {name} has shape {arrays[name].shape}, not {shape}"
                )
        return np.concatenate([array.ravel() for array in arrays.values()])

    def energy(self, q, v):
        """(kinetic, potential) energy (J); potential is zero at the height of the world's
        origin.
        """
        return self.kernel("energy")(q, v)

    def momentum(self, q, v):
        """(linear (3,) (kg m/s), angular (3,) about the centre of mass (kg m^2/s)), world axes."""
        return self.kernel("momentum")(q, v)

    def tail_points(self, q):
        """Joint positions, then the tip (N + 1, 3), world (m), Eqs. 13 to 15; of a continuum,
        samples of its arcs.
        """
        return self.kernel("tail_points")(q)

    def tail_point_jacobians(self, q):
        """J (N + 1, 3, nv) of the tail points: d(point)/dt = J v, Eqs. A5 to A8."""
        return self.kernel("tail_point_jacobians")(q)

    def mass_matrix_world(self, q):
        """H (nv, nv) for velocities (p_dot, omega in world axes, q_t_dot), the paper's frame."""
        return self.kernel("mass_matrix_world")(q)

    def bias_force_world(self, q, v):
        """C (nv,) for velocities (p_dot, omega in world axes, q_t_dot); the argument v has omega in
        the body frame.
        """
        return self.kernel("bias_force_world")(q, v)

    def pfl(self, q, v, accelerations):
        """tau (2m,) (N m) that gives the tail ``accelerations`` (2m,) (rad/s^2) in flight, Eq.
        46.
        """
        return self.kernel("pfl")(q, v, accelerations)

    def contact_points(self, q, v, legs=None):
        """(positions (K, 3) (m), velocities (K, 3) (m/s)), world, of what can touch the ground,
        Eqs. 5 to 15.

        Their order is that of ``contacts``: A, M and T of the right foot, then of the left; the
        tail's joints but the mount, and its tip, or samples of its arcs; the torso's lowest point.
        legs (8,): gamma_1, delta_1 (right), gamma_2, delta_2 (rad), then their rates; only where
        there are feet.
        """
        return self.kernel("contact_points")(*self._with_legs((q, v), legs))

    def contact_dynamics(self, q, v, tau, bristles, legs=None):
        """(v_dot (nv,), bristle_rates (2K,) (m/s), forces (K, 3) (N, world)) of Eq. 1 with contact,
        Eqs. 35 to 37.

        bristles (2K,): stretch of the points' friction springs (m), world x and y in turn, a part
        of the state that starts at zero.  legs as in ``contact_points``.
        """
        return self.kernel("contact_dynamics")(*self._with_legs((q, v, tau, bristles), legs))

    def _with_legs(self, arrays: tuple, legs) -> tuple:
        """Return the arguments with the legs' angles, where the model has legs."""
        if ("feet" in self.contacts) == (legs is not None):
            return arrays if legs is None else (*arrays, legs)
        if legs is None:
            raise StateError(f"{self.name} has feet: give legs, 4 angles (rad) and 4 rates (rad/s)")
        raise StateError(
            f'{self.name} has no feet, but legs were given: leave them out, or add "feet" to '
            "`contacts`"
        )

    def forward_dynamics_derivatives(self, q, v, tau):
        """(dq (nv, nv), dv (nv, nv), dtau (nv, 2m)): exact Jacobians of v_dot of Eq. 1, -H^-1 d(H
        v_dot + C).

        dq is taken in the tangent space of q, as all derivatives are: column k is the rate of v_dot
        when q moves with the velocity e_k, so columns 3 to 5 are turns of the torso in the body
        frame.
        """
        return self.kernel("forward_dynamics_derivatives")(q, v, tau)

    def forward_dynamics_parameter_derivatives(self, q, v, tau):
        """(nv, number of parameters): Jacobian of v_dot, in the order of
        ``casadi.parameter_vector``.
        """
        return self.kernel("forward_dynamics_parameter_derivatives")(q, v, tau)

    def forward_dynamics_jvp(self, q, v, tau, dq, dv, dtau):
        """Derivative of v_dot (nv,) in the direction dq (nv,), dv (nv,), dtau (2m,), without
        forming Jacobians.
        """
        return self.kernel("forward_dynamics_jvp")(q, v, tau, dq, dv, dtau)

    def forward_dynamics_vjp(self, q, v, tau, multiplier):
        """(dq (nv,), dv (nv,), dtau (2m,)): gradient of multiplier^T v_dot, without forming
        Jacobians.
        """
        return self.kernel("forward_dynamics_vjp")(q, v, tau, multiplier)

    def inverse_dynamics_derivatives(self, q, v, v_dot):
        """(dq (nv, nv), dv (nv, nv)): exact Jacobians of H v_dot + C; that with respect to v_dot is
        H.
        """
        return self.kernel("inverse_dynamics_derivatives")(q, v, v_dot)

    def inverse_dynamics_parameter_derivatives(self, q, v, v_dot):
        """(nv, number of parameters): Jacobian of H v_dot + C, in the order of
        ``casadi.parameter_vector``.
        """
        return self.kernel("inverse_dynamics_parameter_derivatives")(q, v, v_dot)

    def inverse_dynamics_vjp(self, q, v, v_dot, multiplier):
        """(dq (nv,), dv (nv,), dv_dot (nv,)): gradient of multiplier^T (H v_dot + C)."""
        return self.kernel("inverse_dynamics_vjp")(q, v, v_dot, multiplier)

    def inverse_dynamics_hessian(self, q, v, v_dot, multiplier):
        """(qq, qv, vv, aq), each (nv, nv): second derivatives of multiplier^T (H v_dot + C).

        qq by turns through the exponential map, symmetric; qv has rows of q; aq = d(H
        multiplier)/dq has rows of v_dot. The blocks (v_dot, v_dot) and (v_dot, v) are zero.
        """
        return self.kernel("inverse_dynamics_hessian")(q, v, v_dot, multiplier)

    def energy_derivatives(self, q, v):
        """(kinetic_dq, kinetic_dv, potential_dq), each (nv,): gradients of both energies."""
        return self.kernel("energy_derivatives")(q, v)

    def momentum_derivatives(self, q, v):
        """(linear_dq, linear_dv, angular_dq, angular_dv), each (3, nv): Jacobians of
        ``momentum``.
        """
        return self.kernel("momentum_derivatives")(q, v)

    crba = mass_matrix
    nle = bias_force
    rnea = inverse_dynamics
    aba = forward_dynamics

    @cached_property
    def casadi(self):
        """``casadi.Function``s by name, the parameters folded in:
        ``model.casadi.forward_dynamics(q, v, tau)``.
        """
        from .casadi import CasadiFunctions

        return CasadiFunctions(self)
