"""Methods of a model for the state x = (q, v) as one vector."""

import numpy as np
from numpy.typing import ArrayLike

from ...basics.checks import finite_array
from ..state_space import jacobians, q_dot, split
from .dynamics import DynamicsMethods
from .evaluated import Array
from .forward_derivatives import ForwardDerivativeMethods


class StateMethods(DynamicsMethods, ForwardDerivativeMethods):
    """Methods for the state x = (q, v) as one vector."""

    def x_dot(self, x: ArrayLike, u: ArrayLike) -> Array:
        """Compute the time derivative of the state x = (q, v).

        Parameters
        ----------
        x : array_like, shape (nq + nv,)
            State: ``q`` followed by ``v``.
        u : array_like, shape (2m,)
            Torques (N m), conjugate to the tail coordinates.

        Returns
        -------
        x_dot : ndarray, shape (nq + nv,)
            Time derivative of ``x``.

        Raises
        ------
        StateError
            A shape is wrong, or a value is not finite.
        ModelError
            The scene left this function out.

        Notes
        -----
        The rate of the quaternion Q is Q (0, omega) / 2 + k (1 - Q . Q) Q, k = 1 / s. The second
        term returns the norm to 1 after an integrator's errors, and is zero at norm 1.
        """
        q, v = split(self.layout, finite_array("x", x))
        v_dot = self.forward_dynamics(q, v, u)
        rates = v if self.layout.fixed else q_dot(q, v)
        kinematics = np.broadcast_to(rates, (*v_dot.shape[:-1], q.shape[-1]))
        return np.concatenate([kinematics, v_dot], axis=-1)

    def x_dot_derivatives(self, x: ArrayLike, u: ArrayLike) -> tuple[Array, Array]:
        """Compute the exact Jacobians of ``x_dot``.

        Parameters
        ----------
        x : array_like, shape (nq + nv,)
            State: ``q`` followed by ``v``.
        u : array_like, shape (2m,)
            Torques (N m), conjugate to the tail coordinates.

        Returns
        -------
        A : ndarray, shape (nq + nv, nq + nv)
            Derivative with respect to ``x``, entry by entry.
        B : ndarray, shape (nq + nv, 2m)
            Derivative with respect to ``u``.

        Raises
        ------
        StateError
            A shape is wrong, or a value is not finite.
        ModelError
            The scene left this function out.
        """
        q, v = split(self.layout, finite_array("x", x))
        return jacobians(self.layout, q, v, self.forward_dynamics_derivatives(q, v, u))
