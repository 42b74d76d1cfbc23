"""The nonlinear program (NLP) of a problem on a mesh, with exact sparse derivatives.

Objective and constraints are linear in the unknowns w and in the values Y of one function at all
nodes: f = cost Y + direct w, g = linear w + weights Y.  All derivatives follow from those of that
one function.
"""

from dataclasses import dataclass, replace
from functools import partial
from itertools import accumulate
from typing import TYPE_CHECKING, Any

import numpy as np

from ...model.layout import TAIL_Q
from ...model.model import Model
from ..problem import PlanningProblem
from .cache import memoised
from .coordinates import Attitude, attitude
from .derivatives import Assembly
from .mesh import Mesh
from .node import Equations, Node, Variables, node_function, variables_of
from .rules import CollocationRule

if TYPE_CHECKING:
    import casadi as ca


@dataclass(frozen=True, eq=False)
class Indices:
    """Where the unknowns are in w: the duration first, then points and nodes along the motion.

    states (P, nx): of all points; others (N, na + nu): algebraic unknowns and torques of all nodes.
    """

    states: np.ndarray
    others: np.ndarray
    algebraic: int  # na
    first: int  # the point that is the first node: 0, or 1 where the start is none

    @property
    def controls(self) -> np.ndarray:
        """Indices (N, nu) of the torques."""
        return self.others[:, self.algebraic :]

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return 1 + self.states.size + self.others.size

    def nodes(self) -> np.ndarray:
        """Indices (1 + nx + na + nu, N) of what each node's function takes."""
        duration = np.zeros((len(self.others), 1), int)
        return np.column_stack([duration, self.states[self.first :], self.others]).T


def indices_of(variables: Variables, mesh: Mesh, rule: CollocationRule) -> Indices:
    """Return the indices, unknowns that meet in an equation being neighbours."""
    nx, na, nu = variables.sizes()
    points = mesh.intervals * rule.steps + 1
    first = 0 if rule.nodes[0] == 0 else 1
    widths = np.full(points, nx + na + nu)
    widths[:first] = nx
    starts = 1 + np.concatenate([[0], np.cumsum(widths)[:-1]])
    states = starts[:, None] + np.arange(nx)
    others = (starts[first:] + nx)[:, None] + np.arange(na + nu)
    return Indices(states, others, na, first)


@dataclass(frozen=True, eq=False)
class Transcription:
    """A nonlinear program, and what its unknowns mean."""

    problem: PlanningProblem
    mesh: Mesh
    rule: CollocationRule
    attitude: Attitude
    variables: Variables
    equations: Equations
    node: Node
    indices: Indices
    functions: "dict[str, ca.Function]"  # by CasADi's names: nlp, jac_g, grad_f, hess_lag; values
    rows: int  # of the constraints

    @property
    def fractions(self) -> np.ndarray:
        """Points (P,) as fractions of the duration."""
        return self.mesh.points(self.rule)


def transcription_of(
    model: Model,
    problem: PlanningProblem,
    mesh: Mesh,
    rule: CollocationRule,
    equations: Equations,
) -> Transcription:
    """Return the program of a problem on a mesh, made once for all starts, durations and limits."""
    coordinates = attitude(problem.attitude)
    variables = variables_of(
        problem.formulation, coordinates, model.layout.nt, torque_unit(problem)
    )

    # what a node's function depends on, and what the whole program does
    goal, bounds = problem.goal.attitude, problem.bounds
    arrays = (goal, bounds.torque, bounds.torque_rate)
    key: tuple[Any, ...] = tuple(None if x is None else tuple(x) for x in arrays)
    key += (problem.objective, problem.smoothing, problem.damping, problem.path)
    key += (problem.formulation, problem.attitude, model, equations.source)

    make_node = partial(node_function, model, problem, coordinates, variables, equations)
    node = memoised(("node", *key), make_node)
    make_nlp = partial(transcribe, problem, mesh, rule, equations, variables, node)
    nlp = memoised((*key, tuple(mesh.ends), rule), make_nlp)
    return replace(nlp, problem=problem)


def transcribe(
    problem: PlanningProblem,
    mesh: Mesh,
    rule: CollocationRule,
    equations: Equations,
    variables: Variables,
    node: Node,
) -> Transcription:
    """Return the program of a problem on a mesh, of the function of one node."""
    coordinates = attitude(problem.attitude)
    indices = indices_of(variables, mesh, rule)
    direct = _direct_rows(problem, variables, indices, mesh, rule)
    assembly = collocate(node, indices, (mesh, rule), direct, problem.objective == "time")
    functions = assembly.functions()
    rows = functions["nlp"].size1_out("g")
    return Transcription(
        problem, mesh, rule, coordinates, variables, equations, node, indices, functions, rows
    )


def collocate(
    node: Node,
    indices: Indices,
    scheme: tuple[Mesh, CollocationRule],
    direct: Any,
    time: bool = False,
) -> Assembly:
    """Return defects of all intervals, residuals and path constraints of all nodes, rows `direct`.

    The objective is Eq. 40, the defects are Eqs. 41, 42 of any rule.  direct: SciPy's sparse
    matrix, constraints of w alone.  time: the duration is added to the objective.
    """
    mesh, rule = scheme
    nodes = len(indices.others)
    weights = _node_rows(node, mesh, rule, nodes)
    defects = _defect_rows(indices, mesh, rule)
    linear = _stack([(defects, weights.shape[0]), (direct, direct.shape[0])])
    weights = _pad(weights, linear.shape[0])
    slope = np.zeros(indices.size)
    slope[0] = time
    return Assembly(node, indices.nodes(), linear, weights, _cost(node, mesh, rule, nodes), slope)


def torque_unit(problem: PlanningProblem) -> np.ndarray:
    """Unit (2m,) of torques: a fraction of their bound, as plans of least effort are far inside."""
    bound = problem.bounds.torque
    if bound is None:
        return np.full(len(problem.q0[TAIL_Q]), 1e-3)
    return 0.05 * bound


def _defect_rows(indices: Indices, mesh: Mesh, rule: CollocationRule) -> Any:
    """The part of the defects that is linear in the states."""
    from scipy.sparse import coo_matrix

    nx, N, S = indices.states.shape[1], mesh.intervals, rule.steps
    interval, i, j, x = np.meshgrid(*map(np.arange, (N, S, S + 1, nx)), indexing="ij")
    rows, columns = (interval * S + i) * nx + x, indices.states[interval * S + j, x]
    values = np.broadcast_to(rule.states[None, :, :, None], rows.shape)
    entries = values.ravel(), (rows.ravel(), columns.ravel())
    return coo_matrix(entries, (N * S * nx, indices.size))


def _node_rows(node: Node, mesh: Mesh, rule: CollocationRule, nodes: int) -> Any:
    """Rows (.., nodes * size) that make defects, residuals and path constraints of the nodes' Y."""
    from scipy.sparse import coo_matrix, vstack

    # - h times the rates at the nodes of an interval
    nx, N, S, K = node.rates, mesh.intervals, rule.steps, len(rule.nodes)
    interval, i, j, x = np.meshgrid(*map(np.arange, (N, S, K, nx)), indexing="ij")
    rows, columns = (interval * S + i) * nx + x, (interval * S + j) * node.size + x
    values = -mesh.widths[:, None, None, None] * rule.slopes[None, :, :, None] + 0 * x
    entries = values.ravel(), (rows.ravel(), columns.ravel())
    defects = coo_matrix(entries, (N * S * nx, nodes * node.size))

    # what holds at every node
    extra = node.residuals + node.path
    chosen = (np.arange(nodes)[:, None] * node.size + nx + np.arange(extra)).ravel()
    ones = np.ones(chosen.size), (np.arange(chosen.size), chosen)
    at_nodes = coo_matrix(ones, (chosen.size, nodes * node.size))
    return vstack([defects, at_nodes]).tocsc()


def _cost(node: Node, mesh: Mesh, rule: CollocationRule, nodes: int) -> np.ndarray:
    """Quadrature weights of the objective, (nodes * size,)."""
    cost, K = np.zeros((nodes, node.size)), len(rule.nodes)
    for k, width in enumerate(mesh.widths):
        cost[k * rule.steps : k * rule.steps + K, -1] += width * rule.weights
    return cost.ravel()


def _direct_rows(
    problem: PlanningProblem,
    variables: Variables,
    indices: Indices,
    mesh: Mesh,
    rule: CollocationRule,
) -> Any:
    """Rows of w alone: the attitude at the end, then the torques' steps within +- rate * time."""
    from scipy.sparse import coo_matrix, vstack

    coordinates = attitude(problem.attitude)
    goal = goal_matrix(problem.goal.attitude, coordinates)
    i, j = np.nonzero(goal)
    end = columns_of(indices.states, variables.states, "attitude")[-1]
    rows = [coo_matrix((goal[i, j], (i, end[j])), (len(goal), indices.size))]
    if problem.bounds.torque_rate is not None:
        rate = problem.bounds.torque_rate / variables.units["torque"]
        rows += _torque_steps(indices, rate, mesh.points(rule)[indices.first :])
    return vstack(rows).tocoo()


def _torque_steps(indices: Indices, rate: np.ndarray, times: np.ndarray) -> list:
    """Rows u[n + 1] - u[n] - r T dt <= 0 and -(u[n + 1] - u[n]) - r T dt <= 0."""
    from scipy.sparse import coo_matrix

    later, earlier = indices.controls[1:].ravel(), indices.controls[:-1].ravel()
    largest = np.outer(np.diff(times), rate).ravel()
    row, ones = np.arange(later.size), np.ones(later.size)
    rows, columns = np.tile(row, 3), np.concatenate([later, earlier, 0 * row])
    shape = (later.size, indices.size)
    return [
        coo_matrix((np.concatenate([sign * ones, -sign * ones, -largest]), (rows, columns)), shape)
        for sign in (1, -1)
    ]


def columns_of(indices: np.ndarray, blocks: tuple[tuple[str, int], ...], name: str) -> np.ndarray:
    """Indices (K, size) of one block, of those (K, sizes) of all blocks (name, size) in a row."""
    starts = accumulate((size for _, size in blocks), initial=0)
    start = dict(zip((block for block, _ in blocks), starts, strict=False))[name]
    return indices[:, start : start + dict(blocks)[name]]


def goal_matrix(goal: Any, coordinates: Attitude) -> np.ndarray:
    """Rows (.., size) of the attitude at the end that are zero, or for "euler" have given values.

    These are of the boundary constraints f_bc of Eq. 43.
    """
    if goal is None:
        return np.zeros((0, coordinates.size))
    if coordinates.kind == "euler":
        return np.eye(3)[: 2 if isinstance(goal, str) else 3]
    if isinstance(goal, str):
        return np.eye(4)[1:3]  # x = y = 0: a turn about the vertical
    w, x, y, z = goal  # the vector part of conj(goal) q
    return np.array([[-x, w, z, -y], [-y, -z, w, x], [-z, y, -x, w]])


def _stack(parts: list[tuple[Any, int]]) -> Any:
    """Rows below each other, each padded with empty ones to its count."""
    from scipy.sparse import vstack

    return vstack([_pad(rows, count) for rows, count in parts]).tocsc()


def _pad(rows: Any, count: int) -> Any:
    from scipy.sparse import csc_matrix, vstack

    return vstack([rows, csc_matrix((count - rows.shape[0], rows.shape[1]))]).tocsc()
