"""Any torso with any chains as a set of rigid bodies, in 60 digits: own links and arcs, any mount.

Nothing is derived. Positions and attitudes of all bodies are functions of time along a motion;
their velocities and accelerations are differences of these, exact to 20 digits and more. Arcs are
point masses at Gauss-Legendre nodes. It shares no formula with the recursions under test.
"""

from dataclasses import dataclass
from functools import cache, lru_cache

import mpmath
import numpy as np

MP = mpmath.mp.clone()
MP.dps = 60
STEP = MP.mpf(10) ** -15
NODES = 24  # of an arc bent by less than pi


@dataclass(frozen=True)
class Link:
    """A rigid link along -y of its frame: kg, m, COM from the joint (m), moments about the COM."""

    mass: float
    length: float
    center: float
    inertia: tuple[float, float, float]


@dataclass(frozen=True)
class Arc:
    """A segment of constant curvature without inertia of its sections: kg, m."""

    mass: float
    length: float
    samples: int = 5


@dataclass(frozen=True)
class Hinge:
    """A joint about one axis, and a body with its COM and the next joint anywhere (m), or none.

    moments about the COM, axes of its frame; rotor: kg m^2, felt by the hinge's angle alone.
    """

    axis: int
    mass: float = 0.0
    center: tuple[float, float, float] = (0.0, 0.0, 0.0)
    inertia: tuple[float, float, float] = (0.0, 0.0, 0.0)
    tip: tuple[float, float, float] = (0.0, 0.0, 0.0)
    rotor: float = 0.0


@dataclass(frozen=True)
class Chain:
    """A chain besides the tail; a mirrored one is the image of what it says in the plane x = 0."""

    segments: tuple
    mount: tuple[float, float, float]
    mount_angles: tuple[float, float, float] = (0.0, 0.0, 0.0)
    mirrored: bool = False


@dataclass(frozen=True)
class Animal:
    """A torso and a tail, with other chains: each segment is a list of links, an arc or a hinge."""

    segments: tuple
    torso_mass: float
    torso_inertia: tuple[float, float, float]
    tail_mount: tuple[float, float, float]
    gravity: float = 9.8
    mount_angles: tuple[float, float, float] = (0.0, 0.0, 0.0)
    chains: tuple[Chain, ...] = ()

    @property
    def _all(self):
        return (Chain(self.segments, self.tail_mount, self.mount_angles), *self.chains)

    @property
    def _rotors(self):
        each = [segment for chain in self._all for segment in chain.segments]
        rotors = [[s.rotor] if isinstance(s, Hinge) else [0, 0] for s in each]
        return np.concatenate([[0] * 6, *rotors])

    @property
    def _size(self):
        return len(self._rotors)

    # ---- places ----------------------------------------------------------------------------

    def bodies(self, q):
        """Mass, COM, attitude and moments of all bodies in the world, and points of all chains."""
        place, R, at = q[:3], rotation(q[3:7]), 7
        found, points = [(MP.mpf(self.torso_mass), place, R, exact(self.torso_inertia))], []
        for chain in self._all:
            stop = at + sum(2 - isinstance(segment, Hinge) for segment in chain.segments)
            flip = (1 - 2 * chain.mirrored, 1, 1) * ONE
            bodies, own = self._of_chain(chain, q[at:stop])
            for mass, com, turn, moments in bodies:  # a turn of the image is proper again
                turned_back = R.dot(flip).dot(turn).dot(flip)
                found.append((mass, place + R.dot(flip.dot(com)), turned_back, moments))
            points += [place + R.dot(flip.dot(point)) for point in own]
            at = stop
        return found, points

    def _of_chain(self, chain, angles):
        """The bodies and the points of a chain in torso axes, as if it were not mirrored."""
        joint, (pitch, roll, yaw) = exact(chain.mount), exact(chain.mount_angles)
        frame = about(2, yaw).dot(about(0, pitch)).dot(about(1, roll))
        found, points, left = [], [joint], list(angles)
        for segment in chain.segments:
            first = left.pop(0)
            if isinstance(segment, Hinge):
                frame = frame.dot(about(segment.axis, first))
                com = joint + frame.dot(exact(segment.center))
                found.append((MP.mpf(segment.mass), com, frame, exact(segment.inertia)))
                joint = joint + frame.dot(exact(segment.tip))
                points.append(joint)
                continue
            second = left.pop(0)
            if isinstance(segment, Arc):
                for x, weight in nodes():
                    local, _ = bent(first * x, second * x, segment.length * x)
                    mass = MP.mpf(segment.mass) * weight
                    found.append((mass, joint + frame.dot(local), frame, exact([0, 0, 0])))
                for k in range(1, segment.samples + 1):
                    x = MP.mpf(k) / segment.samples
                    local, turn = bent(first * x, second * x, segment.length * x)
                    points.append(joint + frame.dot(local))
                joint, frame = points[-1], frame.dot(turn)
                continue
            for link in segment:
                frame = frame.dot(about(0, first)).dot(about(2, second))
                com = joint - frame[:, 1] * MP.mpf(link.center)
                found.append((MP.mpf(link.mass), com, frame, exact(link.inertia)))
                joint = joint - frame[:, 1] * MP.mpf(link.length)
                points.append(joint)
        return found, points

    # ---- motions ---------------------------------------------------------------------------

    def _rates(self, q, v):
        """Velocity of the COM and angular velocity of each body, world axes."""
        ahead, behind = (self.bodies(moved(q, v, h))[0] for h in (STEP, -STEP))
        rates = []
        for (_, p1, R1, _), (_, p0, R0, _) in zip(ahead, behind, strict=True):
            rates.append(((p1 - p0) / (2 * STEP), spin((R1 - R0) / (2 * STEP), (R1 + R0) / 2)))
        return rates

    def _jacobians(self, q):
        columns = [self._rates(q, unit) for unit in np.eye(self._size)]
        return [list(zip(*of_body, strict=True)) for of_body in zip(*columns, strict=True)]

    def inertia(self, q):
        """H for (p_dot world, omega body, q_t_dot)."""
        H = np.full((self._size, self._size), MP.mpf(0))
        for (mass, _, R, moments), (linear, angular) in zip(
            self.bodies(q)[0], self._jacobians(q), strict=True
        ):
            J, W = np.array(linear).T, np.array(angular).T
            H = H + mass * J.T.dot(J) + W.T.dot(R * moments).dot(R.T.dot(W))
        return H + np.diag(exact(self._rotors))

    def inverse_dynamics(self, q, v, v_dot):
        """H v_dot + C: forces and moments of all bodies through their Jacobians."""
        q, v, v_dot = exact(q), exact(v), exact(v_dot)
        force = exact(self._rotors) * v_dot
        before, now, after = (
            self.bodies(moved(q, v, h, v_dot))[0] for h in (-STEP, 0 * STEP, STEP)
        )
        spins = [self._rates(moved(q, v, h, v_dot), v + v_dot * h) for h in (-STEP, 0 * STEP, STEP)]
        for k, (linear, angular) in enumerate(self._jacobians(q)):
            mass, place, R, moments = now[k]
            a = (after[k][1] - 2 * place + before[k][1]) / STEP**2
            a = a + exact([0, 0, self.gravity])
            w, w_dot = spins[1][k][1], (spins[2][k][1] - spins[0][k][1]) / (2 * STEP)
            tensor = (R * moments).dot(R.T)
            moment = tensor.dot(w_dot) + np.cross(w, tensor.dot(w))
            force = force + np.array(
                [mass * J.dot(a) + W.dot(moment) for J, W in zip(linear, angular, strict=True)]
            )
        return force

    def energy(self, q, v):
        """Kinetic and potential energy."""
        q, v = exact(q), exact(v)
        kinetic, potential = exact(self._rotors).dot(v * v) / 2, MP.mpf(0)
        for (mass, place, R, moments), (u, w) in zip(
            self.bodies(q)[0], self._rates(q, v), strict=True
        ):
            kinetic += mass * u.dot(u) / 2 + (R.T.dot(w) * moments).dot(R.T.dot(w)) / 2
            potential += mass * MP.mpf(self.gravity) * place[2]
        return float(kinetic), float(potential)

    def momentum(self, q, v):
        """Momentum, and angular momentum about the COM, world axes, in float64."""
        bodies, rates = self.bodies(exact(q))[0], self._rates(exact(q), exact(v))
        total = sum(mass for mass, *_ in bodies)
        com = sum(mass * place for mass, place, *_ in bodies) / total
        linear = sum(b[0] * u for b, (u, _) in zip(bodies, rates, strict=True))
        angular = sum(
            mass * np.cross(place - com, u) + (R * moments).dot(R.T).dot(w)
            for (mass, place, R, moments), (u, w) in zip(bodies, rates, strict=True)
        )
        return linear.astype(float), angular.astype(float)

    def tail_points(self, q):
        """The points of all chains in the world."""
        return np.array(self.bodies(exact(q))[1]).astype(float)


# ---- vectors, rotations ----------------------------------------------------------------


def exact(values):
    """Return numbers without change, in 60 digits."""
    return np.array([x if isinstance(x, MP.mpf) else MP.mpf(float(x)) for x in values])


ONE = np.array([exact(row) for row in np.eye(3)])


def about(axis, angle):
    """Rotation about a coordinate axis."""
    c, s, R = MP.cos(angle), MP.sin(angle), np.full((3, 3), MP.mpf(0))
    i, j = (axis + 1) % 3, (axis + 2) % 3
    R[axis, axis], R[i, i], R[j, j], R[i, j], R[j, i] = MP.mpf(1), c, c, -s, s
    return R


def rotation(quaternion):
    """R of (w, x, y, z) of any norm, column by column: q e q*."""
    w, e = quaternion[0], quaternion[1:]
    square = w * w + e.dot(e)
    columns = [u * (w * w - e.dot(e)) + 2 * e * e.dot(u) + 2 * w * np.cross(e, u) for u in ONE]
    return np.array(columns).T / square


def turned(quaternion, turn):
    """Quaternion times that of a rotation vector in body axes."""
    angle = MP.sqrt(turn.dot(turn))
    c, s = MP.cos(angle / 2), (MP.sin(angle / 2) / angle if angle else MP.mpf(1) / 2)
    w, e, f = quaternion[0], quaternion[1:], turn * s
    return np.array([w * c - e.dot(f), *(w * f + c * e + np.cross(e, f))])


def moved(q, v, t, v_dot=None):
    """Return the configuration a time t later: velocities change by v_dot, rotations by their
    series.

    Up to t^2: omega is parallel to itself, so w t + w_dot t^2 / 2 is the rotation to that order.
    """
    v, half = exact(v), (exact(v_dot) * t / 2 if v_dot is not None else 0)
    go = (v + half) * t
    return np.array([*(q[:3] + go[:3]), *turned(q[3:7], go[3:6]), *(q[7:] + go[6:])])


def spin(R_dot, R):
    """omega in world axes of R_dot = skew(omega) R."""
    W = R_dot.dot(R.T)
    return np.array([W[2, 1] - W[1, 2], W[0, 2] - W[2, 0], W[1, 0] - W[0, 1]]) / 2


@lru_cache(10000)  # a motion of the torso bends nothing, one of an arc bends no other arc
def bent(a, b, length):
    """Return position and attitude of the end of an arc of a bend, in its root's frame.

    The frame rotates uniformly about (a, 0, b), and moves along its own -y.
    """
    axis = np.array([a, MP.mpf(0), b])
    angle = MP.sqrt(axis.dot(axis))
    y, length = ONE[1], MP.mpf(length)
    if angle == 0:
        return -y * length, ONE
    k = axis / angle
    s, c = MP.sin(angle), MP.cos(angle)
    K = np.array([[0 * s, -k[2], k[1]], [k[2], 0 * s, -k[0]], [-k[1], k[0], 0 * s]])
    turn = ONE + s * K + (1 - c) * K.dot(K)
    mean = ONE + (1 - c) / angle * K + (1 - s / angle) * K.dot(K)
    return -mean.dot(y) * length, turn


@cache
def nodes():
    """Gauss-Legendre nodes and weights on [0, 1]."""
    found = []
    for guess in np.polynomial.legendre.leggauss(NODES)[0]:
        root = MP.findroot(lambda s: MP.legendre(NODES, s), MP.mpf(guess))
        slope = NODES * (root * MP.legendre(NODES, root) - MP.legendre(NODES - 1, root))
        slope /= root * root - 1
        found.append(((root + 1) / 2, 1 / ((1 - root * root) * slope * slope)))
    return found
