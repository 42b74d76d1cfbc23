"""Dynamics of the continuum tail from parameters and m, by point masses moved along power series,
to 40 digits.
"""

from functools import lru_cache

import numpy as np

from tests.references.digits import Bodies, ManyDigits, skew
from tests.references.metrics import BLOCKS


class ExactContinuum(ManyDigits):
    """Sums over slices at Gauss-Legendre nodes.

    A motion is an array of Taylor coefficients in the time t, up to t^2. It starts at q with the
    rates v and v_dot; the rate of the motion along one coordinate is a column of the Jacobian. The
    quadrature by 24 nodes has an error of 2e-38 at a bend of 2 pi per segment, and of 3e-24 at 4
    pi; larger bends need more nodes.
    """

    def __init__(self, parameters, segments, digits=40, nodes=24):
        """Read the parameters; the same bends in every motion are expanded once."""
        super().__init__(parameters, segments, digits)
        self._stumpff_taylor = lru_cache(maxsize=4096)(self._stumpff_taylor)
        self._jacobian = lru_cache(maxsize=64)(self._jacobian)
        self.nodes, weights = self._gauss_legendre(nodes)
        slices = np.tile(weights * (self.tail_mass / segments), segments)
        self.masses = np.array([self.torso_mass, *slices])
        self.segment_length = self.tail_length / segments

    def tail_points(self, q, samples):
        """World positions (m samples + 1, 3) of equally spaced slices, from mount to tip."""
        fractions = [self.mp.mpf(sample) / samples for sample in range(1, samples + 1)]
        frames = list(self._frames(*self._path(q)))
        slices = [self._slices(*frame, fractions)[0] for frame in frames]
        return np.concatenate([frames[0][0][0], *slices]).astype(float)

    def _bodies(self, q, v, v_dot):
        """B and every slice at a node, of which the torso alone turns."""
        places, _, halves = self._points(q, v, v_dot)
        R = self._torso_axes(self._exact(q[3:7]))
        W = R @ np.eye(self.nv)[3:6]
        turning = R * self.torso_inertia @ R.T, W, W @ self._exact(v_dot)
        points = self.masses, places, self._jacobian(tuple(q)), 2 * halves
        return Bodies(*points, *(part[None] for part in turning))

    def _jacobian(self, q):
        """The rates of all points in the motion along each coordinate."""
        return np.stack([self._points(q, unit)[1] for unit in np.eye(self.nv)], axis=2)

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
        q, rates = self._exact(q), [self._exact(x) / order for order, x in enumerate(rates, 1)]
        starts = (q[:3], 0 * q[:3], q[7:])
        origin, turn, bends = (
            np.array([start, *(rate[block] for rate in rates)])
            for start, block in zip(starts, BLOCKS, strict=True)
        )
        return origin, _product([self._torso_axes(q[3:7])], self._rotation(turn)), bends

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
        cross, argument = np.array([skew(w) for w in vector]), _product(vector, vector)
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
        # bits of guard: the largest term is below exp(sqrt(z))
        with self.mp.workprec(self.mp.prec + 20 + int(1.5 * self.mp.sqrt(argument))):
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
