"""Springs, damping and stops of tail coordinates, from the stiffness that a stop has on the way
into it: forces and energies are its integrals, by quadrature.
"""

import numpy as np

NODES, WEIGHTS = np.polynomial.legendre.leggauss(8)  # exact up to degree 15


def smooth_step(s):
    """0 below 0, 1 above 1, with two continuous derivatives of its integral."""
    return np.where(s <= 0, 0.0, np.where(s >= 1, 1.0, 3 * s**2 - 2 * s**3))


class PassiveTail:
    """Parameters of a tail, of which those of its passive parts count, 0 where they are absent."""

    def __init__(self, parameters, coordinates):
        """Take one number for all coordinates, or one for each."""
        given = {name: np.zeros(coordinates) for name in ("tail_stiffness", "tail_rest")}
        given |= {name: np.zeros(coordinates) for name in ("tail_damping", "tail_stop_damping")}
        given["tail_stop_width"] = np.full(coordinates, 0.1)
        for name, value in parameters.items():
            if name.startswith("tail_") and name not in ("tail_mass", "tail_length", "tail_mount"):
                given[name] = np.broadcast_to(np.asarray(value, float), coordinates)
        self.given, self.stops = given, "tail_stop_lower" in given

    def force(self, angles, rates):
        """What springs, damping and stops ask of the torques."""
        g = self.given
        force = g["tail_stiffness"] * (angles - g["tail_rest"]) + self.damping(angles) * rates
        if self.stops:
            under, over = self._ways(angles)
            force = force + g["tail_stop_stiffness"] * (self._push(over) - self._push(under))
        return force

    def energy(self, angles):
        """Energy stored in springs and stops."""
        g = self.given
        energy = g["tail_stiffness"] @ (angles - g["tail_rest"]) ** 2 / 2
        if self.stops:
            stored = sum(self._stored(way) for way in self._ways(angles))
            energy += g["tail_stop_stiffness"] @ stored
        return float(energy)

    def stiffness(self, angles):
        """How the forces follow the coordinates, each its own."""
        g = self.given
        stiffness = g["tail_stiffness"] + 0 * angles
        return stiffness + (g["tail_stop_stiffness"] * self._steps(angles) if self.stops else 0.0)

    def damping(self, angles):
        """How the forces follow the rates: that of stops grows as their stiffness does."""
        stops = self.given["tail_stop_damping"] * self._steps(angles) if self.stops else 0.0
        return self.given["tail_damping"] + stops

    def _steps(self, angles):
        return sum(smooth_step(way / self.given["tail_stop_width"]) for way in self._ways(angles))

    def _ways(self, angles):
        return self.given["tail_stop_lower"] - angles, angles - self.given["tail_stop_upper"]

    def _push(self, way):
        """The integral of the stiffness up to a way, in two pieces of polynomials."""
        return self._integral(lambda x: smooth_step(x / self.given["tail_stop_width"]), way)

    def _stored(self, way):
        return self._integral(self._push, way)

    def _integral(self, function, way):
        width = self.given["tail_stop_width"]
        first = np.clip(way, 0, width)
        total = 0.0
        for begin, end in ((0 * way, first), (first, np.maximum(way, first))):
            half = (end - begin) / 2
            total = total + half * sum(
                w * function(begin + half * (1 + x)) for x, w in zip(NODES, WEIGHTS, strict=True)
            )
        return total
