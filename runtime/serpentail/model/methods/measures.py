"""Methods of a model for energy, momentum, centre of mass and points of the tail."""

from numpy.typing import ArrayLike

from .evaluated import Array, Evaluated


class MeasureMethods(Evaluated):
    """Methods for energy, momentum, centre of mass and points of the tail."""

    def energy(self, q: ArrayLike, v: ArrayLike) -> tuple[Array, Array]:
        """Compute kinetic and potential energy.

        Parameters
        ----------
        q : array_like, shape (nq,)
            Configuration.
        v : array_like, shape (nv,)
            Velocity.

        Returns
        -------
        kinetic : float
            Kinetic energy (J).
        potential : float
            Potential energy (J), zero at the height of the world's origin.

        Raises
        ------
        StateError
            A shape is wrong, or a value is not finite.
        ModelError
            The scene left this function out.
        """
        return self.kernel("energy")(q, v)

    def momentum(self, q: ArrayLike, v: ArrayLike) -> tuple[Array, Array]:
        """Compute linear momentum, and angular momentum about the centre of mass.

        Parameters
        ----------
        q : array_like, shape (nq,)
            Configuration.
        v : array_like, shape (nv,)
            Velocity.

        Returns
        -------
        linear : ndarray, shape (3,)
            Momentum (kg m/s, world).
        angular : ndarray, shape (3,)
            Angular momentum about the centre of mass (kg m^2/s, world).

        Raises
        ------
        StateError
            A shape is wrong, or a value is not finite.
        ModelError
            The scene left this function out.
        """
        return self.kernel("momentum")(q, v)

    def center_of_mass(self, q: ArrayLike, v: ArrayLike) -> tuple[Array, Array, Array]:
        """Compute position and velocity of the whole body's centre of mass, and its Jacobian.

        On a fixed base they are those of the tail.

        Parameters
        ----------
        q : array_like, shape (nq,)
            Configuration.
        v : array_like, shape (nv,)
            Velocity.

        Returns
        -------
        position : ndarray, shape (3,)
            Centre of mass (m, world).
        velocity : ndarray, shape (3,)
            Its velocity (m/s, world), equal to ``J @ v``.
        J : ndarray, shape (3, nv)
            Jacobian of the centre of mass.

        Raises
        ------
        StateError
            A shape is wrong, or a value is not finite.
        ModelError
            The scene left this function out.

        Notes
        -----
        The total mass times ``velocity`` is the linear momentum, exactly, for links and for arcs.
        """
        return self.kernel("center_of_mass")(q, v)

    def tail_points(self, q: ArrayLike) -> Array:
        """Compute the positions of the tail's joints and tip, Eqs. 13 to 15.

        Parameters
        ----------
        q : array_like, shape (nq,)
            Configuration.

        Returns
        -------
        points : ndarray, shape (N + 1, 3)
            Joints from the mount on, then the tip (m, world); on a continuum tail, its samples.

        Raises
        ------
        StateError
            A shape is wrong, or a value is not finite.
        ModelError
            The scene left this function out.
        """
        return self.kernel("tail_points")(q)

    def tail_point_jacobians(self, q: ArrayLike) -> Array:
        """Compute the Jacobians of the tail points, Eqs. A5 to A8.

        Parameters
        ----------
        q : array_like, shape (nq,)
            Configuration.

        Returns
        -------
        J : ndarray, shape (N + 1, 3, nv)
            Each point moves with the velocity ``J @ v`` (m/s, world).

        Raises
        ------
        StateError
            A shape is wrong, or a value is not finite.
        ModelError
            The scene left this function out.
        """
        return self.kernel("tail_point_jacobians")(q)

    def energy_derivatives(self, q: ArrayLike, v: ArrayLike) -> tuple[Array, Array, Array]:
        """Compute the gradients of both energies.

        Parameters
        ----------
        q : array_like, shape (nq,)
            Configuration.
        v : array_like, shape (nv,)
            Velocity.

        Returns
        -------
        kinetic_dq : ndarray, shape (nv,)
            Gradient of the kinetic energy with respect to q, in its tangent space.
        kinetic_dv : ndarray, shape (nv,)
            Gradient of the kinetic energy with respect to v, which is H v.
        potential_dq : ndarray, shape (nv,)
            Gradient of the potential energy with respect to q, in its tangent space.

        Raises
        ------
        StateError
            A shape is wrong, or a value is not finite.
        ModelError
            The scene left this function out.
        """
        return self.kernel("energy_derivatives")(q, v)

    def momentum_derivatives(self, q: ArrayLike, v: ArrayLike) -> tuple[Array, Array, Array, Array]:
        """Compute the Jacobians of ``momentum``.

        Parameters
        ----------
        q : array_like, shape (nq,)
            Configuration.
        v : array_like, shape (nv,)
            Velocity.

        Returns
        -------
        linear_dq : ndarray, shape (3, nv)
            Jacobian of the linear momentum with respect to q, in its tangent space.
        linear_dv : ndarray, shape (3, nv)
            Jacobian of the linear momentum with respect to v.
        angular_dq : ndarray, shape (3, nv)
            Jacobian of the angular momentum with respect to q, in its tangent space.
        angular_dv : ndarray, shape (3, nv)
            Jacobian of the angular momentum with respect to v.

        Raises
        ------
        StateError
            A shape is wrong, or a value is not finite.
        ModelError
            The scene left this function out.
        """
        return self.kernel("momentum_derivatives")(q, v)
