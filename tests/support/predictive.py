"""The program of a predictive controller's tick in CasADi.

It shares with the controller only the model's functions of CasADi.
"""

from functools import cache

import casadi as ca
import numpy as np
from scipy.optimize import minimize

import serpentail as st
from serpentail.mpc import task as weights
from tests.support.tumbling import DURATION, keyed, rat, start

TORQUE = 0.02  # N m


def plan_of(seed: int = 0, **settings) -> st.Plan:
    """Return a plan on a coarse mesh."""
    model = rat()
    common = {"duration": DURATION, "intervals": 11, "tolerance": None, "track": False}
    common |= {"goal": st.Goal(torso_rate=None), "bounds": st.Bounds(angle=np.pi / 3)}
    return keyed(model, start=start(model, seed), **(common | settings))


@cache
def airborne(model: st.Model):
    """Return the function (x, tau, h) -> (x_dot, omega); omega carries the part of h that the tail
    does not.
    """
    nt = model.layout.nt
    x, tau, h = ca.SX.sym("x", 4 + 2 * nt), ca.SX.sym("tau", nt), ca.SX.sym("h", 3)
    c, tail, rate = ca.vertsplit(x, [0, 4, 4 + nt, 4 + 2 * nt])
    q = ca.vertcat(np.zeros(3), c / ca.norm_2(c), tail)
    omega = ca.SX.sym("omega", 3)
    angular = model.casadi.momentum(q, ca.vertcat(np.zeros(3), omega, rate))[1]
    own = ca.jacobian(angular, omega)
    left = ca.substitute(h - angular, omega, np.zeros(3))
    turn = ca.solve(own, left)
    v_dot = model.casadi.forward_dynamics(q, ca.vertcat(np.zeros(3), turn, rate), tau)
    turned = ca.vertcat(-ca.dot(c[1:], turn), c[0] * turn + ca.cross(c[1:], turn))
    x_dot = ca.vertcat(turned / 2, rate, v_dot[6:])
    return ca.Function("airborne", [x, tau, h], [x_dot, turn])


class Reference:
    """Residuals of a tick at t from q, v by the correction (N m), their slopes, and its bounds."""

    def __init__(self, mpc: st.Mpc, t: float, q, v, end: float):
        model, plan, settings = mpc.model, mpc.plan, mpc.settings
        self.plan, self.nt, self.N = plan, model.layout.nt, settings.intervals
        self.rates, self.h = airborne(model), model.momentum(q, v)[1]
        self.begin, self.width = t, (end - t) / self.N
        horizon = min(settings.horizon, plan.duration)
        self.steps = int(np.ceil(horizon / self.N / settings.step - 1e-9))
        d = ca.MX.sym("d", self.N * self.nt)
        self.most = np.full(2 * self.nt, np.inf)
        if plan.problem.bounds.angle is not None:
            self.most[: self.nt] = np.pi / 3
        r, tail = self._residuals(np.concatenate([q[3:7], q[7:], v[6:]]), d, end)
        self.of = ca.Function("residuals", [d], [r, ca.jacobian(r, d)])
        self.tail = ca.Function("tail", [d], [tail, ca.jacobian(tail, d)])

    def _planned(self, t):
        return self.plan.curve.at(np.array([t]))

    def _residuals(self, x, d, end):
        plan, nt, h = self.plan, self.nt, self.width / self.steps
        smoothing, duration = plan.problem.smoothing, plan.duration
        rows, tail = [np.sqrt(self.width / duration) / TORQUE * d], []
        for j in range(self.N):
            own = d[j * nt : (j + 1) * nt]
            for i in range(self.steps):
                t = self.begin + j * self.width + i * h
                x = self._step(x, own, t, h)
                off = x[4 + nt :] - self._planned(t + h)["tail_rate"][0]
                rows.append(np.sqrt(h / duration) * smoothing / TORQUE * off)
                tail.append(x[4:])
        rows.append(self._end(x, d[(self.N - 1) * nt :], end))
        return ca.vertcat(*rows), ca.vertcat(*tail)

    def _step(self, x, own, t, h):
        def rate(t, x):
            tau = self._planned(t)["torque"][0] + own - self.plan.problem.damping * x[-self.nt :]
            return self.rates(x, tau, self.h)[0]

        # the controller's own times at ends of pieces, where torques jump
        k1 = rate(t, x)
        k2 = rate(t + h / 2, x + h / 2 * k1)
        k3 = rate(t + h / 2, x + h / 2 * k2)
        k4 = rate(t + h, x + h * k3)
        return x + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)

    def _end(self, x, own, end):
        plan, nt = self.plan, self.nt
        if end < plan.duration:
            there = self._planned(end)
            w, a, b, d = there["attitude"][0]
            conj = np.array([[-a, w, d, -b], [-b, -d, w, a], [-d, b, -a, w]])
            wanted = np.concatenate([there["tail"][0], there["tail_rate"][0]])
            off = (x[4:] - wanted) / np.repeat([weights.ANGLE, weights.RATE], nt)
            return ca.vertcat(2 * conj @ x[:4] / weights.TURN, off)
        goal, rows = plan.problem.goal, [2 * x[1:3] / weights.TURN]
        if goal.torso_rate is not None:
            turn = self.rates(x, own, self.h)[1]
            rows.append((turn - goal.torso_rate) / weights.TURN_RATE)
        parts = ((goal.tail, 4, weights.ANGLE), (goal.tail_rate, 4 + nt, weights.RATE))
        for wanted, first, unit in parts:
            for a in range(nt if wanted is not None else 0):
                if np.isfinite(wanted[a]):
                    rows.append((x[first + a] - wanted[a]) / unit)
        return ca.vertcat(*rows)

    def bounds(self):
        """Return bounds of the correction: torques keep their bounds at all ends of steps."""
        parts = np.arange(self.steps + 1) / self.steps
        times = self.begin + (np.arange(self.N)[:, None] + parts) * self.width
        rows = np.array([[self._planned(t)["torque"][0] for t in row] for row in times])
        return (-TORQUE - rows).max(axis=1).ravel(), (TORQUE - rows).min(axis=1).ravel()

    def largest(self, d):
        """Return the largest angles and rates of each interval, with their slopes, and bounds."""
        tail, slopes = (np.array(part) for part in self.tail(d))
        tail = tail.reshape(self.N, self.steps, -1)
        at = np.abs(tail).argmax(axis=1)
        j, a = np.indices(at.shape)
        slopes = slopes.reshape(*tail.shape, -1)[j, at, a].reshape(at.size, -1)
        return tail[j, at, a].ravel(), slopes, np.tile(self.most, self.N)

    def step(self, d):
        """Return the correction after a Gauss-Newton step, by SciPy."""
        r, J = (np.array(part) for part in self.of(d))
        lower, upper = self.bounds()
        tail, slopes, most = self.largest(d)
        finite = np.isfinite(most)
        tail, slopes, most = tail[finite], slopes[finite] * TORQUE, most[finite]
        Q, R = np.linalg.qr(J * TORQUE)  # in units of the torque
        rooms = [(most - tail, -slopes), (most + tail, slopes)]
        sides = np.stack([lower - d, upper - d], 1) / TORQUE
        return d + TORQUE * least_squares(R, Q.T @ r.ravel(), sides, rooms)


def least_squares(R, c, sides, rooms) -> np.ndarray:
    """Return x that minimises |R x + c|^2 with bounds of x (n, 2), and room + slope x >= 0 for each
    (room, slope) of ``rooms``, by SciPy.
    """
    turned = np.linalg.inv(R)  # x = turned y, so that the sum is |y + c|^2
    rooms = [*rooms, (-sides[:, 0], np.eye(len(c))), (sides[:, 1], -np.eye(len(c)))]
    rows = [
        {
            "type": "ineq",
            "fun": lambda y, a=a, A=A @ turned: a + A @ y,
            "jac": lambda _, A=A @ turned: A,
        }
        for a, A in rooms
    ]
    scale, y = 1 / (1 + c @ c), np.zeros(len(c))
    for _ in range(3):  # it stops early where the sum is flat
        y = minimize(
            lambda y: scale * ((y + c) ** 2).sum() / 2,
            y,
            jac=lambda y: scale * (y + c),
            constraints=rows,
            method="SLSQP",
            options={"ftol": 1e-18, "maxiter": 1000},
        ).x
    return turned @ y


def correction_of(mpc: st.Mpc) -> np.ndarray:
    """Return the correction (N 2m,) of the last tick that did not fail."""
    size = mpc.settings.intervals * mpc.model.layout.nt
    first = size * mpc._own.run.state.newest
    return mpc._own.memory[first : first + size].copy()
