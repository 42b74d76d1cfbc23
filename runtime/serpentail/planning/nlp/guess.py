"""Where the solver starts: a motion, such as passive flight or an earlier plan, put on a mesh."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from serpentail_scene.layout import OMEGA, POSITION, TAIL_Q, TAIL_V, VELOCITY

from ...basics.attitude import rotation_matrix
from ...basics.errors import SimulationError
from ...model.model import Model
from ...model.parameters import total_mass
from ...motion.trajectory import Trajectory
from ...simulation.controllers.controller import TorqueTable
from ..flight import State, flight
from ..free_start import part_of
from ..problem import PlanningProblem
from .coordinates import Attitude, attitude
from .program import NonlinearProgram
from .start import StartRows
from .transcription import Transcription

ROUGH = 1e-4  # rtol of a guess, whose damping can be stiff
PUSH_SAMPLES = 33  # of a random push
PUSH_WAVES = 3  # sines that it sums


@dataclass(frozen=True, eq=False)
class GuessMotion:
    """A motion of a duration (s): at times (K,), s, blocks (K, size) in SI by name.

    start: its state; parameters: of the model that moves.
    """

    duration: float
    at: Callable[[np.ndarray], dict[str, np.ndarray]]
    start: State
    parameters: Mapping[str, Any]


def passive(
    model: Model, problem: PlanningProblem, damping: float, duration: float, push: np.ndarray
) -> GuessMotion:
    """Return the motion whose tail only damps (Eq. 47), the paper's guess (Sect. 3.2), and a push.

    push (n, 2m): torques, N m.  A flight that leaves the model's range serves until there.
    """
    times = np.linspace(0, duration, len(push))
    law = TorqueTable(times, push, max(damping, problem.damping))
    try:
        motion = flight(model, (problem.q0, problem.v0), law, duration, rtol=ROUGH)
    except SimulationError as error:
        if error.trajectory is None or len(error.trajectory.t) < 2:
            raise
        motion = error.trajectory
    return of_trajectory(model, motion, attitude(problem.attitude), problem.damping)


def pushes(random: np.random.Generator, size: float, model: Model) -> np.ndarray:
    """Return torques (33, 2m) of a few slow waves, of about a size (N m)."""
    tail = model.layout.nt
    s = np.linspace(0, 1, PUSH_SAMPLES)[:, None, None]
    phases = random.uniform(0, 2 * np.pi, (PUSH_WAVES, tail))
    waves = np.sin(np.pi * s * np.arange(1, PUSH_WAVES + 1)[:, None] + phases)
    return size * (waves * random.normal(size=(PUSH_WAVES, tail))).sum(axis=1)


def of_trajectory(
    model: Model, motion: Trajectory, coordinates: Attitude, damping: float = 0.0
) -> GuessMotion:
    """Return the motion of a trajectory; its torques without the part that damping gives."""
    mass = total_mass(model.parameters)
    R, velocity, tail_rate = (
        rotation_matrix(motion.attitude),
        motion.v[:, VELOCITY],
        motion.v[:, TAIL_V],
    )
    samples = {
        "position": motion.q[:, POSITION],
        "attitude": coordinates.coordinates(motion.q),
        "tail": motion.q[:, TAIL_Q],
        "velocity": velocity,
        "torso_rate": motion.v[:, OMEGA],
        "tail_rate": tail_rate,
        "drift": np.einsum("kji,kj->ki", R, velocity - motion.linear_momentum / mass),
        "torque": motion.tau + damping * tail_rate,
    }
    t = motion.t - motion.t[0]

    def at(times: np.ndarray) -> dict[str, np.ndarray]:
        return {name: _linear(t, values, times) for name, values in samples.items()}

    return GuessMotion(t[-1], at, (motion.q[0], motion.v[0]), model.parameters)


def _linear(t: np.ndarray, values: np.ndarray, times: np.ndarray) -> np.ndarray:
    return np.column_stack([np.interp(times, t, column) for column in values.T])


def unknowns(motion: GuessMotion, nlp: NonlinearProgram, duration: float) -> np.ndarray:
    """Return w: the motion, stretched to a duration (s), at the points of a mesh."""
    variables, indices = nlp.variables, nlp.indices
    blocks = motion.at(nlp.fractions * motion.duration)
    states = [blocks[name] / variables.units[name] for name, _ in variables.states]
    others = [
        blocks[name][indices.first :] / variables.units[name]
        for name, _ in (*variables.algebraic, ("torque", 0))
    ]

    w = np.zeros(indices.size)
    w[0] = duration
    w[indices.states] = np.column_stack(states)
    w[indices.others] = np.column_stack(others)
    if isinstance(nlp, Transcription) and nlp.node.start is not None:
        _fill_shared(w, nlp, nlp.node.start, motion)
    return w


def _fill_shared(w: np.ndarray, nlp: Transcription, rows: StartRows, motion: GuessMotion) -> None:
    """Set the unknowns that all nodes share, and those of the start alone."""
    variables, indices, design = nlp.variables, nlp.indices, nlp.variables.design
    parts = [part_of(motion.start, name) for name, _ in variables.at_start]
    scale = variables.scale(variables.at_start)
    w[indices.at_start] = np.concatenate([np.zeros(0), *parts]) / scale
    w[indices.common[: design.size]] = design.of(motion.parameters) / design.units
    conserved = np.array(rows.conserved(w[rows.unknowns])).ravel()
    w[indices.common[design.size :]] = conserved[: indices.common.size - design.size]
