"""Riccati gains along a plan, and the plan itself, as tables for the controller's C."""

from typing import Any

import numpy as np

from ...model.model import Model
from ..goal import Bounds, middle
from ..program.end import goal_matrix
from ..result.curve import fitted
from ..result.plan import Plan
from .linear import TURNED, linear_flight

# errors at the end that weigh as much as a correction by the largest torque all the time
TURN, TURN_RATE = 1e-2, 0.1  # rad, rad/s: of the torso
ANGLE, RATE = 1e-2, 1.0  # rad, rad/s: of the tail
MOST_STEPS = 2000  # of the recursion: more ticks than that share gains
CROWDED = 3  # knots crowd towards the end, where gains grow, as this power
NONE = 1e30  # no bound, as a float too


def tables_of(model: Model, plan: Plan, period: float, knots: int) -> dict[str, np.ndarray]:
    """Return the arrays of ``gains_task`` for ticks at a period (s), but for the region."""
    bound = plan.problem.bounds.torque
    most = np.full(model.layout.nt, NONE) if bound is None else np.asarray(bound, float)
    times, gains, costs = _recursion(model, plan, period)

    # knots at steps; in each cell acts what its middle step needs
    fractions = 1 - (1 - np.linspace(0, 1, knots + 1)) ** CROWDED
    steps = np.unique(np.round(fractions * len(times)).astype(int))
    middle = (steps[:-1] + steps[1:] - 1) // 2
    twice = costs[middle] * (2 - np.eye(costs.shape[1]))
    lower = np.tril_indices(costs.shape[1])
    return {
        "most_torque": most,
        "times": plan.curve.ends,
        "plan": _polynomials(model, plan),
        "begins": times[steps[:-1]],
        "gains": gains[middle],
        "costs": twice[:, lower[0], lower[1]],
    }


def most_torque(plan: Plan, bounds: Bounds) -> np.ndarray:
    """Return the bounds of torques (2m,); without bounds, the largest torques of the plan."""
    if bounds.torque is not None:
        return np.asarray(bounds.torque, float)
    used = np.abs(plan.trajectory.tau).max(axis=0)
    return np.maximum(used, max(float(used.max()), 1e-12) / 10)


def _recursion(model: Model, plan: Plan, period: float) -> tuple[np.ndarray, ...]:
    """Return times (S,) s of steps, gains (S, 2m, n) and costs (S, n, n) of the error e there.

    A step is at most a period long; its torques are constant.
    """
    # steps divide the plan's intervals
    widths, nt = np.diff(plan.curve.ends), model.layout.nt
    parts = np.ceil(widths / max(period, plan.duration / MOST_STEPS) - 1e-9).astype(int)
    k = np.repeat(np.arange(len(widths)), parts)
    first = np.concatenate([np.arange(count) / count for count in parts])
    F, G = _transitions(model, plan, (k, first, 1 / parts[k]))

    # backwards: the least sum of squares from each step to the end
    problem, length = plan.problem, widths[k] / parts[k]
    most = most_torque(plan, problem.bounds)
    R, n = np.diag(1 / most**2) / plan.duration, F.shape[1]
    Q, P = np.zeros((n, n)), _end_cost(model, plan)
    Q[3 + nt : 3 + 2 * nt, 3 + nt : 3 + 2 * nt] = problem.smoothing**2 * R
    gains, costs = np.empty((len(k), nt, n)), np.empty((len(k), n, n))
    for i in reversed(range(len(k))):
        PG = P @ G[i]
        gains[i] = -np.linalg.solve(length[i] * R + G[i].T @ PG, PG.T @ F[i])
        P = length[i] * Q + F[i].T @ (P @ F[i] + PG @ gains[i])
        P = costs[i] = (P + P.T) / 2

    # of e instead of z
    E = linear_flight(model, plan, k, first).E
    inverse = np.linalg.inv(E)
    times = plan.curve.ends[k] + first * widths[k]
    return times, gains @ inverse, np.swapaxes(inverse, 1, 2) @ costs @ inverse


def _transitions(
    model: Model, plan: Plan, steps: tuple[np.ndarray, ...]
) -> tuple[np.ndarray, np.ndarray]:
    """Return F (S, n, n), G (S, n, 2m): z at a step's end is F z + G dtau, by the plan's rule.

    steps: intervals (S,), fractions (S,) of them at which steps begin, and their widths (S,).
    """
    (k, first, width), rule = steps, plan.rule
    nodes, count = len(rule.nodes), len(k)
    at = first[:, None] + width[:, None] * rule.nodes
    near = linear_flight(model, plan, np.repeat(k, nodes), at.ravel())
    A, B = (a.reshape(count, nodes, *a.shape[1:]) for a in (near.A, near.B))
    n, h = A.shape[2], width * np.diff(plan.curve.ends)[k]

    # z at the nodes: z_j = z + h sum_i a_ji (A_i z_i + B_i dtau)
    inner = h[:, None, None] * rule.integrals(rule.nodes)
    unknown = np.einsum("sji,siab->sjaib", inner, A).reshape(count, nodes * n, nodes * n)
    forced = np.einsum("sji,siab->sjab", inner, B).reshape(count, nodes * n, -1)
    given = np.concatenate([np.tile(np.eye(n), (count, nodes, 1)), forced], axis=2)
    z = np.linalg.solve(np.eye(nodes * n) - unknown, given).reshape(count, nodes, n, -1)
    rates = A @ z
    rates[..., n:] += B
    end = np.einsum("s,i,siab->sab", h, rule.integrals(1.0), rates)
    return end[..., :n] + np.eye(n), end[..., n:]


def _end_cost(model: Model, plan: Plan) -> np.ndarray:
    """Return the weights (n, n) of z at the plan's end; what the goal leaves free has none."""
    goal, nt = plan.problem.goal, model.layout.nt
    end = linear_flight(model, plan, np.array([plan.mesh.intervals - 1]), np.ones(1))
    x, matrix = end.planned[0, nt : nt + 4], goal_matrix(goal.attitude)
    w, v = x[0], x[1:]
    turned = np.vstack([-v, w * np.eye(3) + np.cross(v, np.eye(3)).T])  # 2 dq / dphi
    tilt = np.zeros((len(matrix), len(end.E[0])))
    tilt[:, TURNED] = matrix @ turned / TURN
    parts: Any = (
        (goal.torso_rate, 3, TURN_RATE),
        (goal.tail, 6, ANGLE),
        (goal.tail_rate, 6 + nt, RATE),
    )
    rows = [tilt]
    for wanted, begin, unit in parts:
        if wanted is not None:
            rows.append(end.E[0][begin + np.flatnonzero(np.isfinite(middle(wanted)))] / unit)
    weighed = np.concatenate(rows)
    return weighed.T @ weighed


def _polynomials(model: Model, plan: Plan) -> np.ndarray:
    """Return the plan (pieces, channels, powers), by powers of the time since the piece's begin."""
    return fitted(plan.curve, lambda k, s: linear_flight(model, plan, k, s).planned)
