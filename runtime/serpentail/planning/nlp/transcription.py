"""The nonlinear program (NLP) of a problem on a mesh, with exact sparse derivatives.

Objective and constraints are linear in the unknowns w and in the values Y of one function at all
nodes: f = cost Y + direct w, g = linear w + weights Y. All derivatives follow from those of this
function.
"""

from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from serpentail_scene.layout import TAIL_Q

from ...model.model import Model
from ..problem import PlanningProblem
from .cache import memoised
from .coordinates import Attitude, attitude
from .derivatives import Assembly
from .direct import DirectRows, direct_rows
from .equations import Equations
from .indices import Indices, indices_of
from .mesh import Mesh
from .node import UNIT_OF_BOUND, Node, Variables, node_function, variables_of
from .rules import CollocationRule
from .start import with_start

if TYPE_CHECKING:
    import casadi as ca


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
    direct: DirectRows  # the last of these

    @property
    def fractions(self) -> np.ndarray:
        """Points (P,) as fractions of the duration."""
        return self.mesh.points(self.rule)

    def rates(self, w: np.ndarray, p: np.ndarray) -> np.ndarray:
        """Rates (N, nx) of the states at the nodes, in units, times the duration; p: parameters."""
        return np.array(self.functions["values"](w, p)).T[:, : self.node.rates]


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
    variables = with_start(variables, model, problem)

    # dependencies of a node's function, and of the whole program
    goal, bounds = problem.goal.attitude, problem.bounds
    arrays = (goal, bounds.torque, bounds.torque_rate)
    key: tuple[Any, ...] = tuple(None if x is None else tuple(x) for x in arrays)
    key += (problem.objective, problem.smoothing, problem.damping, problem.path)
    key += (None if problem.legs is None else tuple(problem.legs.curve.at(0.0)[0]),)
    key += (problem.formulation, problem.attitude, model, equations.source)
    key += (problem.is_free, problem.design.key)

    make_node = partial(node_function, model, problem, coordinates, variables, equations)
    node = memoised(("node", *key), make_node)
    make_nlp = partial(transcribe, problem, mesh, rule, equations, variables, node)
    nlp = memoised((*key, mesh.key, rule), make_nlp)
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
    direct = direct_rows(problem, variables, indices, mesh, rule)
    assembly = collocate(node, indices, (mesh, rule), direct.matrix, problem.objective == "time")
    functions = assembly.functions()
    rows = functions["nlp"].size1_out("g")
    return Transcription(
        problem,
        mesh,
        rule,
        coordinates,
        variables,
        equations,
        node,
        indices,
        functions,
        rows,
        direct,
    )


def collocate(
    node: Node,
    indices: Indices,
    scheme: tuple[Mesh, CollocationRule],
    direct: Any,
    time: bool = False,
) -> Assembly:
    """Return defects of all intervals, residuals and path constraints of all nodes, and `direct`.

    The objective is Eq. 40, the defects are Eqs. 41, 42 for any rule. direct: a sparse matrix of
    SciPy with constraints of w alone. time: the duration is added to the objective.
    """
    mesh, rule = scheme
    nodes = len(indices.others)
    weights = _node_rows(node, mesh, rule, nodes)
    defects = _defect_rows(indices, mesh, rule)
    linear = _stack([(defects, weights.shape[0]), (direct, direct.shape[0])])
    weights = _pad(weights, linear.shape[0])
    slope = np.zeros(indices.size)
    slope[0] = time
    return Assembly(
        node,
        indices.nodes(),
        mesh.points(rule)[indices.first :],
        linear,
        weights,
        _cost(node, mesh, rule, nodes),
        slope,
    )


def torque_unit(problem: PlanningProblem) -> np.ndarray:
    """Unit (2m,) of torques: a fraction of their bound."""
    bound = problem.bounds.torque
    if bound is None:
        return np.full(len(problem.q0[TAIL_Q]), 1e-3)
    return UNIT_OF_BOUND * bound


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

    # constraints of every node
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


def _stack(parts: list[tuple[Any, int]]) -> Any:
    """Rows below each other, each padded with empty ones to its count."""
    from scipy.sparse import vstack

    return vstack([_pad(rows, count) for rows, count in parts]).tocsc()


def _pad(rows: Any, count: int) -> Any:
    from scipy.sparse import csc_matrix, vstack

    return vstack([rows, csc_matrix((count - rows.shape[0], rows.shape[1]))]).tocsc()
