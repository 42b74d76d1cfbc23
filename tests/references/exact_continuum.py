"""Dynamics of the continuum tail from parameters and m, by point masses moved along power series,
to 40 digits.
"""

from functools import lru_cache

import mpmath
import numpy as np

from tests.references.metrics import BLOCKS

TORSO_ROTATION = range(3, 6)


class ExactContinuum:
    """Sums over slices at Gauss-Legendre nodes; float64 in, float64 rounded from many digits out.

    A motion is an array of Taylor coefficients in the time t, up to t^2. It starts at q with the
    rates v and v_dot; the rate of the motion along one coordinate is a column of the Jacobian. The
    quadrature by 24 nodes has an error of 2e-38 at a bend of 2 pi per segment, and of 3e-24 at 4
    pi; larger bends need more nodes.
    """

    def __init__(self, parameters, segments, digits=40, nodes=24):
        """Open a private context of that many digits and read the parameters exactly."""
        self.segments = segments
        self.nq, self.nv = 7 + 2 * segments, 6 + 2 * segments
        self.mp = mpmath.mp.clone()
        self.mp.dps = digits
        self._stumpff_taylor = lru_cache(maxsize=4096)(
            self._stumpff_taylor
        )  # the same bends in every motion
        self._jacobian = lru_cache(maxsize=64)(self._jacobian)
        torso_mass, tail_mass, tail_length = (
            self.mp.mpf(parameters[name]) for name in ("torso_mass", "tail_mass", "tail_length")
        )
        self.nodes, weights = self._gauss_legendre(nodes)
        self.masses = np.array([torso_mass, *np.tile(weights * (tail_mass / segments), segments)])
        self.segment_length = tail_length / segments
        self.gravity = self._exact([0, 0, parameters["gravity"]])
        self.mount = self._exact(parameters["tail_mount"])
        self.torso_inertia = self._exact(parameters["torso_inertia"])

    def mass_matrix(self, q):
        """H of Eqs. 2 and 18."""
        return _rounded(self._mass_matrix(self._jacobian(tuple(q))))

    def bias_force(self, q, v):
        """C of Eq. 3, gravity included: the inverse dynamics at v_dot = 0."""
        return self.inverse_dynamics(q, v, np.zeros(self.nv))

    def inverse_dynamics(self, q, v, v_dot):
        """H v_dot + C, by Eqs. 3 and 19 at that v_dot."""
        return _rounded(self._force(self._jacobian(tuple(q)), q, v, v_dot))

    def forward_dynamics(self, q, v, tau, generalized_force=None):
        """v_dot of H v_dot + C = [0; tau] + generalized_force."""
        jacobian, force = self._jacobian(tuple(q)), self._exact([*np.zeros(6), *tau])
        if generalized_force is not None:
            force = force + self._exact(generalized_force)
        force = force - self._force(jacobian, q, v, np.zeros(self.nv))
        mass_matrix = self.mp.matrix(self._mass_matrix(jacobian).tolist())
        return _rounded(list(self.mp.cholesky_solve(mass_matrix, self.mp.matrix(force.tolist()))))

    def energy(self, q, v):
        """(kinetic, potential), the potential sum m g z."""
        points, velocities = self._points(q, v)
        turning = np.dot(self.torso_inertia, self._exact(v[3:6]) ** 2)
        kinetic = np.dot(self.masses, (velocities**2).sum(axis=1)) + turning
        return float(kinetic / 2), float(np.dot(self.masses, points @ self.gravity))

    def momentum(self, q, v):
        """(linear, angular about the COM), in world axes."""
        points, velocities = self._points(q, v)
        linear, center = self.masses @ velocities, self.masses @ points / sum(self.masses)
        angular = self.masses @ np.cross(points - center, velocities)
        spin = self._torso_axes(q) @ (self.torso_inertia * self._exact(v[3:6]))
        return _rounded(linear), _rounded(angular + spin)

    def center_of_mass(self, q, v):
        """(position, velocity, J) of the centre of mass, in world axes."""
        points, velocities = self._points(q, v)
        shares = self.masses / sum(self.masses)
        columns = self._jacobian(tuple(q)).reshape(self.nv, len(shares), 3)
        J = np.array([shares @ column for column in columns]).T
        return _rounded(shares @ points), _rounded(shares @ velocities), _rounded(J)

    def tail_points(self, q, samples):
        """World positions (m samples + 1, 3) of equally spaced slices, from the mount to the
        tip.
        """
        fractions = [self.mp.mpf(sample) / samples for sample in range(1, samples + 1)]
        frames = list(self._frames(*self._path(q)))
        slices = [self._slices(*frame, fractions)[0] for frame in frames]
        return _rounded(np.concatenate([frames[0][0][0], *slices]))

    def _exact(self, vector):
        """The entries, float64 or already numbers of this continuum's context, as such numbers."""
        return np.array(
            [
                entry if isinstance(entry, self.mp.mpf) else self.mp.mpf(float(entry))
                for entry in vector
            ]
        )

    def _jacobian(self, q):
        """J^T (nv, 3 points): the rates of all points in the motion along each coordinate."""
        return np.array([self._points(q, unit)[1].ravel() for unit in np.eye(self.nv)])

    def _mass_matrix(self, jacobian):
        """H = sum_x m_x J_x^T J_x + J_omega^T I_b J_omega (Eqs. 2, 18)."""
        mass_matrix = (jacobian * np.repeat(self.masses, 3)) @ jacobian.T
        mass_matrix[TORSO_ROTATION, TORSO_ROTATION] += self.torso_inertia
        return mass_matrix

    def _force(self, jacobian, q, v, v_dot):
        """sum_x J_x^T m_x (p_ddot_x + g) + J_omega^T (I_b omega_dot + omega~ I_b omega) (Eqs. 3,
        19).
        """
        accelerations = 2 * self._points(q, v, v_dot)[2]
        force = jacobian @ (self.masses[:, None] * (accelerations + self.gravity)).ravel()
        omega, omega_dot = self._exact(v[3:6]), self._exact(v_dot[3:6])
        force[3:6] += self.torso_inertia * omega_dot + np.cross(omega, self.torso_inertia * omega)
        return force

    def _points(self, q, *rates):
        """Motion (order + 1, points, 3) of B and of every slice at a node, in world axes."""
        origin, axes, bends = self._path(q, *rates)
        slices = [self._slices(*frame, self.nodes) for frame in self._frames(origin, axes, bends)]
        return np.concatenate([origin[:, None], *slices], axis=1)

    def _path(self, q, *rates):
        """p + t p_dot + t^2 p_ddot / 2, the bends likewise, and R_b Exp(t omega + t^2 omega_dot /
        2).
        """
        # up to t^2: its second derivative at t = 0 is R_b (omega~ omega~ + omega_dot~)
        rates = [
            self._exact(rate) / self.mp.factorial(order) for order, rate in enumerate(rates, 1)
        ]
        position = self._exact(q)
        starts = (position[:3], 0 * position[:3], position[7:])
        origin, turn, bends = (
            np.array([start, *(rate[block] for rate in rates)])
            for start, block in zip(starts, BLOCKS, strict=True)
        )
        return origin, _product([self._torso_axes(q)], self._rotation(turn)), bends

    def _torso_axes(self, q):
        """R_b = I + 2 (w e~ + e~ e~) / |quaternion|^2, with the quaternion (w, e)."""
        quaternion = self._exact(q[3:7])
        cross = _skew(quaternion[1:])
        return np.eye(3) + (cross * quaternion[0] + cross @ cross) * (
            2 / np.dot(quaternion, quaternion)
        )

    def _frames(self, origin, axes, bends):
        """Yield each segment's (root, R_i, [a_i, b_i]) (Eqs. 33, 34)."""
        root = origin[:, None] + _product(axes, [self.mount])[:, None]
        for a, b in bends.reshape(len(bends), -1, 2).transpose(1, 2, 0):
            yield root, axes, (a, b)
            root = self._slices(root, axes, (a, b), [self.mp.one])
            axes = _product(axes, self._rotation(np.stack([a, 0 * a, b], axis=1)))

    def _slices(self, root, axes, bend, fractions):
        """p_x = root + R_i L (-sigma y + gamma (b x_axis - a z_axis)) at fractions x of a segment
        (Eq. 20).
        """
        # sigma = sin(theta x) / theta and gamma = (1 - cos(theta x)) / theta^2
        a, b = bend
        argument = _product(a, a) + _product(b, b)
        sigma, gamma = (
            np.stack([self._stumpff(k, argument * x**2) * x**k for x in fractions], axis=1)
            for k in (1, 2)
        )
        local = np.stack([_product(b, gamma), -sigma, -_product(a, gamma)], axis=2)
        return root + _product(local * self.segment_length, axes.transpose(0, 2, 1))

    def _rotation(self, vector):
        """Exp(w) = I + c_1 w~ + c_2 w~ w~, c_k at w . w."""
        cross, argument = np.array([_skew(w) for w in vector]), _product(vector, vector)
        rotation = _product(self._stumpff(1, argument), cross)
        rotation = rotation + _product(self._stumpff(2, argument), _product(cross, cross))
        rotation[0] += np.eye(3)
        return rotation

    def _stumpff(self, k, argument):
        """c_k(z(t)) = c_k(z_0) + c_k'(z_0) (z - z_0) + c_k''(z_0) (z - z_0)^2 / 2."""
        value, slope, curvature = self._stumpff_taylor(k, argument[0])
        change = np.array([0 * value, *argument[1:]])
        result = change * slope + _product(change, change) * curvature
        result[0] += value
        return result

    def _stumpff_taylor(self, k, argument):
        """(c_k, c_k', c_k'' / 2) of c_k(z) = sum_j (-z)^j / (2 j + k)!, term by term."""
        guard = 20 + int(
            1.5 * self.mp.sqrt(argument)
        )  # bits; the largest term is below exp(sqrt(z))
        with self.mp.workprec(self.mp.prec + guard):
            return [self._stumpff_derivative(k, argument, order) for order in range(3)]

    def _stumpff_derivative(self, k, argument, order):
        """sum_{j >= i} binomial(j, i) (-1)^j z^(j-i) / (2 j + k)!, for the derivative i = order."""
        power, total = order, self.mp.zero
        term = self.mp.mpf((-1) ** order) / self.mp.factorial(2 * order + k)
        while abs(term) > self.mp.eps:
            total += term
            power += 1
            term *= -argument * power / ((power - order) * (2 * power + k) * (2 * power + k - 1))
        return total

    def _gauss_legendre(self, count):
        """Nodes and weights on [0, 1]: the roots of P_n, by Newton's steps from cos(pi (j - 1/4) /
        (n + 1/2)).
        """
        with self.mp.workprec(self.mp.prec + 20):
            angles = [self.mp.pi * (4 * j - 1) / (4 * count + 2) for j in range(1, count + 1)]
            roots = np.array([self.mp.cos(angle) for angle in angles])
            for _ in range(9):  # the digits double from two
                value, slope = _legendre(count, roots)
                roots = roots - value / slope
            return (1 - roots) / 2, 1 / ((1 - roots**2) * _legendre(count, roots)[1] ** 2)


def _rounded(values):
    """The nearest float64 of every entry."""
    return np.array(values, dtype=float)


def _skew(a):
    """a~, so that a~ b = a x b."""
    return np.array([[0, -a[2], a[1]], [a[2], 0, -a[0]], [-a[1], a[0], 0]])


def _product(a, b):
    """Coefficients c_k = sum_i a_i b_{k-i} of a product of power series, cut like the longer; one
    may be constant.
    """
    order = max(len(a), len(b))
    terms = [
        [np.dot(a[i], b[k - i]) for i in range(k + 1) if i < len(a) and k - i < len(b)]
        for k in range(order)
    ]
    return np.array([sum(row[1:], row[0]) for row in terms])


def _legendre(count, x):
    """P_n(x) and P_n'(x) by Bonnet's recursion."""
    previous, value = x**0, x
    for n in range(1, count):
        previous, value = value, ((2 * n + 1) * x * value - n * previous) / (n + 1)
    return value, count * (previous - x * value) / (1 - x**2)
