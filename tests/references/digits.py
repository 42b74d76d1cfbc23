"""What tails in many digits have in common: their torso, and sums over their bodies."""

from typing import NamedTuple

import mpmath
import numpy as np


class Bodies(NamedTuple):
    """Masses, and those that turn, too: every vector in world axes, J_x v = p_dot, W v = omega."""

    masses: np.ndarray  # (K,)
    places: np.ndarray  # (K, 3), of the COM
    J: np.ndarray  # (K, 3, nv)
    accelerations: np.ndarray  # (K, 3)
    inertias: np.ndarray  # (S, 3, 3), about the COM
    W: np.ndarray  # (S, 3, nv)
    turns: np.ndarray  # (S, 3), omega_dot


class ManyDigits:
    """A torso with a tail: float64 in, float64 rounded from many digits out.

    ``_bodies(q, v, v_dot)`` of a kind of tail returns its bodies.
    """

    def __init__(self, parameters, segments, digits):
        """Open a private context of that many digits and read the parameters exactly."""
        self.segments = segments
        self.nq, self.nv = 7 + 2 * segments, 6 + 2 * segments
        self.mp = mpmath.mp.clone()
        self.mp.dps = digits
        self.torso_mass, self.tail_mass, self.tail_length, gravity = self._exact(
            parameters[name] for name in ("torso_mass", "tail_mass", "tail_length", "gravity")
        )
        self.gravity = gravity * np.array([0, 0, 1])
        self.mount = self._exact(parameters["tail_mount"])
        self.torso_inertia = self._exact(parameters["torso_inertia"])

    def mass_matrix(self, q):
        """H of Eqs. 2, 16 and 18."""
        return self._mass_matrix(self._still(q)).astype(float)

    def bias_force(self, q, v):
        """C of Eq. 3, gravity included: the inverse dynamics at v_dot = 0."""
        return self.inverse_dynamics(q, v, np.zeros(self.nv))

    def inverse_dynamics(self, q, v, v_dot):
        """H v_dot + C, by Eqs. 3, 17 and 19 at that v_dot."""
        return self._force(self._bodies(q, v, v_dot), v).astype(float)

    def forward_dynamics(self, q, v, tau):
        """v_dot of H v_dot + C = [0; tau]."""
        bodies = self._bodies(q, v, np.zeros(self.nv))
        force = self._exact([*np.zeros(6), *tau]) - self._force(bodies, v)
        H = self.mp.matrix(self._mass_matrix(bodies).tolist())
        return np.array(list(self.mp.cholesky_solve(H, self.mp.matrix(force.tolist()))), float)

    def energy(self, q, v):
        """(kinetic, potential), the potential sum m g z."""
        bodies, v = self._still(q), self._exact(v)
        kinetic = v @ self._mass_matrix(bodies) @ v / 2
        return float(kinetic), float(bodies.masses @ bodies.places @ self.gravity)

    def momentum(self, q, v):
        """(linear, angular about the COM), in world axes."""
        bodies, v = self._still(q), self._exact(v)
        velocities, (center, total, _) = bodies.J @ v, self._center(bodies, v)
        angular = bodies.masses @ np.cross(bodies.places - center, velocities)
        spin = sum(inertia @ W @ v for inertia, W in zip(bodies.inertias, bodies.W, strict=True))
        linear = total * sum(bodies.masses)
        return linear.astype(float), (angular + spin).astype(float)

    def center_of_mass(self, q, v):
        """(position, velocity, J) of the centre of mass, in world axes."""
        return tuple(x.astype(float) for x in self._center(self._still(q), self._exact(v)))

    def _center(self, bodies, v):
        shares = bodies.masses / sum(bodies.masses)
        J = np.tensordot(shares, bodies.J, 1)
        return shares @ bodies.places, J @ v, J

    def _still(self, q):
        return self._bodies(q, np.zeros(self.nv), np.zeros(self.nv))

    def _mass_matrix(self, bodies):
        """H = sum m J^T J + W^T I W."""
        J = bodies.J.reshape(-1, self.nv)
        H = (J.T * np.repeat(bodies.masses, 3)) @ J
        turning = zip(bodies.inertias, bodies.W, strict=True)
        return H + sum(W.T @ inertia @ W for inertia, W in turning)

    def _force(self, bodies, v):
        """Sum of J^T m (p_ddot + g) + W^T (I omega_dot + omega x I omega)."""
        wrench = bodies.masses[:, None] * (bodies.accelerations + self.gravity)
        force = bodies.J.reshape(-1, self.nv).T @ wrench.ravel()
        for inertia, W, turn in zip(bodies.inertias, bodies.W, bodies.turns, strict=True):
            omega = W @ self._exact(v)
            force = force + W.T @ (inertia @ turn + np.cross(omega, inertia @ omega))
        return force

    def _torso_axes(self, quaternion):
        """R_b = I + 2 (w e~ + e~ e~) / |quaternion|^2, with the quaternion (w, e)."""
        w, cross = quaternion[0], skew(quaternion[1:])
        return np.eye(3) + (w * cross + cross @ cross) * (2 / (quaternion @ quaternion))

    def _exact(self, values):
        """The entries, float64 or already numbers of this context, as such numbers."""
        number = self.mp.mpf
        return np.array([x if isinstance(x, number) else number(float(x)) for x in values])


def skew(a):
    """a~, so that a~ b = a x b."""
    return np.array([[0, -a[2], a[1]], [a[2], 0, -a[0]], [-a[1], a[0], 0]])
