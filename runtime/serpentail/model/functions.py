"""The methods of a model for its compiled functions; `make golden` writes this file.

Names, meanings and shapes are those of the signatures in ``serpentail_scene``.
"""

from typing import Any

from numpy.typing import ArrayLike, NDArray

from .compiled_functions import CompiledFunctions
from .memory import Out

Array = NDArray[Any]  # of doubles, or of floats if the scene asks for them


class ModelFunctions:
    """The functions of a scene, for one state or with a leading batch axis.

    ``Model`` says what q and v are, and what a derivative with respect to q is. ``given``, only of
    models with prescribed joints, also in place of ``legs``: their angles (rad), then rates, then
    accelerations, (3, n), in the order of the chains. ``inverse_dynamics`` then returns (force, the
    torques of these joints).

    Raises
    ------
    StateError
        A shape is wrong, a value is not finite, or legs are missing or do not belong.
    ModelError
        The scene left the function out.
    """

    kernels: CompiledFunctions

    def mass_matrix(self, q: ArrayLike, *given: ArrayLike, out: Out = None) -> Array:
        """Compute the inertia matrix H(q), Eq. 2.

        Parameters
        ----------
        q : array_like, shape (nq,)

        Returns
        -------
        H : ndarray, shape (nv, nv)
            Inertia matrix, symmetric and positive definite (kg, kg m, kg m^2).
        """
        return self.kernels["mass_matrix"](q, *given, out=out)

    def bias_force(self, q: ArrayLike, v: ArrayLike, *given: ArrayLike, out: Out = None) -> Array:
        """Compute the bias force C(q, v), Eq. 3: centrifugal and Coriolis terms, gravity, the
        passive tail.

        Parameters
        ----------
        q, v : array_like, shapes (nq,) and (nv,)

        Returns
        -------
        force : ndarray, shape (nv,)
            Generalised force: at B (N, world), moment (N m, body), torques of the tail coordinates
            (N m).
        """
        return self.kernels["bias_force"](q, v, *given, out=out)

    def inverse_dynamics(
        self, q: ArrayLike, v: ArrayLike, v_dot: ArrayLike, *given: ArrayLike, out: Out = None
    ) -> Array:
        """Compute the generalised force H v_dot + C that an acceleration v_dot needs.

        Parameters
        ----------
        q, v : array_like, shapes (nq,) and (nv,)
        v_dot : array_like, shape (nv,)
            Acceleration: time derivative of v (m/s^2, rad/s^2).

        Returns
        -------
        force : ndarray, shape (nv,)
            Generalised force: at B (N, world), moment (N m, body), torques of the tail coordinates
            (N m).
        """
        return self.kernels["inverse_dynamics"](q, v, v_dot, *given, out=out)

    def air_force(self, q: ArrayLike, v: ArrayLike, *, out: Out = None) -> Array:
        """Compute the generalised force of the air, of the law in mechanics/air.py.

        Parameters
        ----------
        q, v : array_like, shapes (nq,) and (nv,)

        Returns
        -------
        force : ndarray, shape (nv,)
            Generalised force: at B (N, world), moment (N m, body), torques of the tail coordinates
            (N m).
        """
        return self.kernels["air_force"](q, v, out=out)

    def energy(
        self, q: ArrayLike, v: ArrayLike, *given: ArrayLike, out: Out = None
    ) -> tuple[Array, Array]:
        """Compute the kinetic and potential energy of torso and tail.

        Parameters
        ----------
        q, v : array_like, shapes (nq,) and (nv,)

        Returns
        -------
        kinetic : float
            Kinetic energy (J).
        potential : float
            Potential energy, zero at the height of the world's origin (J).
        """
        return self.kernels["energy"](q, v, *given, out=out)

    def momentum(
        self, q: ArrayLike, v: ArrayLike, *given: ArrayLike, out: Out = None
    ) -> tuple[Array, Array]:
        """Compute the linear and angular momentum of torso and tail.

        Parameters
        ----------
        q, v : array_like, shapes (nq,) and (nv,)

        Returns
        -------
        linear : ndarray, shape (3,)
            Linear momentum (kg m/s, world).
        angular : ndarray, shape (3,)
            Angular momentum about the centre of mass (kg m^2/s, world).
        """
        return self.kernels["momentum"](q, v, *given, out=out)

    def tail_points(self, q: ArrayLike, *given: ArrayLike, out: Out = None) -> Array:
        """Compute the positions of the tail points, Eqs. 13 to 15.

        Parameters
        ----------
        q : array_like, shape (nq,)

        Returns
        -------
        points : ndarray, shape (N + 1, 3)
            Positions of the joints, then of the tip (m, world).
        """
        return self.kernels["tail_points"](q, *given, out=out)

    def tail_point_jacobians(self, q: ArrayLike, *, out: Out = None) -> Array:
        """Compute the Jacobians of the tail points, Eqs. A5 to A8.

        Parameters
        ----------
        q : array_like, shape (nq,)

        Returns
        -------
        J : ndarray, shape (N + 1, 3, nv)
            Jacobians of the tail points: velocity of a point (m/s, world) = J v.
        """
        return self.kernels["tail_point_jacobians"](q, out=out)

    def center_of_mass(
        self, q: ArrayLike, v: ArrayLike, *given: ArrayLike, out: Out = None
    ) -> tuple[Array, Array, Array]:
        """Compute the centre of mass of torso and tail, its velocity and its Jacobian.

        Parameters
        ----------
        q, v : array_like, shapes (nq,) and (nv,)

        Returns
        -------
        position : ndarray, shape (3,)
            Position of the centre of mass (m, world).
        velocity : ndarray, shape (3,)
            Velocity of the centre of mass, J v (m/s, world).
        J : ndarray, shape (3, nv)
            Jacobian of the centre of mass, world.
        """
        return self.kernels["center_of_mass"](q, v, *given, out=out)

    def mass_matrix_world(self, q: ArrayLike, *, out: Out = None) -> Array:
        """Compute the inertia matrix H for the velocity (p_dot, omega in world axes, q_t_dot).

        Parameters
        ----------
        q : array_like, shape (nq,)

        Returns
        -------
        H : ndarray, shape (nv, nv)
            Inertia matrix, symmetric and positive definite (kg, kg m, kg m^2).
        """
        return self.kernels["mass_matrix_world"](q, out=out)

    def bias_force_world(self, q: ArrayLike, v: ArrayLike, *, out: Out = None) -> Array:
        """Compute the bias force C for the velocity (p_dot, omega in world axes, q_t_dot).

        Parameters
        ----------
        q, v : array_like, shapes (nq,) and (nv,)

        Returns
        -------
        force : ndarray, shape (nv,)
            Generalised force: at B (N, world), moment (N m, body), torques of the tail coordinates
            (N m).
        """
        return self.kernels["bias_force_world"](q, v, out=out)

    def tendon_lengths(self, q: ArrayLike, *, out: Out = None) -> tuple[Array, Array]:
        """Compute the lengths of the tendons, and their derivatives.

        Parameters
        ----------
        q : array_like, shape (nq,)

        Returns
        -------
        lengths : ndarray, shape (tendons,)
            Length of each tendon from its first guide (m).
        B : ndarray, shape (tendons, 2m)
            Derivatives of the lengths by the tail coordinates (m/rad).
        """
        return self.kernels["tendon_lengths"](q, out=out)

    def tendon_torques(self, q: ArrayLike, tension: ArrayLike, *, out: Out = None) -> Array:
        """Compute the torques of tensions, -B^T tension.

        Parameters
        ----------
        q : array_like, shape (nq,)
        tension : array_like, shape (tendons,)
            Tensions of the tendons (N).

        Returns
        -------
        tau : ndarray, shape (2m,)
            Torques conjugate to the tail coordinates (N m).
        """
        return self.kernels["tendon_torques"](q, tension, out=out)

    def mount_wrench(
        self, q: ArrayLike, v: ArrayLike, v_dot: ArrayLike, *given: ArrayLike, out: Out = None
    ) -> tuple[Array, Array]:
        """Compute the force and moment of the tail on the torso at the tail's mount; the ground's
        forces on the tail are left out.

        Parameters
        ----------
        q, v : array_like, shapes (nq,) and (nv,)
        v_dot : array_like, shape (nv,)
            Acceleration: time derivative of v (m/s^2, rad/s^2).

        Returns
        -------
        mount_force : ndarray, shape (3,)
            Force on the torso (N, torso axes).
        mount_moment : ndarray, shape (3,)
            Moment on the torso about the mount (N m, torso axes).
        """
        return self.kernels["mount_wrench"](q, v, v_dot, *given, out=out)

    def inverse_dynamics_derivatives(
        self, q: ArrayLike, v: ArrayLike, v_dot: ArrayLike, *, out: Out = None
    ) -> tuple[Array, Array]:
        """Compute the Jacobians of H v_dot + C with respect to q and v; the Jacobian with respect
        to v_dot is H.

        Parameters
        ----------
        q, v : array_like, shapes (nq,) and (nv,)
        v_dot : array_like, shape (nv,)
            Acceleration: time derivative of v (m/s^2, rad/s^2).

        Returns
        -------
        dq : ndarray, shape (nv, nv)
            d(force)/d(q), q in its tangent space.
        dv : ndarray, shape (nv, nv)
            d(force)/d(v).
        """
        return self.kernels["inverse_dynamics_derivatives"](q, v, v_dot, out=out)

    def forward_dynamics_derivatives(
        self, q: ArrayLike, v: ArrayLike, tau: ArrayLike, *, out: Out = None
    ) -> tuple[Array, Array, Array]:
        """Compute the Jacobians of v_dot, Eq. 1, with respect to q, v and tau.

        Parameters
        ----------
        q, v : array_like, shapes (nq,) and (nv,)
        tau : array_like, shape (2m,)
            Torques conjugate to the tail coordinates (N m).

        Returns
        -------
        dq : ndarray, shape (nv, nv)
            d(v_dot)/d(q), q in its tangent space.
        dv : ndarray, shape (nv, nv)
            d(v_dot)/d(v).
        dtau : ndarray, shape (nv, 2m)
            d(v_dot)/d(tau).
        """
        return self.kernels["forward_dynamics_derivatives"](q, v, tau, out=out)

    def inverse_dynamics_parameter_derivatives(
        self, q: ArrayLike, v: ArrayLike, v_dot: ArrayLike, *, out: Out = None
    ) -> Array:
        """Compute the Jacobian of H v_dot + C with respect to the parameters.

        Parameters
        ----------
        q, v : array_like, shapes (nq,) and (nv,)
        v_dot : array_like, shape (nv,)
            Acceleration: time derivative of v (m/s^2, rad/s^2).

        Returns
        -------
        dparameters : ndarray, shape (nv, parameters)
            Derivative with respect to the values of the parameter struct, in their order.
        """
        return self.kernels["inverse_dynamics_parameter_derivatives"](q, v, v_dot, out=out)

    def forward_dynamics_parameter_derivatives(
        self, q: ArrayLike, v: ArrayLike, tau: ArrayLike, *, out: Out = None
    ) -> Array:
        """Compute the Jacobian of v_dot, Eq. 1, with respect to the parameters.

        Parameters
        ----------
        q, v : array_like, shapes (nq,) and (nv,)
        tau : array_like, shape (2m,)
            Torques conjugate to the tail coordinates (N m).

        Returns
        -------
        dparameters : ndarray, shape (nv, parameters)
            Derivative with respect to the values of the parameter struct, in their order.
        """
        return self.kernels["forward_dynamics_parameter_derivatives"](q, v, tau, out=out)

    def inverse_dynamics_vjp(
        self,
        q: ArrayLike,
        v: ArrayLike,
        v_dot: ArrayLike,
        multiplier: ArrayLike,
        *,
        out: Out = None,
    ) -> tuple[Array, Array, Array]:
        """Compute the gradients of lambda^T (H v_dot + C) with respect to q, v and v_dot.

        Parameters
        ----------
        q, v : array_like, shapes (nq,) and (nv,)
        v_dot : array_like, shape (nv,)
            Acceleration: time derivative of v (m/s^2, rad/s^2).
        multiplier : array_like, shape (nv,)
            Weights lambda, one for each row of the force or of v_dot.

        Returns
        -------
        dq : ndarray, shape (nv,)
            Gradient with respect to q, in its tangent space.
        dv : ndarray, shape (nv,)
            Gradient with respect to v.
        dv_dot : ndarray, shape (nv,)
            Gradient with respect to v_dot, H lambda.
        """
        return self.kernels["inverse_dynamics_vjp"](q, v, v_dot, multiplier, out=out)

    def forward_dynamics_jvp(
        self,
        q: ArrayLike,
        v: ArrayLike,
        tau: ArrayLike,
        dq: ArrayLike,
        dv: ArrayLike,
        dtau: ArrayLike,
        *,
        out: Out = None,
    ) -> Array:
        """Compute the directional derivative of v_dot, Eq. 1.

        Parameters
        ----------
        q, v : array_like, shapes (nq,) and (nv,)
        tau : array_like, shape (2m,)
            Torques conjugate to the tail coordinates (N m).
        dq : array_like, shape (nv,)
            Direction in q, in its tangent space.
        dv : array_like, shape (nv,)
            Direction in v.
        dtau : array_like, shape (2m,)
            Direction in tau.

        Returns
        -------
        dv_dot : ndarray, shape (nv,)
            Derivative of v_dot along the direction.
        """
        return self.kernels["forward_dynamics_jvp"](q, v, tau, dq, dv, dtau, out=out)

    def forward_dynamics_vjp(
        self, q: ArrayLike, v: ArrayLike, tau: ArrayLike, multiplier: ArrayLike, *, out: Out = None
    ) -> tuple[Array, Array, Array]:
        """Compute lambda^T times the Jacobians of v_dot, Eq. 1.

        Parameters
        ----------
        q, v : array_like, shapes (nq,) and (nv,)
        tau : array_like, shape (2m,)
            Torques conjugate to the tail coordinates (N m).
        multiplier : array_like, shape (nv,)
            Weights lambda, one for each row of the force or of v_dot.

        Returns
        -------
        dq : ndarray, shape (nv,)
            lambda^T d(v_dot)/d(q), q in its tangent space.
        dv : ndarray, shape (nv,)
            lambda^T d(v_dot)/d(v).
        dtau : ndarray, shape (2m,)
            lambda^T d(v_dot)/d(tau).
        """
        return self.kernels["forward_dynamics_vjp"](q, v, tau, multiplier, out=out)

    def inverse_dynamics_hessian(
        self,
        q: ArrayLike,
        v: ArrayLike,
        v_dot: ArrayLike,
        multiplier: ArrayLike,
        *,
        out: Out = None,
    ) -> tuple[Array, Array, Array, Array]:
        """Compute the second derivatives of lambda^T (H v_dot + C); those with respect to v_dot
        twice, and to v_dot and v, are zero.

        Parameters
        ----------
        q, v : array_like, shapes (nq,) and (nv,)
        v_dot : array_like, shape (nv,)
            Acceleration: time derivative of v (m/s^2, rad/s^2).
        multiplier : array_like, shape (nv,)
            Weights lambda, one for each row of the force or of v_dot.

        Returns
        -------
        qq : ndarray, shape (nv, nv)
            With respect to q twice, in its tangent space (exponential map).
        qv : ndarray, shape (nv, nv)
            With respect to q (row) and v (column).
        vv : ndarray, shape (nv, nv)
            With respect to v twice.
        aq : ndarray, shape (nv, nv)
            With respect to v_dot (row) and q (column): d(H lambda)/d(q).
        """
        return self.kernels["inverse_dynamics_hessian"](q, v, v_dot, multiplier, out=out)

    def energy_derivatives(
        self, q: ArrayLike, v: ArrayLike, *, out: Out = None
    ) -> tuple[Array, Array, Array]:
        """Compute the gradients of kinetic and potential energy.

        Parameters
        ----------
        q, v : array_like, shapes (nq,) and (nv,)

        Returns
        -------
        kinetic_dq : ndarray, shape (nv,)
            Gradient of the kinetic energy with respect to q, in its tangent space.
        kinetic_dv : ndarray, shape (nv,)
            Gradient of the kinetic energy with respect to v, H v.
        potential_dq : ndarray, shape (nv,)
            Gradient of the potential energy with respect to q, in its tangent space.
        """
        return self.kernels["energy_derivatives"](q, v, out=out)

    def momentum_derivatives(
        self, q: ArrayLike, v: ArrayLike, *, out: Out = None
    ) -> tuple[Array, Array, Array, Array]:
        """Compute the Jacobians of linear and angular momentum.

        Parameters
        ----------
        q, v : array_like, shapes (nq,) and (nv,)

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
        """
        return self.kernels["momentum_derivatives"](q, v, out=out)

    def contact_points(
        self, q: ArrayLike, v: ArrayLike, legs: ArrayLike | None = None, *, out: Out = None
    ) -> tuple[Array, Array]:
        """Compute the points that can touch the ground, and their velocities: A, M, T of the right
        foot, then of the left; the tail's points; the lowest point of the torso.

        Parameters
        ----------
        q, v : array_like, shapes (nq,) and (nv,)
        legs : array_like, shape (8,), optional; models with feet need it
            Leg angles gamma_1, delta_1 (right), gamma_2, delta_2 (left) (rad), then their rates
            (rad/s).

        Returns
        -------
        positions : ndarray, shape (K, 3)
            Positions of the points that can touch the ground (m, world).
        velocities : ndarray, shape (K, 3)
            Their velocities (m/s, world).
        """
        return self.kernels.with_legs("contact_points", legs, q, v, out=out)

    def leg_points(self, q: ArrayLike, angles: ArrayLike, *, out: Out = None) -> Array:
        """Compute the positions of the joints of both legs, from the hips to the toes, Eqs. 5 to 9.

        Parameters
        ----------
        q : array_like, shape (nq,)
        angles : array_like, shape (4,)
            Leg angles gamma_1, delta_1 (right), gamma_2, delta_2 (left) (rad).

        Returns
        -------
        joints : ndarray, shape (2, 6, 3)
            Positions of hip, D, knee, A, M and T of the right leg, then of the left (m, world).
        """
        return self.kernels["leg_points"](q, angles, out=out)

    def contact_dynamics(
        self,
        q: ArrayLike,
        v: ArrayLike,
        tau: ArrayLike,
        bristles: ArrayLike,
        legs: ArrayLike | None = None,
        *,
        out: Out = None,
    ) -> tuple[Array, Array, Array]:
        """Compute the acceleration v_dot, Eq. 1, with the contact forces of the ground, Eqs. 35 to
        37.

        Parameters
        ----------
        q, v : array_like, shapes (nq,) and (nv,)
        tau : array_like, shape (2m,)
            Torques conjugate to the tail coordinates (N m).
        bristles : array_like, shape (2K,)
            Deflections of the friction bristles (m, world x and y).
        legs : array_like, shape (8,), optional; models with feet need it
            Leg angles gamma_1, delta_1 (right), gamma_2, delta_2 (left) (rad), then their rates
            (rad/s).

        Returns
        -------
        v_dot : ndarray, shape (nv,)
            Acceleration: time derivative of v (m/s^2, rad/s^2).
        bristle_rates : ndarray, shape (2K,)
            Rates of the bristle deflections (m/s).
        forces : ndarray, shape (K, 3)
            Forces of the ground on the points (N, world).
        """
        return self.kernels.with_legs("contact_dynamics", legs, q, v, tau, bristles, out=out)

    def pfl(
        self, q: ArrayLike, v: ArrayLike, accelerations: ArrayLike, *, out: Out = None
    ) -> Array:
        """Compute the partial feedback linearisation: torques that give the tail desired
        accelerations in flight, Eq. 46.

        Parameters
        ----------
        q, v : array_like, shapes (nq,) and (nv,)
        accelerations : array_like, shape (2m,)
            Desired accelerations of the tail coordinates (rad/s^2).

        Returns
        -------
        tau : ndarray, shape (2m,)
            Torques conjugate to the tail coordinates (N m).
        """
        return self.kernels["pfl"](q, v, accelerations, out=out)

    def airborne_rates(
        self, x: ArrayLike, tau: ArrayLike, angular: ArrayLike, *, out: Out = None
    ) -> Array:
        """Compute the rates of an airborne state, from which translation and omega are eliminated.

        Parameters
        ----------
        x : array_like, shape (4 + 4m,)
            Airborne state: quaternion w x y z of any norm, tail coordinates (rad), their rates
            (rad/s).
        tau : array_like, shape (2m,)
            Torques conjugate to the tail coordinates (N m).
        angular : array_like, shape (3,)
            Angular momentum about the centre of mass (kg m^2/s, world).

        Returns
        -------
        y : ndarray, shape (7 + 4m,)
            Rates of x, then omega (rad/s, body), which follows from the angular momentum.
        """
        return self.kernels["airborne_rates"](x, tau, angular, out=out)

    def airborne_rates_derivatives(
        self, x: ArrayLike, tau: ArrayLike, angular: ArrayLike, *, out: Out = None
    ) -> tuple[Array, Array]:
        """Compute airborne_rates and its Jacobian.

        Parameters
        ----------
        x : array_like, shape (4 + 4m,)
            Airborne state: quaternion w x y z of any norm, tail coordinates (rad), their rates
            (rad/s).
        tau : array_like, shape (2m,)
            Torques conjugate to the tail coordinates (N m).
        angular : array_like, shape (3,)
            Angular momentum about the centre of mass (kg m^2/s, world).

        Returns
        -------
        y : ndarray, shape (7 + 4m,)
            Rates of x, then omega (rad/s, body), which follows from the angular momentum.
        J : ndarray, shape (7 + 4m, 4 + 6m)
            d(y)/d(x, tau).
        """
        return self.kernels["airborne_rates_derivatives"](x, tau, angular, out=out)

    def airborne_rates_hessian(
        self,
        x: ArrayLike,
        tau: ArrayLike,
        angular: ArrayLike,
        weights: ArrayLike,
        *,
        out: Out = None,
    ) -> tuple[Array, Array, Array]:
        """Compute airborne_rates, its Jacobian, and the Hessian of weights^T y.

        Parameters
        ----------
        x : array_like, shape (4 + 4m,)
            Airborne state: quaternion w x y z of any norm, tail coordinates (rad), their rates
            (rad/s).
        tau : array_like, shape (2m,)
            Torques conjugate to the tail coordinates (N m).
        angular : array_like, shape (3,)
            Angular momentum about the centre of mass (kg m^2/s, world).
        weights : array_like, shape (7 + 4m,)
            Weights, one for each row of y.

        Returns
        -------
        y : ndarray, shape (7 + 4m,)
            Rates of x, then omega (rad/s, body), which follows from the angular momentum.
        J : ndarray, shape (7 + 4m, 4 + 6m)
            d(y)/d(x, tau).
        hessian : ndarray, shape (4 + 6m, 4 + 6m)
            Second derivatives of weights^T y with respect to (x, tau), both triangles.
        """
        return self.kernels["airborne_rates_hessian"](x, tau, angular, weights, out=out)
