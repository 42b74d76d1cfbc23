"""Transcription: a problem, a mesh and a rule go in; a nonlinear program with exact sparse
derivatives comes out.

Objective and constraints are linear in the unknowns w and in the values Y of one function at all
nodes: f = cost Y + direct w, g = linear w + weights Y.  All derivatives follow from those of that
one function.
"""

from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ..problem import PlanningProblem
from .cache import memoised
from .coordinates import Attitude, attitude
from .derivatives import Assembly
from .mesh import Mesh
from .node import Dynamics, Layout, Node, layout, node
from .rules import CollocationRule


@dataclass(frozen=True, eq=False)
class Places:
    """Where the unknowns are in w: duration 0, states (P, nx) of all points, the others (N, na +
    nu) of all nodes.
    """

    states: np.ndarray
    others: np.ndarray
    algebraic: int
    first: int  # the point that is the first node: 0, or 1 where the start is none

    @property
    def controls(self) -> np.ndarray:
        """Places (N, nu) of the torques."""
        return self.others[:, self.algebraic :]

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return 1 + self.states.size + self.others.size

    def nodes(self) -> np.ndarray:
        """Places (1 + nx + na + nu, N) of what each node's function takes."""
        duration = np.zeros((len(self.others), 1), int)
        return np.column_stack([duration, self.states[self.first :], self.others]).T


def places(form: Layout, mesh: Mesh, rule: CollocationRule) -> Places:
    """Return the places, unknowns that meet in an equation being neighbours."""
    nx, na, nu = form.sizes()
    points = mesh.intervals * rule.steps + 1
    first = 0 if rule.nodes[0] == 0 else 1
    widths = np.full(points, nx + na + nu)
    widths[:first] = nx
    starts = 1 + np.concatenate([[0], np.cumsum(widths)[:-1]])
    return Places(
        starts[:, None] + np.arange(nx),
        (starts[first:] + nx)[:, None] + np.arange(na + nu),
        na,
        first,
    )


@dataclass(frozen=True, eq=False)
class Transcription:
    """A nonlinear program, and what its unknowns mean."""

    problem: PlanningProblem
    mesh: Mesh
    rule: CollocationRule
    attitude: Attitude
    form: Layout
    equations: Dynamics
    node: Node
    places: Places
    program: dict  # functions by CasADi's names: nlp, jac_g, grad_f, hess_lag
    rows: int

    @property
    def fractions(self) -> np.ndarray:
        """Points (P,) as fractions of the duration."""
        return self.mesh.points(self.rule)


def program_of(
    model, problem: PlanningProblem, mesh: Mesh, rule: CollocationRule, equations: Dynamics
) -> Transcription:
    """Return the program of a problem on a mesh; one that differs in start, duration or limits
    alone shares it.
    """
    goal, bounds = problem.goal.attitude, problem.bounds
    of = [None if x is None else tuple(x) for x in (goal, bounds.torque, bounds.torque_rate)]
    of += [
        problem.objective,
        problem.smoothing,
        problem.damping,
        problem.path,
        problem.formulation,
        problem.attitude,
    ]
    of += [model, equations.source]
    coordinates = attitude(problem.attitude)
    form = layout(problem.formulation, coordinates, model.nv - 6, torque_unit(problem))
    one = memoised(("node", *of), partial(node, model, problem, coordinates, form, equations))
    make = partial(transcribe, problem, mesh, rule, equations, form, one)
    return replace(memoised((*of, tuple(mesh.ends), rule), make), problem=problem)


def transcribe(
    problem: PlanningProblem, mesh: Mesh, rule: CollocationRule, equations: Dynamics, form: Layout, one: Node
) -> Transcription:
    """Return the program of a problem on a mesh, of the function of one node."""
    coordinates = attitude(problem.attitude)
    where = places(form, mesh, rule)
    direct = _direct_rows(problem, form, where, mesh, rule, coordinates)
    program = collocate(one, where, (mesh, rule), direct, problem.objective == "time").functions()
    return Transcription(
        problem,
        mesh,
        rule,
        coordinates,
        form,
        equations,
        one,
        where,
        program,
        program["nlp"].size1_out("g"),
    )


def collocate(
    one: Node, where: Places, scheme: tuple[Mesh, CollocationRule], direct, time: bool = False
) -> Assembly:
    """Return the defects of all intervals, residuals and path constraints of all nodes, then rows
    `direct` of w.

    time: the duration is added to the objective.
    """
    mesh, rule = scheme
    weights, defects = (
        _node_rows(one, mesh, rule, len(where.others)),
        _defect_rows(where, mesh, rule),
    )
    linear = _stack([(defects, weights.shape[0]), (direct, direct.shape[0])])
    slope = np.zeros(where.size)
    slope[0] = time
    weights = _pad(weights, linear.shape[0])
    return Assembly(
        one, where.nodes(), linear, weights, _cost(one, mesh, rule, len(where.others)), slope
    )


def torque_unit(problem: PlanningProblem) -> np.ndarray:
    """Unit (2m,) of torques: a fraction of their bound, as plans of least effort are far inside."""
    size = len(problem.q0) - 7
    return np.full(size, 1e-3) if problem.bounds.torque is None else 0.05 * problem.bounds.torque


def _defect_rows(where: Places, mesh: Mesh, rule: CollocationRule):
    """The part of the defects that is linear in the states."""
    from scipy.sparse import coo_matrix

    nx, N, S = where.states.shape[1], mesh.intervals, rule.steps
    interval, i, j, x = np.meshgrid(*map(np.arange, (N, S, S + 1, nx)), indexing="ij")
    rows, columns = (interval * S + i) * nx + x, where.states[interval * S + j, x]
    values = np.broadcast_to(rule.states[None, :, :, None], rows.shape)
    return coo_matrix((values.ravel(), (rows.ravel(), columns.ravel())), (N * S * nx, where.size))


def _node_rows(one: Node, mesh: Mesh, rule: CollocationRule, nodes: int):
    """How the defects, residuals and path constraints are made of the nodes' values: rows (..,
    nodes * size).
    """
    from scipy.sparse import coo_matrix, vstack

    nx, N, S, K = one.rates, mesh.intervals, rule.steps, len(rule.nodes)
    interval, i, j, x = np.meshgrid(*map(np.arange, (N, S, K, nx)), indexing="ij")
    rows, columns = (interval * S + i) * nx + x, (interval * S + j) * one.size + x
    values = -mesh.widths[:, None, None, None] * rule.slopes[None, :, :, None] + 0 * x
    defects = coo_matrix(
        (values.ravel(), (rows.ravel(), columns.ravel())), (N * S * nx, nodes * one.size)
    )
    extra = one.residuals + one.path
    chosen = (np.arange(nodes)[:, None] * one.size + nx + np.arange(extra)).ravel()
    at_nodes = coo_matrix(
        (np.ones(chosen.size), (np.arange(chosen.size), chosen)), (chosen.size, nodes * one.size)
    )
    return vstack([defects, at_nodes]).tocsc()


def _cost(one: Node, mesh: Mesh, rule: CollocationRule, nodes: int) -> np.ndarray:
    """Quadrature weights of the objective, (nodes * size,)."""
    cost, K = np.zeros((nodes, one.size)), len(rule.nodes)
    for k, width in enumerate(mesh.widths):
        cost[k * rule.steps : k * rule.steps + K, -1] += width * rule.weights
    return cost.ravel()


def _direct_rows(
    problem: PlanningProblem, form: Layout, where: Places, mesh: Mesh, rule: CollocationRule, coordinates: Attitude
):
    """Rows of w alone: the attitude at the end, then the torques' steps within +- rate * time."""
    from scipy.sparse import coo_matrix, vstack

    blocks = dict(zip((name for name, _ in form.states), _starts(form.states), strict=True))
    end = where.states[-1, blocks["attitude"] : blocks["attitude"] + coordinates.size]
    goal = goal_matrix(problem.goal.attitude, coordinates)
    i, j = np.nonzero(goal)
    rows = [coo_matrix((goal[i, j], (i, end[j])), (len(goal), where.size))]
    if problem.bounds.torque_rate is not None:
        rows += _torque_steps(problem, form, where, mesh.points(rule)[where.first :])
    return vstack(rows).tocoo()


def _torque_steps(problem: PlanningProblem, form: Layout, where: Places, times: np.ndarray) -> list:
    """Rows u[n + 1] - u[n] - r T dt <= 0 and -(u[n + 1] - u[n]) - r T dt <= 0."""
    from scipy.sparse import coo_matrix

    controls = where.controls
    count, most = (
        controls[1:].size,
        np.outer(np.diff(times), problem.bounds.torque_rate / form.units["torque"]),
    )
    row, ones = np.arange(count), np.ones(count)
    rows, columns = (
        np.tile(row, 3),
        np.concatenate([controls[1:].ravel(), controls[:-1].ravel(), 0 * row]),
    )
    return [
        coo_matrix(
            (np.concatenate([s * ones, -s * ones, -most.ravel()]), (rows, columns)),
            (count, where.size),
        )
        for s in (1, -1)
    ]


def _starts(blocks) -> np.ndarray:
    return np.concatenate([[0], np.cumsum([size for _, size in blocks])[:-1]])


def goal_matrix(goal, coordinates: Attitude) -> np.ndarray:
    """Rows (.., size) of the attitude at the end that have to be zero, for "euler" to be given
    values.
    """
    if goal is None:
        return np.zeros((0, coordinates.size))
    if coordinates.kind == "euler":
        return np.eye(3)[: 2 if isinstance(goal, str) else 3]
    if isinstance(goal, str):
        return np.eye(4)[1:3]  # x = y = 0: a turn about the vertical
    w, x, y, z = goal  # the vector part of conj(goal) q
    return np.array([[-x, w, z, -y], [-y, -z, w, x], [-z, y, -x, w]])


def _stack(parts):
    """Rows below each other, each padded with as many empty ones as it is told to have."""
    from scipy.sparse import vstack

    return vstack([_pad(rows, count) for rows, count in parts]).tocsc()


def _pad(rows, count: int):
    from scipy.sparse import csc_matrix, vstack

    return vstack([rows, csc_matrix((count - rows.shape[0], rows.shape[1]))]).tocsc()
