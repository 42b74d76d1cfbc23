"""Methods of a model for its equations of motion."""

import numpy as np
from numpy.typing import ArrayLike

from ...basics.checks import finite_array
from ...basics.errors import StateError
from .evaluated import Array, Evaluated


class DynamicsMethods(Evaluated):
    """Methods for the equations of motion."""

    def mass_matrix(self, q: ArrayLike) -> Array:
        """Compute the inertia matrix H(q), Eq. 2.

        Parameters
        ----------
        q : array_like, shape (nq,)
            Configuration.

        Returns
        -------
        H : ndarray, shape (nv, nv)
            Inertia matrix, symmetric positive definite (kg, kg m, kg m^2).

        Raises
        ------
        StateError
            A shape is wrong, or a value is not finite.
        ModelError
            The scene left this function out.
        """
        return self.kernel("mass_matrix")(q)

    def bias_force(self, q: ArrayLike, v: ArrayLike) -> Array:
        """Compute C(q, v), Eq. 3: gravity, centrifugal and Coriolis forces.

        Parameters
        ----------
        q : array_like, shape (nq,)
            Configuration.
        v : array_like, shape (nv,)
            Velocity.

        Returns
        -------
        force : ndarray, shape (nv,)
            Generalised force: on the position of B (N, world), on the attitude (N m, body), on the
            tail coordinates (N m).

        Raises
        ------
        StateError
            A shape is wrong, or a value is not finite.
        ModelError
            The scene left this function out.
        """
        return self.kernel("bias_force")(q, v)

    def inverse_dynamics(self, q: ArrayLike, v: ArrayLike, v_dot: ArrayLike) -> Array:
        """Compute H v_dot + C, the generalised force that causes an acceleration.

        Parameters
        ----------
        q : array_like, shape (nq,)
            Configuration.
        v : array_like, shape (nv,)
            Velocity.
        v_dot : array_like, shape (nv,)
            Time derivative of ``v``.

        Returns
        -------
        force : ndarray, shape (nv,)
            Force at B (N, world), moment on the torso (N m, body), torques of the tail coordinates
            (N m).

        Raises
        ------
        StateError
            A shape is wrong, or a value is not finite.
        ModelError
            The scene left this function out.
        """
        return self.kernel("inverse_dynamics")(q, v, v_dot)

    def forward_dynamics(
        self, q: ArrayLike, v: ArrayLike, tau: ArrayLike, f_ext: ArrayLike | None = None
    ) -> Array:
        """Compute the acceleration v_dot of Eq. 1.

        Parameters
        ----------
        q : array_like, shape (nq,)
            Configuration.
        v : array_like, shape (nv,)
            Velocity.
        tau : array_like, shape (2m,)
            Torques (N m), conjugate to the tail coordinates.
        f_ext : array_like, shape (6 + 3 (N + 1),), optional
            External forces: a force at B (N, world), a moment on the torso (N m, body), then a
            force (N, world) at each of the N + 1 tail points; see ``external_force``. Default:
            none.

        Returns
        -------
        v_dot : ndarray, shape (nv,)
            Time derivative of ``v``.

        Raises
        ------
        StateError
            A shape is wrong, or a value is not finite.
        ModelError
            The scene left this function out.
        """
        if f_ext is None:
            return self.kernel("forward_dynamics")(q, v, tau)
        return self.kernel("forward_dynamics_external")(q, v, tau, f_ext)

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
        tail : array_like, shape (N + 1, 3), optional
            A force (N, world) at each tail point; default: none.

        Returns
        -------
        f_ext : ndarray, shape (6 + 3 (N + 1),)
            The forces one after another.

        Raises
        ------
        StateError
            A shape is wrong, or a value is not finite.
        """
        points = self.manifest["dimensions"]["total"] + 1
        shapes = {"force": (3,), "moment": (3,), "tail": (points, 3)}
        tail = np.zeros((points, 3)) if tail is None else tail
        parts = []
        for (name, shape), value in zip(shapes.items(), (force, moment, tail), strict=True):
            array = finite_array(f"external_force: {name}", value)
            if array.shape != shape:
                raise StateError(f"external_force: {name} has shape {array.shape}, not {shape}")
            parts.append(array.ravel())
        return np.concatenate(parts)

    def mass_matrix_world(self, q: ArrayLike) -> Array:
        """Compute H for the velocities (p_dot, omega in world axes, q_t_dot), the paper's frame.

        Parameters
        ----------
        q : array_like, shape (nq,)
            Configuration.

        Returns
        -------
        H : ndarray, shape (nv, nv)
            Inertia matrix (kg, kg m, kg m^2).

        Raises
        ------
        StateError
            A shape is wrong, or a value is not finite.
        ModelError
            The scene left this function out.
        """
        return self.kernel("mass_matrix_world")(q)

    def bias_force_world(self, q: ArrayLike, v: ArrayLike) -> Array:
        """Compute C for the velocities (p_dot, omega in world axes, q_t_dot), the paper's frame.

        Parameters
        ----------
        q : array_like, shape (nq,)
            Configuration.
        v : array_like, shape (nv,)
            Velocity, with omega in the body frame as everywhere else.

        Returns
        -------
        force : ndarray, shape (nv,)
            Generalised force; the moment is in world axes (N, N m).

        Raises
        ------
        StateError
            A shape is wrong, or a value is not finite.
        ModelError
            The scene left this function out.
        """
        return self.kernel("bias_force_world")(q, v)

    def pfl(self, q: ArrayLike, v: ArrayLike, accelerations: ArrayLike) -> Array:
        """Compute the torques that give the tail wanted accelerations in flight, Eq. 46.

        Parameters
        ----------
        q : array_like, shape (nq,)
            Configuration.
        v : array_like, shape (nv,)
            Velocity.
        accelerations : array_like, shape (2m,)
            Wanted accelerations of the tail coordinates (rad/s^2).

        Returns
        -------
        tau : ndarray, shape (2m,)
            Torques (N m).

        Raises
        ------
        StateError
            A shape is wrong, or a value is not finite.
        ModelError
            The scene left this function out.
        """
        return self.kernel("pfl")(q, v, accelerations)
