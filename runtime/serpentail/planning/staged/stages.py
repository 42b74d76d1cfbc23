"""The nonlinear program of a problem on a mesh as stages, which solve their collocation inside.

Its unknowns are those of the transcription, so guesses, curves and plans are the same.
"""

from dataclasses import dataclass

import numpy as np

from serpentail_scene.layout import OMEGA, VELOCITY

from ...model.model import Model
from ..nlp.coordinates import IDENTITY_POSE, Attitude, attitude
from ..nlp.direct import goal_matrix
from ..nlp.indices import Indices, columns_of, indices_of
from ..nlp.mesh import Mesh
from ..nlp.node import Variables, variables_of
from ..nlp.rules import CollocationRule
from ..nlp.transcription import torque_unit
from ..problem import PlanningProblem
from .node import NodeCode, node_code
from .stage_mesh import Cut, coefficients_of, cut


@dataclass(frozen=True, eq=False)
class Stages:
    """A program of stages, and what its unknowns mean."""

    model: Model
    problem: PlanningProblem
    mesh: Mesh
    rule: CollocationRule
    attitude: Attitude
    variables: Variables
    indices: Indices
    node: NodeCode
    cut: Cut

    @property
    def fractions(self) -> np.ndarray:
        """Points (P,) as fractions of the duration."""
        return self.mesh.points(self.rule)

    @property
    def rows(self) -> int:
        """None of the constraints has multipliers that another program takes."""
        return 0

    def rates(self, w: np.ndarray, _p: np.ndarray) -> np.ndarray:
        """Return the rates (N, nx) of the states at the nodes, in units, times the duration.

        They are the rates of the collocation polynomials.
        """
        nx, K = self.indices.states.shape[1], len(self.rule.nodes)
        points = np.arange(self.mesh.intervals)[:, None] * K + np.arange(K + 1)
        states = w[self.indices.states][points]
        grown = np.einsum("ij,kjx->kix", self.rule.states, states)
        return (grown / self.mesh.widths[:, None, None]).reshape(-1, nx)


def stages_of(model: Model, problem: PlanningProblem, mesh: Mesh, rule: CollocationRule) -> Stages:
    """Return the stages of a problem on a mesh."""
    coordinates = attitude(problem.attitude)
    variables = variables_of(
        problem.formulation, coordinates, model.layout.nt, torque_unit(problem)
    )
    return Stages(
        model,
        problem,
        mesh,
        rule,
        coordinates,
        variables,
        indices_of(variables, mesh, rule),
        node_code(model),
        cut(mesh, rule, coefficients_of(problem, rule)),
    )


def is_free(problem: PlanningProblem) -> bool:
    """Tell if the duration is a variable."""
    return problem.duration[1] > problem.duration[0]


def packed(stages: Stages, w: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the stages' variables, and the states (I, K, nx) at the nodes, of unknowns w.

    The torques' coefficients are those whose polynomials come nearest to w's at the nodes, put
    inside their bounds.
    """
    indices, cut = stages.indices, stages.cut
    intervals, K = stages.mesh.intervals, len(stages.rule.nodes)
    torques = w[indices.controls].reshape(intervals, K, -1)
    duration = w[:1] if is_free(stages.problem) else w[:0]
    parts: list[np.ndarray] = []
    for k, (a, b) in enumerate(zip(cut.first[:-1], cut.first[1:], strict=True)):
        basis = cut.basis[a:b].reshape(-1, cut.basis.shape[2])
        own = torques[a:b].reshape(len(basis), -1)
        controls = _inside(stages, np.linalg.lstsq(basis, own, rcond=None)[0])
        parts += [controls.ravel(), w[indices.states[a * K]] if k else w[:0], duration]
    parts += [np.zeros(_goal_rows(stages)), w[indices.states[-1]], duration]
    return np.concatenate(parts), w[indices.states[1:]].reshape(intervals, K, -1)


def unpacked(stages: Stages, variables: np.ndarray, nodes: dict[str, np.ndarray]) -> np.ndarray:
    """Return the unknowns w of the stages' variables.

    nodes: start (nx,), states (I, K, nx) and turn (I, K, 3), the angular velocity in units.
    """
    indices, cut, size = stages.indices, stages.cut, stages.cut.basis.shape[2]
    states, nu = nodes["states"].reshape(-1, indices.states.shape[1]), indices.controls.shape[1]
    free, nx = is_free(stages.problem), states.shape[1]
    w = np.zeros(indices.size)
    w[0] = variables[-1] if free else stages.problem.duration[1]
    w[indices.states[0]], w[indices.states[1:]] = nodes["start"], states

    # the coefficients of all stages; before those of stage k > 1 lie the states of k - 1
    own = size * nu + nx + free
    starts = np.arange(cut.stages) * own - nx * (np.arange(cut.stages) > 0)
    coefficients = variables[starts[:, None] + np.arange(size * nu)].reshape(-1, size, nu)
    stage = np.repeat(np.arange(cut.stages), np.diff(cut.first))
    torques = np.einsum("kic,kca->kia", cut.basis, coefficients[stage])
    turn = nodes["turn"].reshape(-1, 3)
    w[indices.others] = np.column_stack(
        [_drift(stages, states, turn), turn, torques.reshape(-1, nu)]
    )
    return w


def _goal_rows(stages: Stages) -> int:
    """Number of rows of the goal, each of which has a variable."""
    goal = stages.problem.goal
    given = [value for value in (goal.tail, goal.tail_rate, goal.torso_rate) if value is not None]
    rows = len(goal_matrix(goal.attitude, stages.attitude))
    return rows + sum(int(np.isfinite(value).sum()) for value in given)


def _inside(stages: Stages, coefficients: np.ndarray) -> np.ndarray:
    bound = stages.problem.bounds.torque
    if bound is None:
        return coefficients
    most = bound / stages.variables.units["torque"]
    return np.clip(coefficients, -most, most)


def _drift(stages: Stages, states: np.ndarray, turn: np.ndarray) -> np.ndarray:
    """Velocity (N, 3) of B relative to the centre of mass, in units: no linear momentum."""
    variables, units = stages.variables, stages.variables.units
    tail, rate = (
        states[:, columns_of(np.arange(states.shape[1])[None], variables.states, name)[0]]
        * units[name]
        for name in ("tail", "tail_rate")
    )
    q = np.column_stack([np.tile(IDENTITY_POSE, (len(tail), 1)), tail])
    H = stages.model.mass_matrix(q)
    rates = np.column_stack([turn * units["torso_rate"], rate])
    momentum = np.einsum("kij,kj->ki", H[:, VELOCITY, OMEGA.start :], rates)
    return -momentum / H[:, :1, 0] / units["drift"]
