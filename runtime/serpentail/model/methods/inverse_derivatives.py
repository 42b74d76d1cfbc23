"""Methods of a model for exact derivatives of its inverse dynamics."""

from numpy.typing import ArrayLike

from .evaluated import Array, Evaluated


class InverseDerivativeMethods(Evaluated):
    """Methods for exact first and second derivatives of the inverse dynamics."""

    def inverse_dynamics_derivatives(
        self, q: ArrayLike, v: ArrayLike, v_dot: ArrayLike
    ) -> tuple[Array, Array]:
        """Compute the exact Jacobians of H v_dot + C; the one with respect to v_dot is H.

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
        dq : ndarray, shape (nv, nv)
            Derivative with respect to q, in its tangent space.
        dv : ndarray, shape (nv, nv)
            Derivative with respect to v.

        Raises
        ------
        StateError
            A shape is wrong, or a value is not finite.
        ModelError
            The scene left this function out.
        """
        return self.kernel("inverse_dynamics_derivatives")(q, v, v_dot)

    def inverse_dynamics_parameter_derivatives(
        self, q: ArrayLike, v: ArrayLike, v_dot: ArrayLike
    ) -> Array:
        """Compute the exact Jacobian of H v_dot + C with respect to the parameters.

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
        dparameters : ndarray, shape (nv, parameters)
            One column for each number of ``Model.parameter_vector``, in that order.

        Raises
        ------
        StateError
            A shape is wrong, or a value is not finite.
        ModelError
            The scene left this function out.
        """
        return self.kernel("inverse_dynamics_parameter_derivatives")(q, v, v_dot)

    def inverse_dynamics_vjp(
        self, q: ArrayLike, v: ArrayLike, v_dot: ArrayLike, multiplier: ArrayLike
    ) -> tuple[Array, Array, Array]:
        """Compute the gradient of ``multiplier @ (H v_dot + C)``, without forming a Jacobian.

        Parameters
        ----------
        q : array_like, shape (nq,)
            Configuration.
        v : array_like, shape (nv,)
            Velocity.
        v_dot : array_like, shape (nv,)
            Time derivative of ``v``.
        multiplier : array_like, shape (nv,)
            Weights of the entries of H v_dot + C.

        Returns
        -------
        dq : ndarray, shape (nv,)
            Gradient with respect to q, in its tangent space.
        dv : ndarray, shape (nv,)
            Gradient with respect to v.
        dv_dot : ndarray, shape (nv,)
            Gradient with respect to v_dot, which is H multiplier.

        Raises
        ------
        StateError
            A shape is wrong, or a value is not finite.
        ModelError
            The scene left this function out.
        """
        return self.kernel("inverse_dynamics_vjp")(q, v, v_dot, multiplier)

    def inverse_dynamics_hessian(
        self, q: ArrayLike, v: ArrayLike, v_dot: ArrayLike, multiplier: ArrayLike
    ) -> tuple[Array, Array, Array, Array]:
        """Compute the second derivatives of ``multiplier @ (H v_dot + C)``.

        Parameters
        ----------
        q : array_like, shape (nq,)
            Configuration.
        v : array_like, shape (nv,)
            Velocity.
        v_dot : array_like, shape (nv,)
            Time derivative of ``v``.
        multiplier : array_like, shape (nv,)
            Weights of the entries of H v_dot + C.

        Returns
        -------
        qq : ndarray, shape (nv, nv)
            With respect to q twice, rotations by the exponential map; symmetric.
        qv : ndarray, shape (nv, nv)
            Rows for q, columns for v.
        vv : ndarray, shape (nv, nv)
            With respect to v twice.
        aq : ndarray, shape (nv, nv)
            Rows for v_dot, columns for q: the derivative of H multiplier with respect to q.

        Raises
        ------
        StateError
            A shape is wrong, or a value is not finite.
        ModelError
            The scene left this function out.

        Notes
        -----
        The blocks (v_dot, v_dot) and (v_dot, v) are zero.
        """
        return self.kernel("inverse_dynamics_hessian")(q, v, v_dot, multiplier)
