"""Methods of a model for exact derivatives of its forward dynamics."""

from numpy.typing import ArrayLike

from .evaluated import Array, Evaluated


class ForwardDerivativeMethods(Evaluated):
    """Methods for exact derivatives of the forward dynamics."""

    def forward_dynamics_derivatives(
        self, q: ArrayLike, v: ArrayLike, tau: ArrayLike
    ) -> tuple[Array, Array, Array]:
        """Compute the exact Jacobians of v_dot of Eq. 1.

        Parameters
        ----------
        q : array_like, shape (nq,)
            Configuration.
        v : array_like, shape (nv,)
            Velocity.
        tau : array_like, shape (2m,)
            Torques (N m), conjugate to the tail coordinates.

        Returns
        -------
        dq : ndarray, shape (nv, nv)
            Derivative with respect to q, in its tangent space.
        dv : ndarray, shape (nv, nv)
            Derivative with respect to v.
        dtau : ndarray, shape (nv, 2m)
            Derivative with respect to tau.

        Raises
        ------
        StateError
            A shape is wrong, or a value is not finite.
        ModelError
            The scene left this function out.

        Notes
        -----
        All derivatives with respect to q are taken in its tangent space: column k is the rate of
        v_dot when q moves with the velocity e_k. Columns 3 to 5 are therefore rotations of the
        torso about its body axes. The Jacobians are -H^-1 d(H v_dot + C); see "Exact derivatives"
        in the documentation's page on theory.
        """
        return self.kernel("forward_dynamics_derivatives")(q, v, tau)

    def forward_dynamics_parameter_derivatives(
        self, q: ArrayLike, v: ArrayLike, tau: ArrayLike
    ) -> Array:
        """Compute the exact Jacobian of v_dot with respect to the parameters.

        Parameters
        ----------
        q : array_like, shape (nq,)
            Configuration.
        v : array_like, shape (nv,)
            Velocity.
        tau : array_like, shape (2m,)
            Torques (N m), conjugate to the tail coordinates.

        Returns
        -------
        dparameters : ndarray, shape (nv, parameters)
            One column for each number of ``Model.parameter_vector``, in that order.

        Raises
        ------
        StateError
            A shape is wrong, or a value is not finite.
        ModelError
            The scene left this function out.
        """
        return self.kernel("forward_dynamics_parameter_derivatives")(q, v, tau)

    def forward_dynamics_jvp(
        self,
        q: ArrayLike,
        v: ArrayLike,
        tau: ArrayLike,
        dq: ArrayLike,
        dv: ArrayLike,
        dtau: ArrayLike,
    ) -> Array:
        """Compute the derivative of v_dot in one direction, without forming a Jacobian.

        Parameters
        ----------
        q : array_like, shape (nq,)
            Configuration.
        v : array_like, shape (nv,)
            Velocity.
        tau : array_like, shape (2m,)
            Torques (N m), conjugate to the tail coordinates.
        dq : array_like, shape (nv,)
            Direction of q, in its tangent space.
        dv : array_like, shape (nv,)
            Direction of v.
        dtau : array_like, shape (2m,)
            Direction of tau.

        Returns
        -------
        dv_dot : ndarray, shape (nv,)
            Directional derivative of v_dot.

        Raises
        ------
        StateError
            A shape is wrong, or a value is not finite.
        ModelError
            The scene left this function out.
        """
        return self.kernel("forward_dynamics_jvp")(q, v, tau, dq, dv, dtau)

    def forward_dynamics_vjp(
        self, q: ArrayLike, v: ArrayLike, tau: ArrayLike, multiplier: ArrayLike
    ) -> tuple[Array, Array, Array]:
        """Compute the gradient of ``multiplier @ v_dot``, without forming a Jacobian.

        Parameters
        ----------
        q : array_like, shape (nq,)
            Configuration.
        v : array_like, shape (nv,)
            Velocity.
        tau : array_like, shape (2m,)
            Torques (N m), conjugate to the tail coordinates.
        multiplier : array_like, shape (nv,)
            Weights of the entries of v_dot.

        Returns
        -------
        dq : ndarray, shape (nv,)
            Gradient with respect to q, in its tangent space.
        dv : ndarray, shape (nv,)
            Gradient with respect to v.
        dtau : ndarray, shape (2m,)
            Gradient with respect to tau.

        Raises
        ------
        StateError
            A shape is wrong, or a value is not finite.
        ModelError
            The scene left this function out.
        """
        return self.kernel("forward_dynamics_vjp")(q, v, tau, multiplier)
