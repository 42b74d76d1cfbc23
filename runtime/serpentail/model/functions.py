"""The functions of a model, which evaluate its equations of motion and what follows from them."""

from abc import ABC, abstractmethod
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..checks import finite_array
from ..errors import StateError
from .kernel import Kernel
from .layout import Layout
from .state_space import jacobians, q_dot, split

Array = NDArray[Any]  # of doubles, or of floats where the scene asks for them


class Functions(ABC):
    """Functions of q (nq,), v (nv,) and more, or of arrays with a leading batch axis; SI units."""

    name: str
    manifest: dict
    contacts: dict[str, int]
    layout: Layout

    @abstractmethod
    def kernel(self, name: str) -> Kernel:
        """Return a compiled function."""

    def mass_matrix(self, q: ArrayLike) -> Array:
        """Inertia matrix H(q) (nv, nv), Eq. 2."""
        return self.kernel("mass_matrix")(q)

    def bias_force(self, q: ArrayLike, v: ArrayLike) -> Array:
        """C(q, v) (nv,), Eq. 3: gravity, centrifugal and Coriolis forces."""
        return self.kernel("bias_force")(q, v)

    def inverse_dynamics(self, q: ArrayLike, v: ArrayLike, v_dot: ArrayLike) -> Array:
        """H v_dot + C (nv,): force (N, world), moment (N m, body), joint torques (N m)."""
        return self.kernel("inverse_dynamics")(q, v, v_dot)

    def forward_dynamics(
        self, q: ArrayLike, v: ArrayLike, tau: ArrayLike, f_ext: ArrayLike | None = None
    ) -> Array:
        """v_dot (nv,) of Eq. 1 for joint torques tau (2m,).

        f_ext (6 + 3 (N + 1),): force at B (N, world), moment (N m, body), a force (N, world) at
        every tail point; see ``external_force``.
        """
        if f_ext is None:
            return self.kernel("forward_dynamics")(q, v, tau)
        return self.kernel("forward_dynamics_external")(q, v, tau, f_ext)

    def x_dot(self, x: ArrayLike, u: ArrayLike) -> Array:
        """Time derivative (nq + nv,) of the state x = (q, v) under joint torques u (2m,) (N m).

        The quaternion follows q (0, omega) / 2 + (1 - |q|^2) q / s, which keeps its norm at 1: see
        ``serpentail.model.state_space``.
        """
        q, v = split(self.layout, finite_array("x", x))
        v_dot = self.forward_dynamics(q, v, u)
        rates = v if self.layout.fixed else q_dot(q, v)
        kinematics = np.broadcast_to(rates, (*v_dot.shape[:-1], q.shape[-1]))
        return np.concatenate([kinematics, v_dot], axis=-1)

    def x_dot_derivatives(self, x: ArrayLike, u: ArrayLike) -> tuple[Array, Array]:
        """Exact Jacobians A (nx, nx), B (nx, 2m) of ``x_dot`` by x and u; nx = nq + nv."""
        q, v = split(self.layout, finite_array("x", x))
        return jacobians(self.layout, q, v, self.forward_dynamics_derivatives(q, v, u))

    def external_force(
        self,
        force: ArrayLike = (0, 0, 0),
        moment: ArrayLike = (0, 0, 0),
        tail: ArrayLike | None = None,
    ) -> Array:
        """Return f_ext of a force at B (3,) (N, world), a moment (3,) (N m, body) and tail forces.

        tail (N + 1, 3): a force (N, world) at every tail point; None: none.
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

    def energy(self, q: ArrayLike, v: ArrayLike) -> tuple[Array, Array]:
        """(kinetic, potential) energy (J); potential is zero at the world's origin."""
        return self.kernel("energy")(q, v)

    def momentum(self, q: ArrayLike, v: ArrayLike) -> tuple[Array, Array]:
        """(linear (3,) (kg m/s), angular (3,) about the centre of mass (kg m^2/s)), world axes."""
        return self.kernel("momentum")(q, v)

    def center_of_mass(self, q: ArrayLike, v: ArrayLike) -> tuple[Array, Array, Array]:
        """(position (3,) (m), velocity (3,) (m/s), J (3, nv)) of the whole animal's, world axes.

        velocity = J v, and the momentum is total mass times it; exact for links and arcs alike.
        """
        return self.kernel("center_of_mass")(q, v)

    def tail_points(self, q: ArrayLike) -> Array:
        """Joints and tip (N + 1, 3), world (m), Eqs. 13 to 15; samples of a continuum."""
        return self.kernel("tail_points")(q)

    def tail_point_jacobians(self, q: ArrayLike) -> Array:
        """J (N + 1, 3, nv) of the tail points: d(point)/dt = J v, Eqs. A5 to A8."""
        return self.kernel("tail_point_jacobians")(q)

    def mass_matrix_world(self, q: ArrayLike) -> Array:
        """H (nv, nv) for velocities (p_dot, omega in world axes, q_t_dot), the paper's frame."""
        return self.kernel("mass_matrix_world")(q)

    def bias_force_world(self, q: ArrayLike, v: ArrayLike) -> Array:
        """C (nv,) for velocities (p_dot, omega in world axes, q_t_dot).

        The argument v has omega in the body frame, as everywhere.
        """
        return self.kernel("bias_force_world")(q, v)

    def pfl(self, q: ArrayLike, v: ArrayLike, accelerations: ArrayLike) -> Array:
        """tau (2m,) (N m) that gives the tail accelerations (2m,) (rad/s^2) in flight, Eq. 46."""
        return self.kernel("pfl")(q, v, accelerations)

    def contact_points(
        self, q: ArrayLike, v: ArrayLike, legs: ArrayLike | None = None
    ) -> tuple[Array, Array]:
        """(positions (K, 3) (m), velocities (K, 3) (m/s)), world, Eqs. 5 to 15.

        They are of what can touch the ground, in the order of ``contacts``: A, M and T of the right
        foot, then of the left; the tail's joints but the mount, and its tip, or samples of its
        arcs; the torso's lowest point.  legs (8,): gamma_1, delta_1 (right), gamma_2, delta_2
        (rad), then their rates; only where there are feet.
        """
        return self.kernel("contact_points")(*self._with_legs((q, v), legs))

    def leg_points(self, q: ArrayLike, angles: ArrayLike) -> Array:
        """Hip, D, knee, A, M and T (2, 6, 3) of the right leg, then of the left, world (m).

        angles (4,): gamma_1, delta_1 (right), gamma_2, delta_2 (rad), the first half of what
        ``contact_points`` takes; Eqs. 5 to 9.  Only where there are feet: else, and where the scene
        left the function out, ModelError.
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
        """(v_dot (nv,), bristle_rates (2K,) (m/s), forces (K, 3) (N, world)), Eqs. 1, 35 to 37.

        bristles (2K,): stretch of the points' friction springs (m), world x and y in turn, a part
        of the state that starts at zero.  legs as in ``contact_points``.
        """
        return self.kernel("contact_dynamics")(*self._with_legs((q, v, tau, bristles), legs))

    def _with_legs(
        self, arrays: tuple[ArrayLike, ...], legs: ArrayLike | None
    ) -> tuple[ArrayLike, ...]:
        """Return the arguments with the legs' angles, where the model has legs."""
        if ("feet" in self.contacts) == (legs is not None):
            return arrays if legs is None else (*arrays, legs)
        if legs is None:
            raise StateError(f"{self.name} has feet: give legs, 4 angles (rad) and 4 rates (rad/s)")
        raise StateError(
            f'{self.name} has no feet, but legs were given: leave them out, or add "feet" to '
            "`contacts`"
        )

    def forward_dynamics_derivatives(
        self, q: ArrayLike, v: ArrayLike, tau: ArrayLike
    ) -> tuple[Array, Array, Array]:
        """(dq (nv, nv), dv (nv, nv), dtau (nv, 2m)): exact Jacobians of v_dot of Eq. 1.

        They are -H^-1 d(H v_dot + C).  dq is taken in the tangent space of q, as all derivatives
        are: column k is the rate of v_dot when q moves with the velocity e_k, so columns 3 to 5 are
        turns of the torso in the body frame.
        """
        return self.kernel("forward_dynamics_derivatives")(q, v, tau)

    def forward_dynamics_parameter_derivatives(
        self, q: ArrayLike, v: ArrayLike, tau: ArrayLike
    ) -> Array:
        """Jacobian (nv, parameters) of v_dot, in the order of ``casadi.parameter_vector``."""
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
        """Derivative of v_dot (nv,) in the direction dq (nv,), dv (nv,), dtau (2m,).

        No Jacobian is formed.
        """
        return self.kernel("forward_dynamics_jvp")(q, v, tau, dq, dv, dtau)

    def forward_dynamics_vjp(
        self, q: ArrayLike, v: ArrayLike, tau: ArrayLike, multiplier: ArrayLike
    ) -> tuple[Array, Array, Array]:
        """(dq (nv,), dv (nv,), dtau (2m,)): gradient of multiplier^T v_dot.

        No Jacobian is formed.
        """
        return self.kernel("forward_dynamics_vjp")(q, v, tau, multiplier)

    def inverse_dynamics_derivatives(
        self, q: ArrayLike, v: ArrayLike, v_dot: ArrayLike
    ) -> tuple[Array, Array]:
        """(dq (nv, nv), dv (nv, nv)): exact Jacobians of H v_dot + C; by v_dot it is H."""
        return self.kernel("inverse_dynamics_derivatives")(q, v, v_dot)

    def inverse_dynamics_parameter_derivatives(
        self, q: ArrayLike, v: ArrayLike, v_dot: ArrayLike
    ) -> Array:
        """Jacobian (nv, parameters) of H v_dot + C, in the order of ``casadi.parameter_vector``."""
        return self.kernel("inverse_dynamics_parameter_derivatives")(q, v, v_dot)

    def inverse_dynamics_vjp(
        self, q: ArrayLike, v: ArrayLike, v_dot: ArrayLike, multiplier: ArrayLike
    ) -> tuple[Array, Array, Array]:
        """(dq (nv,), dv (nv,), dv_dot (nv,)): gradient of multiplier^T (H v_dot + C)."""
        return self.kernel("inverse_dynamics_vjp")(q, v, v_dot, multiplier)

    def inverse_dynamics_hessian(
        self, q: ArrayLike, v: ArrayLike, v_dot: ArrayLike, multiplier: ArrayLike
    ) -> tuple[Array, Array, Array, Array]:
        """(qq, qv, vv, aq), each (nv, nv): second derivatives of multiplier^T (H v_dot + C).

        qq by turns through the exponential map, symmetric; qv has rows of q; aq = d(H
        multiplier)/dq has rows of v_dot. The blocks (v_dot, v_dot) and (v_dot, v) are zero.
        """
        return self.kernel("inverse_dynamics_hessian")(q, v, v_dot, multiplier)

    def energy_derivatives(self, q: ArrayLike, v: ArrayLike) -> tuple[Array, Array, Array]:
        """(kinetic_dq, kinetic_dv, potential_dq), each (nv,): gradients of both energies."""
        return self.kernel("energy_derivatives")(q, v)

    def momentum_derivatives(self, q: ArrayLike, v: ArrayLike) -> tuple[Array, Array, Array, Array]:
        """(linear_dq, linear_dv, angular_dq, angular_dv) (3, nv): Jacobians of ``momentum``."""
        return self.kernel("momentum_derivatives")(q, v)

    def airborne_rates(self, x: ArrayLike, tau: ArrayLike, angular: ArrayLike) -> Array:
        """y (7 + 4m,): rates of x = (quaternion, q_t, q_t_dot) in flight, then omega (rad/s, body).

        angular (3,) is the angular momentum about the COM (kg m^2/s, world), which gives omega.
        """
        return self.kernel("airborne_rates")(x, tau, angular)

    def airborne_rates_derivatives(
        self, x: ArrayLike, tau: ArrayLike, angular: ArrayLike
    ) -> tuple[Array, Array]:
        """(y, J (7 + 4m, 4 + 6m)): ``airborne_rates`` and its Jacobian by (x, tau)."""
        return self.kernel("airborne_rates_derivatives")(x, tau, angular)

    def airborne_rates_hessian(
        self, x: ArrayLike, tau: ArrayLike, angular: ArrayLike, weights: ArrayLike
    ) -> tuple[Array, Array, Array]:
        """(y, J, H (4 + 6m, 4 + 6m)): the same, and second derivatives of weights^T y."""
        return self.kernel("airborne_rates_hessian")(x, tau, angular, weights)

    crba = mass_matrix
    nle = bias_force
    rnea = inverse_dynamics
    aba = forward_dynamics
