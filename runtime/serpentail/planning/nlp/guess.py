"""Guesses: a motion (passive, planned before, or on a coarser mesh) goes in; where the solver
starts comes out.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ...attitude import rotation_matrix
from .transcription import Transcription


@dataclass(frozen=True, eq=False)
class Motion:
    """A motion at times of one's choice: t (K,) s -> blocks (K, size) in SI by name; its duration
    in s.
    """

    duration: float
    at: Callable[[np.ndarray], dict[str, np.ndarray]]


def passive(model, problem, coordinates, damping: float, duration: float, push=None) -> Motion:
    """Return the motion whose tail only damps (Eq. 47), the paper's guess (Sect. 3.2), pushed by
    torques (n, 2m).
    """
    from ...simulation.controllers import TorqueTable
    from ...simulation.simulate import simulate

    push = np.zeros((1, model.nv - 6)) if push is None else push
    law = TorqueTable(np.linspace(0, duration, len(push)), push, max(damping, problem.damping))
    flight = simulate(model, problem.q0, problem.v0, controller=law, t_span=duration)
    return of_trajectory(model, flight, coordinates, problem.damping)


def pushes(random: np.random.Generator, size: float, tail: int) -> np.ndarray:
    """Return torques (33, 2m) of a few slow waves, of about a size (N m)."""
    s = np.linspace(0, 1, 33)[:, None, None]
    waves = np.sin(np.pi * s * np.arange(1, 4)[:, None] + random.uniform(0, 2 * np.pi, (3, tail)))
    return size * (waves * random.normal(size=(3, tail))).sum(axis=1)


def of_trajectory(model, flight, coordinates, damping: float = 0.0) -> Motion:
    """Return the motion of a trajectory; what damping gives is taken off its torques."""
    mass = model.parameters["torso_mass"] + model.parameters["tail_mass"]
    drift = np.einsum(
        "kji,kj->ki",
        rotation_matrix(flight.attitude),
        flight.v[:, :3] - flight.linear_momentum / mass,
    )
    torque = flight.tau + damping * flight.v[:, 6:]
    rows = {
        "position": flight.q[:, :3],
        "attitude": coordinates.coordinates(flight.q),
        "tail": flight.q[:, 7:],
    }
    rows |= {
        "velocity": flight.v[:, :3],
        "torso_rate": flight.v[:, 3:6],
        "tail_rate": flight.v[:, 6:],
    }
    rows |= {"drift": drift, "torque": torque}
    t = flight.t - flight.t[0]

    def at(times: np.ndarray) -> dict[str, np.ndarray]:
        return {name: _linear(t, values, times) for name, values in rows.items()}

    return Motion(t[-1], at)


def _linear(t: np.ndarray, values: np.ndarray, times: np.ndarray) -> np.ndarray:
    return np.column_stack([np.interp(times, t, column) for column in values.T])


def unknowns(motion: Motion, program: Transcription, duration: float) -> np.ndarray:
    """Return w: the motion, stretched to a duration, at the points of a mesh."""
    form, where = program.form, program.places
    blocks = motion.at(program.fractions * motion.duration)
    w = np.zeros(where.size)
    w[0] = duration
    w[where.states] = np.column_stack([blocks[name] / form.units[name] for name, _ in form.states])
    others = [
        blocks[name][where.first :] / form.units[name]
        for name in (*(n for n, _ in form.algebraic), "torque")
    ]
    w[where.others] = np.column_stack(others)
    return w
