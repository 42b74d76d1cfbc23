"""Where the solver starts: a motion, such as passive flight or an earlier plan, put on a mesh."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from serpentail_scene.layout import QUATERNION, TAIL_Q, TAIL_V

from ...basics.attitude import sign_continuous
from ...basics.errors import SimulationError
from ...model.model import Model
from ...motion.trajectory import Trajectory
from ...optimal.mesh import TimeMesh
from ...optimal.samples import MeshSamples
from ...simulation.controllers.controller import TorqueTable
from ..air import drift_of_states, in_air
from ..flight import State, flight
from ..problem import PlanningProblem
from ..tendons import TENSION, of_motors, tensions_near
from .build import PlanProgram, conserved_at

ROUGH = 1e-4  # rtol of a guess, whose damping can be stiff
PUSH_SAMPLES = 33  # of a random push
PUSH_WAVES = 3  # sines that it sums


@dataclass(frozen=True, eq=False)
class GuessMotion:
    """A motion of a duration (s): at times (K,), s, blocks (K, size) in SI by name.

    start: its state; model: what moves; mesh: that of a motion that a program has found.
    """

    duration: float
    at: Callable[[np.ndarray], dict[str, np.ndarray]]
    start: State
    model: Model
    mesh: TimeMesh | None = None


def passive(
    model: Model, problem: PlanningProblem, damping: float, duration: float, push: np.ndarray
) -> GuessMotion:
    """Return the motion whose tail only damps (Eq. 47), the paper's guess (Sect. 3.2), and a push.

    push (n, 2m): torques, N m.  A flight that leaves the model's range serves until there.
    """
    times = np.linspace(0, duration, len(push))
    driven = np.array(model.layout.driven)
    law = TorqueTable(times, push * driven, max(damping, problem.damping) * driven)
    try:
        motion = flight(model, (problem.q0, problem.v0), law, duration, rtol=ROUGH)
    except SimulationError as error:
        if error.trajectory is None or len(error.trajectory.t) < 2:
            raise
        motion = error.trajectory
    return of_trajectory(model, motion, problem.damping)


def pushes(random: np.random.Generator, size: np.ndarray, model: Model) -> np.ndarray:
    """Return torques (33, 2m) of a few slow waves, of about a size (2m,), N m."""
    tail = model.layout.nt
    s = np.linspace(0, 1, PUSH_SAMPLES)[:, None, None]
    phases = random.uniform(0, 2 * np.pi, (PUSH_WAVES, tail))
    waves = np.sin(np.pi * s * np.arange(1, PUSH_WAVES + 1)[:, None] + phases)
    return size * (waves * random.normal(size=(PUSH_WAVES, tail))).sum(axis=1)


def of_trajectory(model: Model, motion: Trajectory, damping: float = 0.0) -> GuessMotion:
    """Return the motion of a trajectory; its torques without the part that damping gives."""
    tail_rate = motion.v[:, TAIL_V]
    samples = {
        "attitude": sign_continuous(motion.q[:, QUATERNION]),
        "tail": motion.q[:, TAIL_Q],
        "tail_rate": tail_rate,
        "torque": motion.tau + damping * tail_rate,
    }
    if model.layout.tendons:
        samples[TENSION] = tensions_near(model, samples["tail"], samples["torque"])
    if in_air(model):
        samples |= drift_of_states(model, motion.q, motion.v)
    t = motion.t - motion.t[0]

    def at(times: np.ndarray) -> dict[str, np.ndarray]:
        return {name: _linear(t, values, times) for name, values in samples.items()}

    return GuessMotion(t[-1], at, (motion.q[0], motion.v[0]), model)


def _linear(t: np.ndarray, values: np.ndarray, times: np.ndarray) -> np.ndarray:
    return np.column_stack([np.interp(times, t, column) for column in values.T])


def samples_of(motion: GuessMotion, program: PlanProgram) -> MeshSamples:
    """Return the motion, stretched to an allowed duration, at the points of a program's mesh."""
    variables, mesh, rule = program.variables, program.mesh, program.rule
    duration = float(np.clip(motion.duration, *program.problem.duration))
    times = mesh.points(rule) * motion.duration
    blocks = motion.at(times)
    states = np.column_stack([blocks[name] for name, _ in variables.states])
    if variables.torque_is_state:
        apart = np.diff(times)[:, None] * duration / motion.duration
        controls = np.diff(blocks["torque"], axis=0) / apart
    else:
        controls = blocks[variables.input][1:]
        if variables.input == "torque":
            controls = of_motors(program.model, controls)
    shape = (mesh.intervals, len(rule.nodes), -1)
    conserved = conserved_at(motion.model, motion.start)
    conserved["design"] = variables.design.of(motion.model.parameters)
    conserved["duration"] = np.array([duration])
    constants = np.concatenate([conserved[name] for name, _ in variables.constants])
    return MeshSamples(
        states / variables.scale(variables.states),
        (controls / variables.scale(variables.controls)).reshape(shape),
        constants / variables.scale(variables.constants),
    )
