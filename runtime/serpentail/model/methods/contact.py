"""Methods of a model for contact: points, legs, and dynamics with the ground's forces."""

from numpy.typing import ArrayLike

from ...basics.errors import StateError
from .evaluated import Array, Evaluated


class ContactMethods(Evaluated):
    """Methods for contact: points, legs, and dynamics with the ground's forces."""

    def contact_points(
        self, q: ArrayLike, v: ArrayLike, legs: ArrayLike | None = None
    ) -> tuple[Array, Array]:
        """Compute positions and velocities of the K points that can touch the ground, Eqs. 5 to 15.

        Parameters
        ----------
        q : array_like, shape (nq,)
            Configuration.
        v : array_like, shape (nv,)
            Velocity.
        legs : array_like, shape (8,), optional
            gamma_1, delta_1 of the right leg, gamma_2, delta_2 of the left (rad), then their rates
            (rad/s). Required if the model has feet, else left out.

        Returns
        -------
        positions : ndarray, shape (K, 3)
            Positions (m, world).
        velocities : ndarray, shape (K, 3)
            Velocities (m/s, world).

        Raises
        ------
        StateError
            A shape is wrong, a value is not finite, or ``legs`` is missing or does not belong.
        ModelError
            The scene left this function out.

        Notes
        -----
        The order of the points is that of ``Model.contacts``: A, M and T of the right foot, then of
        the left; the tail's joints except the mount, and its tip, or the samples of its arcs; the
        lowest point of the torso.
        """
        return self.kernel("contact_points")(*self._with_legs((q, v), legs))

    def leg_points(self, q: ArrayLike, angles: ArrayLike) -> Array:
        """Compute the joints of both legs, Eqs. 5 to 9; only of models with feet.

        Parameters
        ----------
        q : array_like, shape (nq,)
            Configuration.
        angles : array_like, shape (4,)
            gamma_1, delta_1 of the right leg, gamma_2, delta_2 of the left (rad).

        Returns
        -------
        joints : ndarray, shape (2, 6, 3)
            Hip, D, knee, A, M and T of the right leg, then of the left (m, world).

        Raises
        ------
        StateError
            A shape is wrong, or a value is not finite.
        ModelError
            The model has no feet, or the scene left this function out.
        """
        return self.kernel("leg_points")(q, angles)

    def contact_dynamics(
        self,
        q: ArrayLike,
        v: ArrayLike,
        tau: ArrayLike,
        bristles: ArrayLike,
        legs: ArrayLike | None = None,
    ) -> tuple[Array, Array, Array]:
        """Compute v_dot of Eq. 1 with the ground's forces, Eqs. 35 to 37.

        Parameters
        ----------
        q : array_like, shape (nq,)
            Configuration.
        v : array_like, shape (nv,)
            Velocity.
        tau : array_like, shape (2m,)
            Torques (N m), conjugate to the tail coordinates.
        bristles : array_like, shape (2K,)
            Stretch of the K points' friction springs (m), world x and y of each point. It is a part
            of the state, and zero at the start of a motion.
        legs : array_like, shape (8,), optional
            Leg angles (rad) and rates (rad/s) as in ``contact_points``.

        Returns
        -------
        v_dot : ndarray, shape (nv,)
            Time derivative of ``v``.
        bristle_rates : ndarray, shape (2K,)
            Rates of the stretches (m/s).
        forces : ndarray, shape (K, 3)
            Forces of the ground on the points (N, world).

        Raises
        ------
        StateError
            A shape is wrong, a value is not finite, or ``legs`` is missing or does not belong.
        ModelError
            The scene left this function out.
        """
        return self.kernel("contact_dynamics")(*self._with_legs((q, v, tau, bristles), legs))

    def _with_legs(
        self, arrays: tuple[ArrayLike, ...], legs: ArrayLike | None
    ) -> tuple[ArrayLike, ...]:
        """Return the arguments, followed by ``legs`` if the model has feet."""
        if ("feet" in self.contacts) == (legs is not None):
            return arrays if legs is None else (*arrays, legs)
        if legs is None:
            raise StateError(f"{self.name} has feet: give legs, 4 angles (rad) and 4 rates (rad/s)")
        raise StateError(
            f'{self.name} has no feet, but legs were given: leave them out, or add "feet" to '
            "`contacts`"
        )
