"""Methods of a model that are more than one compiled function."""

from ctypes import CDLL
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from numpy.typing import ArrayLike

from serpentail_scene.layout import Layout
from serpentail_scene.purposes import needed_for, possible

from ..basics.checks import finite_array
from ..basics.errors import ModelError, StateError
from .compiled_functions import absent
from .functions import Array, ModelFunctions
from .growth import Grow, grown
from .kernel import Kernel
from .lazy import lazy_property
from .library import BatchLibrary
from .manifest import CheckedFolder
from .memory import Out, filled
from .state import parted
from .state_space import jacobians, q_dot, split

if TYPE_CHECKING:
    from .model import Model
    from .stepping.step import Stepping


class ModelMethods(ModelFunctions):
    """All methods that evaluate a model."""

    name: str
    layout: Layout
    fixed: bool
    grow: Grow | None
    # the code, of which growth makes another one
    checked: CheckedFolder
    folder: Path
    manifest: dict[str, Any]
    library: CDLL | None
    batch_library: BatchLibrary
    generated: tuple[str, ...]  # names of all functions, also of those that only C calls

    # names of the methods in Pinocchio; aba is below
    crba = ModelFunctions.mass_matrix
    nle = ModelFunctions.bias_force
    rnea = ModelFunctions.inverse_dynamics

    def forward_dynamics(
        self,
        q: ArrayLike,
        v: ArrayLike,
        tau: ArrayLike,
        f_ext: ArrayLike | None = None,
        *given: ArrayLike,
        out: Out = None,
    ) -> Array:
        """Compute the acceleration v_dot of Eq. 1.

        Parameters
        ----------
        q, v : array_like, shapes (nq,) and (nv,)
        tau : array_like, shape (2m,)
            Torques conjugate to the tail coordinates (N m).
        f_ext : array_like, shape (6 + 3 (N + 1),), optional
            External forces: a force at B (N, world), a moment on the torso (N m, body), then a
            force (N, world) at each of the N + 1 tail points; see ``external_force``.
        given : array_like, shape (3, n)
            How prescribed joints move, of models with any: after f_ext, which may be None.

        Returns
        -------
        v_dot : ndarray, shape (nv,)
            Acceleration: time derivative of v (m/s^2, rad/s^2).
        """
        if f_ext is None:
            return self.kernels["forward_dynamics"](q, v, tau, *given, out=out)
        return self.kernels["forward_dynamics_external"](q, v, tau, f_ext, *given, out=out)

    aba = forward_dynamics

    def external_force(
        self,
        force: ArrayLike = (0, 0, 0),
        moment: ArrayLike = (0, 0, 0),
        tail: ArrayLike | None = None,
    ) -> Array:
        """Assemble the argument ``f_ext`` of ``forward_dynamics``.

        Parameters
        ----------
        force : array_like, shape (3,), default zeros
            Force at B (N, world).
        moment : array_like, shape (3,), default zeros
            Moment on the torso (N m, body).
        tail : array_like, shape (N + 1, 3), default zeros
            A force (N, world) at each tail point.

        Returns
        -------
        f_ext : ndarray, shape (6 + 3 (N + 1),)
            The forces one after another.
        """
        points = self.layout.chains[-1].points.stop
        tail = np.zeros((points, 3)) if tail is None else tail
        parts = []
        for name, shape, value in (
            ("force", (3,), force),
            ("moment", (3,), moment),
            ("tail", (points, 3), tail),
        ):
            array = finite_array(f"external_force: {name}", value)
            if array.shape != shape:
                raise StateError(f"external_force: {name} has shape {array.shape}, not {shape}")
            parts.append(array.ravel())
        return np.concatenate(parts)

    def x_dot(self, x: ArrayLike, u: ArrayLike, *, out: Out = None) -> Array:
        """Compute the time derivative of the state x = (q, v).

        Parameters
        ----------
        x : array_like, shape (nq + nv,)
            State: ``q`` followed by ``v``.
        u : array_like, shape (2m,)
            Torques conjugate to the tail coordinates (N m).

        Returns
        -------
        x_dot : ndarray, shape (nq + nv,)
            Time derivative of ``x``.

        Notes
        -----
        The rate of the quaternion Q is Q (0, omega) / 2 + k (1 - Q . Q) Q, k = 1 / s. The second
        term returns the norm to 1 after an integrator's errors, and is zero at norm 1.
        """
        q, v = split(self.layout, finite_array("x", x))
        v_dot = self.forward_dynamics(q, v, u)
        rates = v if self.layout.fixed else q_dot(q, v)
        kinematics = np.broadcast_to(rates, (*v_dot.shape[:-1], q.shape[-1]))
        return filled("x_dot: out", out, np.concatenate([kinematics, v_dot], axis=-1))

    def x_dot_derivatives(
        self, x: ArrayLike, u: ArrayLike, *, out: Out = None
    ) -> tuple[Array, Array]:
        """Compute the exact Jacobians of ``x_dot``.

        Parameters
        ----------
        x, u : array_like, shapes (nq + nv,) and (2m,)
            State and torques, as in ``x_dot``.

        Returns
        -------
        A : ndarray, shape (nq + nv, nq + nv)
            Derivative with respect to ``x``, entry by entry.
        B : ndarray, shape (nq + nv, 2m)
            Derivative with respect to ``u``.
        """
        q, v = split(self.layout, finite_array("x", x))
        found = jacobians(self.layout, q, v, self.forward_dynamics_derivatives(q, v, u))
        return filled("x_dot_derivatives: out", out, found)

    def step(
        self, q: Any, v: ArrayLike, tau: Any = None, h: float | str | None = None, **settings: Any
    ) -> tuple[Array, ...]:
        """Advance one state, or k states at once, under constant torques.

        Parameters
        ----------
        q, v : array_like, shapes (nq,) and (nv,), or (k, nq) and (k, nv)
            States at the start. In their place one argument may be a ``State`` or a pair (q, v):
            ``model.step(state, tau, h)``.
        tau : array_like, shape (2m,) or (k, 2m)
            Torques (N m), constant during the call; of all runs or of each.
        h : float or str
            Length of a step (s), or text such as "1 ms".
        steps : int, default 1
            Number of steps in this call, at most 10,000.
        out : sequence of ndarray, optional
            Arrays for the results; they may be ``q`` and ``v`` themselves. Then nothing is
            allocated.
        parameters : mapping or RunParameters, optional
            Parameters of each run: name to values (k,) or (k, 3), or what ``parameters_of_runs``
            returned.
        bristles : array_like, shape (2K,) or (k, 2K)
            Stretch (m) of the friction springs of the K points; only with contacts, required there.
        legs : array_like, shape (8,) or (k, 8)
            Leg angles (rad) and rates (rad/s) as in ``contact_dynamics``; only with feet, required
            there. Within the call the angles advance at these rates.
        method : {"rk4", "implicit_euler"}, optional
            Default: "rk4" in flight, "implicit_euler" with contacts.
        threads : int, optional
            Largest number of threads; default: the model's, see ``load``.
        statuses : ndarray of numpy.intc, shape (k,), optional
            Receives the status of each run, 0 for success. With it no failing run raises an error.

        Returns
        -------
        q, v : ndarray
            States after the steps, of the shapes of the arguments.
        bristles : ndarray
            Stretch of the friction springs (m); only with contacts.

        Raises
        ------
        StateError
            A shape or a value is wrong.
        SimulationError
            ``h`` or another setting is wrong, or a run cannot go on: it keeps its last valid state,
            and the other runs are advanced.
        ModelError
            The scene left out "rollout" or, with contacts, "implicit".

        Notes
        -----
        Eight or more runs are computed in SIMD lanes, in flight by "rk4", with contacts by
        "implicit_euler". The C of these is compiled in the first such call.
        """
        from .stepping.step import step

        if h is None:  # step(state, tau, h)
            ((q, v), _), tau, h = parted(cast("Model", self), q), v, tau
        return step(cast("Model", self), (q, v, tau), h, settings)

    @lazy_property
    def stepping(self) -> "Stepping":
        """What ``step`` keeps between calls."""
        from .stepping.step import Stepping

        return Stepping(cast("Model", self))

    def kernel(self, name: str) -> Kernel:
        """Return a compiled function by name.

        Parameters
        ----------
        name : str
            Name of a function of the scene, such as "mass_matrix".

        Returns
        -------
        Kernel
            The function; it takes and returns arrays as the method of that name does.

        Raises
        ------
        ModelError
            The scene left the function out, or the model was loaded with ``compiled=False``.
        """
        return self.kernels[name]

    def need(self, *names: str) -> None:
        """Have functions: those that a built model lacks are generated, compiled and added.

        Parameters
        ----------
        *names : str
            Names of functions of a scene.

        Raises
        ------
        ModelError
            The model was loaded, not built, or cannot have a function.

        Notes
        -----
        Whatever asks for a function that is missing adds it so. The cache keeps the larger model,
        and what was made of the smaller one stays valid.
        """
        if not {*names} <= {*self.generated}:
            grown(cast("Model", self), names)

    def serve(self, purpose: str) -> None:
        """Add all that a purpose of scenes takes to a built model; to a loaded one, nothing."""
        if self.grow is not None:
            self.need(*needed_for(self.manifest["scene"], [purpose]))

    def has(self, *names: str) -> bool:
        """Tell if the model has functions, after those that can be were added."""
        scene = self.manifest["scene"]
        if self.grow is not None and {*names} <= {*possible(scene, names), *self.generated}:
            self.need(*names)
        return {*names} <= {*self.generated}

    def without(self, *names: str) -> ModelError:
        """Return the ModelError about functions that the model was generated without."""
        return absent(self.manifest, *names)

    def refuse_fixed(self, what: str) -> None:
        """Raise ModelError if the base is fixed: ``what`` needs a free torso."""
        if self.fixed:
            raise ModelError(
                f"{what}: {self.name} has a fixed base, which neither flies nor lands: generate it "
                'again with base = "free"'
            )
