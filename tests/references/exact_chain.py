"""Dynamics of the articulated tail from parameters and (m, n), by the paper's recursion to 40
digits.
"""

from itertools import pairwise
from typing import NamedTuple

import mpmath
import numpy as np


class Body(NamedTuple):
    """The torso (j = 0, its joint at B) or link j, every vector in world axes."""

    mass: object
    inertia: list  # columns of I_j, about the COM
    axes: list  # columns x_j, y_j, z_j of R_j
    com: list  # p_{j,com}
    to_com: list  # p_{j2c}
    to_next: list  # p_{j2j}; of the torso p_{b2t}
    segment: int  # 1 to m; 0 of the torso


class ExactChain:
    """Sums over bodies of full Jacobians and wrenches; float64 in, float64 rounded from many digits
    out.
    """

    def __init__(self, parameters, segments, links, digits=40):
        """Open a private context of that many digits and read the parameters exactly."""
        self.segments, self.links = segments, links
        self.nq, self.nv = 7 + 2 * segments, 6 + 2 * segments
        self.mp = mpmath.mp.clone()
        self.mp.dps = digits
        self.zero = self._exact(np.zeros(3))
        self.unit = [self._exact(row) for row in np.eye(3)]
        self.torso_mass, total, length = (
            self.mp.mpf(parameters[name]) for name in ("torso_mass", "tail_mass", "tail_length")
        )
        self.link_mass, self.link_length = total / (segments * links), length / (segments * links)
        self.gravity = self._exact([0, 0, parameters["gravity"]])
        self.mount = self._exact(parameters["tail_mount"])
        self.torso_inertia = self._exact(parameters["torso_inertia"])
        self.link_inertia = self._link_inertia(parameters)

    def mass_matrix(self, q):
        """H of Eqs. 2 and 16."""
        return _rounded(self._mass_matrix(self._bodies(q)))

    def bias_force(self, q, v):
        """C of Eq. 3, gravity included: the inverse dynamics at v_dot = 0."""
        return self.inverse_dynamics(q, v, np.zeros(self.nv))

    def inverse_dynamics(self, q, v, v_dot):
        """H v_dot + C, by Eqs. 3, 4 and 17 at that v_dot."""
        return _rounded(self._force(self._bodies(q), v, v_dot))

    def forward_dynamics(self, q, v, tau, generalized_force=None):
        """v_dot of H v_dot + C = [0; tau] + generalized_force."""
        bodies, applied = self._bodies(q), self.zero + self.zero + self._exact(tau)
        if generalized_force is not None:
            applied = _plus(applied, self._exact(generalized_force))
        force = _minus(applied, self._force(bodies, v, np.zeros(self.nv)))
        mass_matrix = self.mp.matrix(self._mass_matrix(bodies))
        return _rounded(list(self.mp.cholesky_solve(mass_matrix, self.mp.matrix(force))))

    def energy(self, q, v):
        """(kinetic, potential), the potential sum m g z."""
        bodies, kinetic, potential = self._bodies(q), self.mp.zero, self.mp.zero
        for body, (velocity, omega) in zip(bodies, self._velocities(bodies, v), strict=True):
            kinetic += body.mass * _dot(velocity, velocity) + _dot(
                omega, _times(body.inertia, omega)
            )
            potential += body.mass * _dot(self.gravity, body.com)
        return float(kinetic / 2), float(potential)

    def momentum(self, q, v):
        """(linear, angular about the COM), in world axes."""
        bodies, first, linear, angular = self._bodies(q), self.zero, self.zero, self.zero
        for body, (velocity, omega) in zip(bodies, self._velocities(bodies, v), strict=True):
            momentum = _scaled(body.mass, velocity)
            first, linear = _plus(first, _scaled(body.mass, body.com)), _plus(linear, momentum)
            angular = _plus(angular, _cross(body.com, momentum), _times(body.inertia, omega))
        center = _scaled(1 / sum(body.mass for body in bodies), first)
        return _rounded(linear), _rounded(_minus(angular, _cross(center, linear)))

    def center_of_mass(self, q, v):
        """(position, velocity, J) of the centre of mass, in world axes."""
        bodies = self._bodies(q)
        total, position, velocity = sum(body.mass for body in bodies), self.zero, self.zero
        columns = self.nv * [self.zero]
        motions = zip(bodies, self._velocities(bodies, v), self._jacobians(bodies), strict=True)
        for body, (speed, _), (jacobian, _) in motions:
            share = body.mass / total
            position = _plus(position, _scaled(share, body.com))
            velocity = _plus(velocity, _scaled(share, speed))
            for k, column in enumerate(jacobian):
                columns[k] = _plus(columns[k], _scaled(share, column))
        return _rounded(position), _rounded(velocity), _rounded(columns).T

    def _exact(self, vector):
        """The float64 entries as numbers of this chain's context."""
        return [self.mp.mpf(entry) for entry in np.asarray(vector, dtype=float).tolist()]

    def _link_inertia(self, parameters):
        """One link's principal inertia: the given one, or that of an ellipsoid (r, L/2, r)."""
        if parameters.get("link_inertia") is not None:
            return self._exact(parameters["link_inertia"])
        radius, half = self.mp.mpf(parameters["link_radius"]), self.link_length / 2
        across = self.link_mass * (radius**2 + half**2) / 5
        return [across, self.link_mass * 2 * radius**2 / 5, across]

    def _bodies(self, q):
        """Torso and links of a configuration (Eqs. 11 to 15, A13, A14)."""
        q = self._exact(q)
        axes, joint = self._torso_axes(q[3:7]), q[:3]
        inertia = _world_inertia(axes, self.torso_inertia)
        bodies = [
            Body(self.torso_mass, inertia, axes, joint, self.zero, _times(axes, self.mount), 0)
        ]
        for segment in range(1, self.segments + 1):
            relative = self._joint_rotation(*q[5 + 2 * segment : 7 + 2 * segment])
            for _ in range(self.links):
                joint = _plus(joint, bodies[-1].to_next)  # Eq. 14
                axes = [_times(axes, column) for column in relative]  # Eq. 12
                bodies.append(self._link(axes, joint, segment))
        return bodies

    def _link(self, axes, joint, segment):
        """Return the link that is attached along -y_j to its joint (Eqs. 13, 15, A13)."""
        to_com, to_next = (
            _scaled(-self.link_length / 2, axes[1]),
            _scaled(-self.link_length, axes[1]),
        )
        inertia = _world_inertia(axes, self.link_inertia)
        return Body(self.link_mass, inertia, axes, _plus(joint, to_com), to_com, to_next, segment)

    def _torso_axes(self, quaternion):
        """Columns of R_b = I + 2 (w e~ + e~ e~) / |quaternion|^2, with the quaternion (w, e)."""
        w, e, twice = quaternion[0], quaternion[1:], 2 / _dot(quaternion, quaternion)
        turns = [_cross(e, unit) for unit in self.unit]
        return [
            _plus(unit, _scaled(twice, _plus(_scaled(w, turn), _cross(e, turn))))
            for unit, turn in zip(self.unit, turns, strict=True)
        ]

    def _joint_rotation(self, alpha, beta):
        """Columns of Rx(alpha) Rz(beta) (Eq. 11)."""
        (ca, sa), (cb, sb) = self.mp.cos_sin(alpha), self.mp.cos_sin(beta)
        return [[cb, ca * sb, sa * sb], [-sb, ca * cb, sa * cb], [self.mp.zero, -sa, ca]]

    def _jacobians(self, bodies):
        """Yield each body's (J_com, J_omega) as columns, those of later segments left out (A5 to
        A8).
        """
        # the paper's omega_b is R_b omega in v's body components, so J_{0,omega} is [0, R_b, 0]
        joint, angular = self.unit + 3 * [self.zero], 3 * [self.zero] + bodies[0].axes
        yield joint, angular
        for parent, body in pairwise(bodies):
            joint = _carried(joint, angular, parent.to_next)  # A7
            own = 2 * body.segment + 6 - len(joint)  # 2 where a segment begins
            joint, angular = joint + own * [self.zero], angular + own * [self.zero]
            pitch, yaw = _plus(angular[-2], parent.axes[0]), _plus(angular[-1], body.axes[2])
            angular = [*angular[:-2], pitch, yaw]  # A5
            yield _carried(joint, angular, body.to_com), angular  # A6

    def _velocities(self, bodies, v):
        """Yield each body's (v_com, omega) (A1 to A4)."""
        v = self._exact(v)
        joint, omega = v[:3], _times(bodies[0].axes, v[3:6])
        yield joint, omega
        for parent, body in pairwise(bodies):
            alpha_dot, beta_dot = v[4 + 2 * body.segment : 6 + 2 * body.segment]
            joint = _plus(joint, _cross(omega, parent.to_next))  # A3
            omega = _plus(
                omega, _scaled(alpha_dot, parent.axes[0]), _scaled(beta_dot, body.axes[2])
            )  # A1
            yield _plus(joint, _cross(omega, body.to_com)), omega  # A2

    def _accelerations(self, bodies, omegas, v, v_dot):
        """Yield each body's (v_dot_com, omega_dot) (A9 to A12)."""
        v, v_dot = self._exact(v), self._exact(v_dot)
        joint, omega_dot = v_dot[:3], _times(bodies[0].axes, v_dot[3:6])  # omega x omega = 0
        yield joint, omega_dot
        for (parent, body), (omega_parent, omega) in zip(
            pairwise(bodies), pairwise(omegas), strict=True
        ):
            own = slice(4 + 2 * body.segment, 6 + 2 * body.segment)
            joint = _plus(
                joint, _point_acceleration(omega_parent, omega_dot, parent.to_next)
            )  # A11
            pitch = _axis_acceleration(parent.axes[0], omega_parent, v[own][0], v_dot[own][0])
            yaw = _axis_acceleration(body.axes[2], omega, v[own][1], v_dot[own][1])
            omega_dot = _plus(omega_dot, pitch, yaw)  # A9
            yield _plus(joint, _point_acceleration(omega, omega_dot, body.to_com)), omega_dot  # A10

    def _mass_matrix(self, bodies):
        """Rows of H = sum_j m_j J_com^T J_com + J_omega^T I_j J_omega (Eqs. 2, 16)."""
        lower = [(row + 1) * [self.mp.zero] for row in range(self.nv)]
        for body, (linear, angular) in zip(bodies, self._jacobians(bodies), strict=True):
            columns = _joined(linear, angular)
            momenta = _joined(
                [_scaled(body.mass, column) for column in linear],
                [_times(body.inertia, column) for column in angular],
            )
            for row, momentum in enumerate(momenta):
                for column in range(row + 1):
                    lower[row][column] += self.mp.fdot(columns[column], momentum)
        return [
            [lower[max(row, column)][min(row, column)] for column in range(self.nv)]
            for row in range(self.nv)
        ]

    def _force(self, bodies, v, v_dot):
        """sum_j J_com^T m (v_dot + g) + J_omega^T (I omega_dot + omega~ I omega) (Eqs. 3, 17)."""
        omegas = [omega for _, omega in self._velocities(bodies, v)]
        motions = zip(omegas, self._accelerations(bodies, omegas, v, v_dot), strict=True)
        total = self.nv * [self.mp.zero]
        for body, jacobian, motion in zip(bodies, self._jacobians(bodies), motions, strict=True):
            wrench = self._wrench(body, *motion)
            for index, column in enumerate(_joined(*jacobian)):
                total[index] += self.mp.fdot(column, wrench)
        return total

    def _wrench(self, body, omega, acceleration):
        """Force m (v_dot + g), then torque I omega_dot + omega x I omega (Eq. 17)."""
        v_dot, omega_dot = acceleration
        gyroscopic = _cross(omega, _times(body.inertia, omega))
        force = _scaled(body.mass, _plus(v_dot, self.gravity))
        return force + _plus(_times(body.inertia, omega_dot), gyroscopic)


def _rounded(values):
    """The nearest float64 of every entry."""
    return np.array(values, dtype=float)


def _plus(*vectors):
    """a + b + ..."""
    return [sum(entries[1:], entries[0]) for entries in zip(*vectors, strict=True)]


def _minus(a, b):
    """a - b."""
    return [x - y for x, y in zip(a, b, strict=True)]


def _scaled(factor, a):
    """factor a."""
    return [factor * x for x in a]


def _dot(a, b):
    """a . b."""
    return sum(x * y for x, y in zip(a, b, strict=True))


def _cross(a, b):
    """a x b = a~ b."""
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def _times(columns, a):
    """Matrix times vector, the matrix by its columns."""
    return _plus(*(_scaled(factor, column) for factor, column in zip(a, columns, strict=True)))


def _joined(first, second):
    """One list of columns above another."""
    return [top + bottom for top, bottom in zip(first, second, strict=True)]


def _world_inertia(axes, principal):
    """Columns of R diag(principal) R^T (A13, A14)."""
    scaled = [_scaled(moment, axis) for moment, axis in zip(principal, axes, strict=True)]
    return [_times(scaled, row) for row in zip(*axes, strict=True)]


def _carried(linear, angular, arm):
    """J - p~ J_omega by columns: the Jacobian of the point at p from that of J (A7, A8)."""
    moved = [_plus(x, _cross(omega, arm)) for x, omega in zip(linear[3:], angular[3:], strict=True)]
    return linear[:3] + moved  # translation of the base rotates nothing


def _point_acceleration(omega, omega_dot, arm):
    """omega_dot~ p + omega~ omega~ p (A12)."""
    return _plus(_cross(omega_dot, arm), _cross(omega, _cross(omega, arm)))


def _axis_acceleration(axis, omega, rate, rate_dot):
    """rate_dot u + rate omega~ u, the axis u turning at omega (A9)."""
    return _plus(_scaled(rate_dot, axis), _scaled(rate, _cross(omega, axis)))
