"""Contact in plain NumPy: points, velocities, Jacobians, forces and stiffness.

Every formula also takes complex numbers: velocities and Jacobians are complex-step derivatives of
the points' positions.
"""

from functools import lru_cache
from itertools import pairwise

import numpy as np

STEP = 1e-30
SIDES = (1, -1)
GAUSS = np.polynomial.legendre.leggauss(12)


def hat(w):
    """The matrix of a cross product."""
    return np.array([[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]])


def turn(w):
    """Exp of a rotation vector (Rodrigues)."""
    z = w @ w
    if abs(z) < 1e-8:
        c1, c2 = 1 - z / 6, 0.5 - z / 24
    else:
        c1, c2 = np.sin(np.sqrt(z)) / np.sqrt(z), (1 - np.cos(np.sqrt(z))) / z
    return np.eye(3) + c1 * hat(w) + c2 * hat(w) @ hat(w)


def attitude(quaternion):
    """Rotation matrix of (w, x, y, z), not normalised."""
    w, axis = quaternion[0], np.asarray(quaternion[1:])
    norm = w * w + axis @ axis
    return np.eye(3) + 2 / norm * (w * hat(axis) + hat(axis) @ hat(axis))


def ray(angle):
    """u_h of Eq. 9."""
    return np.array([0 * angle, np.cos(angle), np.sin(angle)])


def joints(parameters, angles):
    """Hip, D, knee, A, M, T of the right leg, then of the left, in the torso frame (Eqs. 5 to 8,
    corrected).
    """
    P, out = parameters, []
    for side, (gamma, delta) in zip(SIDES, np.reshape(angles, (2, 2)), strict=True):
        hip = np.array(P["hip"]) * [side, 1, 1]
        D = hip + P["L_h2d"] * ray(gamma)
        knee = D + P["L_d2k"] * ray(delta)
        ankle = knee + P["L_k2a"] * ray(gamma)
        middle = ankle + P["L_a2m"] * ray(delta)
        toe = middle - P["L_m2t"] * ray(gamma - P["delta_m"])
        out.append([hip, D, knee, ankle, middle, toe])
    return out


def feet(parameters, legs):
    """A, M, T of the right foot, then of the left, in the torso frame."""
    return [point for leg in joints(parameters, legs[:4]) for point in leg[3:]]


def chain(R, P, angles, lengths):
    """Return the frame beyond a segment of links, its joints but the first, and its tip."""
    out = []
    alpha, beta = angles
    for length in lengths:
        R = R @ turn(np.array([alpha, 0, 0])) @ turn(np.array([0, 0, beta]))
        P = P - length * R[:, 1]
        out.append(P)
    return R, out


def arc(R, P, angles, length, samples):
    """Return the frame beyond an arc and its equally spaced points: Gauss-Legendre quadrature of
    the tangent.
    """
    bend, out = np.array([angles[0], 0, angles[1]]), []
    nodes, weights = GAUSS
    for k in range(samples):
        xs, ws = (k + (nodes + 1) / 2) / samples, weights / (2 * samples)
        P = P - length * R @ sum(w * turn(x * bend)[:, 1] for x, w in zip(xs, ws, strict=True))
        out.append(P)
    return R @ turn(bend), out


class Points:
    """The tail's points but the mount, in the torso frame, of links and arcs."""

    def __init__(self, model):
        given, m = model.parameters, model.segments
        self.mount, self.samples = np.array(given["tail_mount"]), model.samples
        links, total = np.broadcast_to(model.links or 0, m), given["tail_length"]
        chains = given.get("link_lengths", [total / max(1, sum(links))] * sum(links))
        arcs = iter(given.get("arc_lengths", [total / m] * m))
        ends = np.cumsum([0, *links])
        self.lengths = [chains[a:b] if a < b else next(arcs) for a, b in pairwise(ends)]
        self.kinds = model.kinds

    def at(self, q_t):
        """Return the points from root to tip."""
        R, out = np.eye(3), [self.mount]
        for kind, length, angles in zip(
            self.kinds, self.lengths, np.reshape(q_t, (-1, 2)), strict=True
        ):
            if kind == "articulated":
                R, more = chain(R, out[-1], angles, length)
            else:
                R, more = arc(R, out[-1], angles, length, self.samples)
            out += more
        return out[1:]


class Chains:
    """The points of all chains of an animal of `body_set` but their mounts, in the torso frame."""

    def __init__(self, animal):
        self.chains = animal._all

    def at(self, q_t):
        out, left = [], list(q_t)
        for one in self.chains:
            pitch, roll, yaw = map(turn, np.diag(one.mount_angles))
            R, found = yaw @ pitch @ roll, [np.array(one.mount)]
            for segment in one.segments:
                if hasattr(segment, "axis"):
                    R = R @ turn(np.eye(3)[segment.axis] * left.pop(0))
                    found.append(found[-1] + R @ np.array(segment.tip))
                    continue
                angles, place = (left.pop(0), left.pop(0)), found[-1]
                if isinstance(segment, list):
                    R, more = chain(R, place, angles, [link.length for link in segment])
                else:
                    R, more = arc(R, place, angles, segment.length, segment.samples)
                found += more
            out += [place * [1 - 2 * one.mirrored, 1, 1] for place in found[1:]]
        return out


class Contacts:
    """The points of a model, or of an animal that is the same; ``groups`` as in its manifest."""

    def __init__(self, model, animal=None):
        points = Chains(animal) if animal else Points(model)
        self.parameters = model.parameters
        # motions of the torso bend no tail and turn no leg
        self.tail = lru_cache(4)(lambda q_t: points.at(np.array(q_t)))
        self.feet = lru_cache(4)(lambda legs: feet(model.parameters, np.array(legs)))
        self.groups = [entry["group"] for entry in model.manifest["contacts"]]
        self.friction, self.nv = model.manifest["scene"]["friction"], model.nv

    def places(self, R, q_t, legs):
        """Return all points in the torso frame; the lowest point of the torso is fixed to it, so it
        has no derivative.
        """
        P, out = self.parameters, []
        if "feet" in self.groups:
            out += self.feet(tuple(legs))
        if "tail" in self.groups:
            out += self.tail(tuple(q_t))
        if "torso" in self.groups:
            axes, down = np.array(P["torso_semi_axes"]), -R.real[2]
            out.append(axes**2 * down / np.sqrt((axes * down) @ (axes * down)))
        return np.array(out)

    def positions(self, q, legs, step=None, leg_rates=0):
        """Points in the world, (K, 3); with a step, q is moved along the velocity 1j step."""
        step = np.zeros(self.nv) if step is None else np.asarray(step) * 1j * STEP
        R = attitude(q[3:7])
        moved = R @ (np.eye(3) + hat(step[3:6]))
        angles = None if legs is None else np.asarray(legs[:4]) + 1j * STEP * leg_rates
        return q[:3] + step[:3] + self.places(R, q[7:] + step[6:], angles) @ moved.T

    def velocities(self, q, v, legs):
        """Their velocities (K, 3), the legs' own motion included."""
        return self.positions(q, legs, v, 0 if legs is None else np.asarray(legs[4:])).imag / STEP

    def jacobians(self, q, legs):
        """Return d(velocity)/dv, (K, 3, nv), without the legs' rates."""
        return np.moveaxis(
            [self.positions(q, legs, unit).imag / STEP for unit in np.eye(self.nv)], 0, 2
        )

    def laws(self, q, v, bristles, legs):
        """Forces (K, 3) and bristle rates (2K,)."""
        places, motion = self.positions(q, legs).real, self.velocities(q, v, legs)
        found = [
            self.law(*one)
            for one in zip(places, motion, np.reshape(bristles, (-1, 2)), strict=True)
        ]
        return np.array([f for f, _ in found]), np.concatenate([rate for _, rate in found])

    def law(self, place, velocity, bristle, bounding=lambda normal: normal):
        """Return force and bristle rate of one point; ``bounding``: load that bounds friction."""
        P, depth = self.parameters, -place[2]
        normal = self.normal(depth, -velocity[2])
        trial = -(P["K_f"] * bristle + P["D_f"] * P["K_f"] * velocity[:2])
        f = self.limited(trial, P["mu"] * bounding(normal))
        rate = -(f + P["K_f"] * bristle) / (P["D_f"] * P["K_f"])
        if self.friction == "paper" and depth.real > 0:
            rate = velocity[:2]
        return np.array([*f, normal]), rate

    def normal(self, depth, rate):
        """Eq. 36."""
        P = self.parameters
        if depth.real <= 0:
            return 0 * depth
        push = P["K_n"] * depth**1.5 + P["D_n"] * P["K_n"] * depth**0.5 * rate
        return push if push.real > 0 else 0 * push

    def limited(self, trial, limit):
        """Return the friction force for a trial force."""
        if limit.real == 0:
            return 0 * trial
        if self.friction == "smooth":
            return trial / np.sqrt(1 + trial @ trial / limit**2)
        if self.friction == "cone":
            length = np.sqrt(trial @ trial)
            return trial if length.real <= limit.real else trial * (limit / length)
        return np.where(np.abs(trial.real) <= limit.real, trial, np.sign(trial.real) * limit)

    def slopes(self, place, velocity, bristle, share):
        """Return derivatives of force (3) and bristle rate (2) by position, velocity (3 each) and
        bristle (2), by complex steps.

        share: the part of the dependence of friction's bound on the load that is included; a
        W-method may leave it out.
        """

        def found(k):
            x = np.concatenate([place, velocity, bristle]).astype(complex)
            x[k] += 1j * STEP
            bound = self.normal(-place[2], -velocity[2])
            force, rate = self.law(
                x[:3], x[3:6], x[6:], lambda normal: bound + share * (normal - bound)
            )
            return np.concatenate([force, rate]).imag / STEP

        J = np.array([found(k) for k in range(8)]).T
        return J[:, :3], J[:, 3:6], J[:, 6:]

    def jacobian(self, state, H, damping, gains, share=1.0):
        """J of the rates of (q in its tangent space, v, bristles), of contact, joint damping and
        tracking gains.

        state: (q, v, bristles, legs).
        """
        q, v, flat, legs = state
        bristles = np.reshape(flat, (-1, 2))
        nv, count = self.nv, len(bristles)
        by_q, by_v, by_u = np.zeros((nv, nv)), np.zeros((nv, nv)), np.zeros((nv, 2 * count))
        u_q, u_v, u_u = (np.zeros((2 * count, size)) for size in (nv, nv, 2 * count))
        points = zip(
            self.positions(q, legs).real, self.velocities(q, v, legs), bristles, strict=True
        )
        for k, (J, point) in enumerate(zip(self.jacobians(q, legs), points, strict=True)):
            by_place, by_velocity, by_bristle = self.slopes(*point, share)
            own = slice(2 * k, 2 * k + 2)
            by_q, by_v = by_q + J.T @ by_place[:3] @ J, by_v + J.T @ by_velocity[:3] @ J
            u_q[own], u_v[own] = by_place[3:] @ J, by_velocity[3:] @ J
            by_u[:, own], u_u[own, own] = J.T @ by_bristle[:3], by_bristle[3:]
        by_v[6:, 6:] -= np.diag(damping) + gains[1] * H[6:, 6:]
        by_q[6:, 6:] -= gains[0] * H[6:, 6:]
        rows = (
            [np.zeros((nv, nv)), np.eye(nv), np.zeros((nv, 2 * count))],
            np.linalg.solve(H, np.hstack([by_q, by_v, by_u])),
        )
        return np.vstack([np.hstack(rows[0]), rows[1], np.hstack([u_q, u_v, u_u])])
