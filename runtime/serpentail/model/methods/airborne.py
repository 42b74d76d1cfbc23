"""Methods of a model for rates of a body in flight, which plans are made of."""

from numpy.typing import ArrayLike

from .evaluated import Array, Evaluated


class AirborneMethods(Evaluated):
    """Methods for rates of a body in flight, which plans are made of."""

    def airborne_rates(self, x: ArrayLike, tau: ArrayLike, angular: ArrayLike) -> Array:
        """Compute rates in flight from the angular momentum; translation and omega are eliminated.

        Parameters
        ----------
        x : array_like, shape (4 + 4m,)
            Airborne state: quaternion (w, x, y, z) of any norm but 0, tail coordinates (rad), their
            rates (rad/s).
        tau : array_like, shape (2m,)
            Torques (N m), conjugate to the tail coordinates.
        angular : array_like, shape (3,)
            Angular momentum about the centre of mass (kg m^2/s, world).

        Returns
        -------
        y : ndarray, shape (7 + 4m,)
            Rates of ``x``, then omega (rad/s, body), which the angular momentum determines.

        Raises
        ------
        StateError
            A shape is wrong, or a value is not finite.
        ModelError
            The scene left this function out.
        """
        return self.kernel("airborne_rates")(x, tau, angular)

    def airborne_rates_derivatives(
        self, x: ArrayLike, tau: ArrayLike, angular: ArrayLike
    ) -> tuple[Array, Array]:
        """Compute ``airborne_rates`` and its Jacobian.

        Parameters
        ----------
        x : array_like, shape (4 + 4m,)
            Airborne state, as in ``airborne_rates``.
        tau : array_like, shape (2m,)
            Torques (N m), conjugate to the tail coordinates.
        angular : array_like, shape (3,)
            Angular momentum about the centre of mass (kg m^2/s, world).

        Returns
        -------
        y : ndarray, shape (7 + 4m,)
            As ``airborne_rates`` returns.
        J : ndarray, shape (7 + 4m, 4 + 6m)
            Derivative of ``y`` with respect to ``(x, tau)``.

        Raises
        ------
        StateError
            A shape is wrong, or a value is not finite.
        ModelError
            The scene left this function out.
        """
        return self.kernel("airborne_rates_derivatives")(x, tau, angular)

    def airborne_rates_hessian(
        self, x: ArrayLike, tau: ArrayLike, angular: ArrayLike, weights: ArrayLike
    ) -> tuple[Array, Array, Array]:
        """Compute ``airborne_rates``, its Jacobian, and the Hessian of ``weights @ y``.

        Parameters
        ----------
        x : array_like, shape (4 + 4m,)
            Airborne state, as in ``airborne_rates``.
        tau : array_like, shape (2m,)
            Torques (N m), conjugate to the tail coordinates.
        angular : array_like, shape (3,)
            Angular momentum about the centre of mass (kg m^2/s, world).
        weights : array_like, shape (7 + 4m,)
            Weights of the entries of ``y``.

        Returns
        -------
        y : ndarray, shape (7 + 4m,)
            As ``airborne_rates`` returns.
        J : ndarray, shape (7 + 4m, 4 + 6m)
            Derivative of ``y`` with respect to ``(x, tau)``.
        hessian : ndarray, shape (4 + 6m, 4 + 6m)
            Second derivatives of ``weights @ y`` with respect to ``(x, tau)``.

        Raises
        ------
        StateError
            A shape is wrong, or a value is not finite.
        ModelError
            The scene left this function out.
        """
        return self.kernel("airborne_rates_hessian")(x, tau, angular, weights)
