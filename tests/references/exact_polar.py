"""Converts states in polar angles (phi, theta) exactly to bend components, for `ExactContinuum`."""

import numpy as np

from tests.references.exact_continuum import ExactContinuum


class ExactPolar:
    """Moves states, forces and accelerations between q_t = (phi_1, theta_1, ...) and (a_1, b_1,
    ...), to many digits.

    a = -theta cos(phi), b = theta sin(phi); with the Jacobian J of that map the tail's inertia is
    J^T H J, a force on the rates of the angles J^T times the one on (a_dot, b_dot), and v_dot of
    the bend J v_dot + J_dot v.
    """

    def __init__(self, parameters, segments, digits=50):
        """Open the continuum in bend components of that many digits."""
        self.bend = ExactContinuum(parameters, segments, digits)
        self.mp, self.nv, self._exact = self.bend.mp, self.bend.nv, self.bend._exact

    def state(self, q, v):
        """(q, v) in bend components, entries of many digits."""
        q_bend, v_bend = self._exact(q), self._jacobian(q) @ self._exact(v)
        for k, (_, theta, s, c) in enumerate(self._segments(q)):
            q_bend[7 + 2 * k : 9 + 2 * k] = -theta * c, theta * s
        return q_bend, v_bend

    def acceleration(self, q, v, v_dot):
        """The v_dot of the bend, J v_dot + J_dot v."""
        v = self._exact(v)
        v_dot_bend = self._jacobian(q) @ self._exact(v_dot)
        for k, (_, theta, s, c) in enumerate(self._segments(q)):
            phi_dot, theta_dot = v[6 + 2 * k : 8 + 2 * k]
            v_dot_bend[6 + 2 * k] += 2 * theta_dot * phi_dot * s + theta * phi_dot**2 * c
            v_dot_bend[7 + 2 * k] += 2 * theta_dot * phi_dot * c - theta * phi_dot**2 * s
        return v_dot_bend

    def force(self, q, force):
        """The force on the rates of the bend, J^-T times the one on the rates of the angles."""
        force = self._exact(force)
        tail = force[-2 * self.bend.segments :]
        for k, (_, theta, s, c) in enumerate(self._segments(q)):
            on_phi, on_theta = tail[2 * k : 2 * k + 2] / np.array([theta, self.mp.one])
            tail[2 * k : 2 * k + 2] = s * on_phi - c * on_theta, c * on_phi + s * on_theta
        return force

    def mass_matrix(self, q):
        """J^T H J, in the polar angles."""
        jacobian = self._jacobian(q)
        mass = self.bend.mass_matrix(self.state(q, np.zeros(self.nv))[0])
        return np.array(jacobian.T @ mass @ jacobian, dtype=float)

    def center_of_mass(self, q, v):
        """(position, velocity, J) of the centre of mass, J in the polar angles."""
        position, velocity, J = self.bend.center_of_mass(*self.state(q, v))
        return position, velocity, np.array(J @ self._jacobian(q), dtype=float)

    def _segments(self, q):
        """Yield (phi, theta, sin(phi), cos(phi)) of every segment."""
        for phi, theta in self._exact(q)[7:].reshape(-1, 2):
            yield phi, theta, self.mp.sin(phi), self.mp.cos(phi)

    def _jacobian(self, q):
        """J of the rates: identity for the torso, d(a, b) / d(phi, theta) for every segment."""
        jacobian = np.eye(self.nv) * self.mp.one
        for k, (_, theta, s, c) in enumerate(self._segments(q)):
            here = slice(6 + 2 * k, 8 + 2 * k)
            jacobian[here, here] = [[theta * s, -c], [theta * c, s]]
        return jacobian
