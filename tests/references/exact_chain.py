"""Dynamics of the articulated tail of any (m, n), by the paper's recursion to 40 digits."""

import numpy as np

from tests.references.digits import Bodies, ManyDigits


class ExactChain(ManyDigits):
    """Sums over links of full Jacobians and wrenches."""

    def __init__(self, parameters, segments, links, digits=40):
        """Read the parameters; every link has the same length, mass and inertia."""
        super().__init__(parameters, segments, digits)
        self.links = links
        self.link_mass = self.tail_mass / (segments * links)
        self.link_length = self.tail_length / (segments * links)
        self.link_inertia = self._link_inertia(parameters)
        ratios = np.resize(parameters.get("joint_ratios", 1.0), segments * links)
        self.ratios = self._exact(ratios)

    def _link_inertia(self, parameters):
        """One link's principal inertia: the given one, or that of an ellipsoid (r, L/2, r)."""
        if parameters.get("link_inertia") is not None:
            return self._exact(parameters["link_inertia"])
        radius, half = self.mp.mpf(parameters["link_radius"]), self.link_length / 2
        across, along = radius**2 + half**2, 2 * radius**2
        return self.link_mass / 5 * np.array([across, along, across])

    def _bodies(self, q, v, v_dot):
        """Torso and links of a motion (Eqs. 11 to 15, A1 to A14)."""
        q, v, v_dot = self._exact(q), self._exact(v), self._exact(v_dot)
        unit = self._exact(np.eye(self.nv).ravel()).reshape(self.nv, self.nv)
        R = self._torso_axes(q[3:7])
        J, W, a, turn = unit[:3], R @ unit[3:6], v_dot[:3], R @ v_dot[3:6]  # omega x omega = 0
        place, arm, omega = q[:3], R @ self.mount, R @ v[3:6]
        found = [(self.torso_mass, place, J, a, R * self.torso_inertia @ R.T, W, turn)]
        places = np.repeat(np.arange(self.segments) * 2 + 6, self.links)
        for k, ratio in zip(places, self.ratios, strict=True):
            place, J, a = _carried((place, J, a), arm, (W, omega, turn))
            turning = self._joint_rotation(*(ratio * q[k + 1 : k + 3]))
            W = W.copy()
            for own, way in ((k, R[:, 0]), (k + 1, (R @ turning)[:, 2])):
                axis = ratio * way
                turn = turn + v_dot[own] * axis + v[own] * np.cross(omega, axis)  # A9
                omega, W[:, own] = omega + v[own] * axis, W[:, own] + axis  # A1, A5
            R = R @ turning  # Eq. 12
            arm = -self.link_length * R[:, 1]
            center, J_center, a_center = _carried((place, J, a), arm / 2, (W, omega, turn))
            inertia = R * self.link_inertia @ R.T  # A13, A14
            found.append((self.link_mass, center, J_center, a_center, inertia, W, turn))
        return Bodies(*map(np.array, zip(*found, strict=True)))

    def _joint_rotation(self, alpha, beta):
        """Rx(alpha) Rz(beta) (Eq. 11)."""
        (ca, sa), (cb, sb) = self.mp.cos_sin(alpha), self.mp.cos_sin(beta)
        return np.array([[cb, -sb, 0], [ca * sb, ca * cb, -sa], [sa * sb, sa * cb, ca]])


def _carried(point, arm, turning):
    """Place, Jacobian and acceleration of the point an arm away on the same body (A6, A7, A12)."""
    (place, J, a), (W, omega, turn) = point, turning
    a = a + np.cross(turn, arm) + np.cross(omega, np.cross(omega, arm))
    return place + arm, J + np.cross(W.T, arm).T, a
