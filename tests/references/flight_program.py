"""A plan as one plain program of CasADi, which shares with the planner only the model's functions.

Unknowns are states, angular velocities and torques at all nodes of Radau's rule on a uniform mesh;
the angular velocity carries the conserved angular momentum, as a constraint.
"""

from dataclasses import dataclass

import casadi as ca
import numpy as np

import serpentail as st

RATE, TORQUE, MOMENTUM = 10.0, 1e-3, 1e-4  # units: rad/s, N m, kg m^2/s
OPTIONS = {
    "print_time": False,
    "ipopt.print_level": 0,
    "ipopt.sb": "yes",
    "ipopt.tol": 1e-11,
    "ipopt.mu_init": 1e-6,
    "ipopt.bound_push": 1e-7,
    "ipopt.bound_relax_factor": 0.0,
}


@dataclass(frozen=True)
class FlightProblem:
    """start (q, v); goal, with nan where it is free; duration (least, most), s; bounds; damping and
    smoothing, N m s.
    """

    start: tuple[np.ndarray, np.ndarray]
    goal: st.Goal
    duration: tuple[float, float]
    bounds: st.Bounds
    damping: float = 0.0
    smoothing: float = 3e-4


@dataclass(frozen=True)
class FlightOptimum:
    """Objective (N^2 m^2 s), duration (s), and torques (N, K, 2m) at the nodes."""

    objective: float
    duration: float
    torques: np.ndarray


def node_of(model: st.Model, damping: float) -> ca.Function:
    """Return (c, q_t, q_t_dot, omega, tau) -> (rates of the first three, angular momentum)."""
    nt = model.layout.nt
    parts = c, tail, rate, omega, tau = [ca.SX.sym("x", n) for n in (4, nt, nt, 3, nt)]
    q = ca.vertcat(np.zeros(3), c / ca.norm_2(c), tail)
    v = ca.vertcat(np.zeros(3), omega, rate)
    v_dot = model.casadi.forward_dynamics(q, v, tau - damping * rate)
    turning = ca.vertcat(-ca.dot(c[1:], omega), c[0] * omega + ca.cross(c[1:], omega)) / 2
    h = model.casadi.momentum(q, v)[1]
    return ca.Function("node", parts, [ca.vertcat(turning, rate, v_dot[6:]), h])


def radau(degree: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return nodes (K,), slopes (K, K + 1) of the polynomials through 0 and them, weights (K,)."""
    nodes = ca.collocation_points(degree, "radau")
    C, _, B = ca.collocation_coeff(nodes)
    return np.array(nodes), np.array(C).T, np.array(B).ravel()


def bernstein_of_values(nodes: np.ndarray) -> np.ndarray:
    """Return the matrix from values at nodes to Bernstein coefficients."""
    n = len(nodes) - 1
    choose = np.array([np.prod([(n - j) / (j + 1) for j in range(k)]) for k in range(n + 1)])
    j = np.arange(n + 1)
    return np.linalg.inv(choose * nodes[:, None] ** j * (1 - nodes[:, None]) ** (n - j))


class _Rows:
    """Constraints, each with its least and most."""

    def __init__(self) -> None:
        self.values, self.least, self.most = [], [], []

    def keep(self, value: ca.MX, least: object, most: object) -> None:
        """Add entries of one column."""
        self.values.append(value)
        self.least.append(np.broadcast_to(least, value.numel()))
        self.most.append(np.broadcast_to(most, value.numel()))

    def within(self, value: ca.MX, bound: object) -> None:
        """Add entries whose magnitudes have a bound; None: they have none."""
        if bound is not None:
            self.keep(value, -np.asarray(bound), np.asarray(bound))


def solved(model: st.Model, problem: FlightProblem, guess: st.Plan) -> FlightOptimum:
    """Solve a problem on the mesh and with the rule of a plan, from there, to 1e-11."""
    (nodes, slopes, weights), (q0, v0) = radau(guess.rule.degree), problem.start
    N, K, nt, bounds = guess.mesh.intervals, len(nodes), model.layout.nt, problem.bounds
    h, node = model.momentum(q0, v0)[1], node_of(model, problem.damping)
    unit = np.concatenate([np.ones(4 + nt), np.full(nt + 3, RATE), np.full(nt, TORQUE)])
    T, X = ca.MX.sym("T"), ca.MX.sym("X", len(unit), N * K)
    real, rows, f, x = unit[:, None] * X, _Rows(), 0, ca.DM(np.append(q0[3:], v0[6:]))
    size, width = x.numel(), T / N

    # the intervals, one after the other
    for i in range(N):
        own = real[:, i * K : (i + 1) * K]
        states, omega, tau = ca.horzcat(x, own[:size, :]), own[size:-nt, :], own[-nt:, :]
        for k in range(K):
            c, tail, rate = ca.vertsplit(states[:, k + 1], [0, 4, 4 + nt, size])
            rates, carried = node(c, tail, rate, omega[:, k], tau[:, k])
            defects = ca.mtimes(states, slopes[k]) - width * rates
            rows.keep(defects / unit[:size], 0.0, 0.0)
            rows.keep((carried - h) / MOMENTUM, 0.0, 0.0)
            rows.within(tail, bounds.angle)
            rows.within(rate, bounds.rate)
            effort = ca.sumsqr(tau[:, k]) + problem.smoothing**2 * ca.sumsqr(rate)
            f += width * weights[k] * effort / TORQUE**2
        coefficients = ca.mtimes(tau, bernstein_of_values(nodes).T)
        for k in range(K):
            rows.within(coefficients[:, k], bounds.torque)
        x = states[:, -1]
    for value in goal_rows(problem.goal, real[:, -1], nt):
        rows.keep(value, 0.0, 0.0)
    rows.keep(T, *problem.duration)

    # the plan is where it begins
    times = (np.arange(N)[:, None] + nodes).ravel() / N * guess.duration
    at, turn = guess.curve.at(times), guess.trajectory.resample(times).v[:, 3:6]
    parts = at["attitude"], at["tail"], at["tail_rate"], turn, at["torque"]
    begin = np.append(guess.duration, (np.column_stack(parts) / unit).ravel())
    nlp = {"x": ca.vertcat(T, ca.vec(X)), "f": f, "g": ca.vertcat(*rows.values)}
    solver = ca.nlpsol("flight", "ipopt", nlp, OPTIONS)
    limits = np.concatenate(rows.least), np.concatenate(rows.most)
    found = solver(x0=begin, lbg=limits[0], ubg=limits[1])
    assert solver.stats()["success"], solver.stats()["return_status"]
    values = np.array(found["x"]).ravel()
    torques = values[1:].reshape(N, K, -1)[..., -nt:] * TORQUE
    return FlightOptimum(float(found["f"]) * TORQUE**2, values[0], torques)


def goal_rows(goal: st.Goal, last, nt: int) -> list:
    """Return what is zero at the last node: of conj(goal) c its vector part."""
    c, rows = last[:4], []
    if isinstance(goal.attitude, str):
        rows += [c[1], c[2]]
    elif goal.attitude is not None:
        w, x, y, z = goal.attitude
        matrix = np.array([[-x, w, z, -y], [-y, -z, w, x], [-z, y, -x, w]])
        rows.append(ca.mtimes(matrix, c))
    places = {"tail": 4, "tail_rate": 4 + nt, "torso_rate": 4 + 2 * nt}
    for name, first in places.items():
        values = np.ravel([] if getattr(goal, name) is None else getattr(goal, name))
        rows += [last[first + k] - values[k] for k in np.flatnonzero(np.isfinite(values))]
    return rows
