"""Lets a model come to rest on the ground, where other runs then start."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..checks import number, refusal
from ..errors import SimulationError, StateError
from ..model.model import Model
from ..motion.trajectory import Trajectory
from .controllers import Controller
from .simulate import simulate


def settle(
    model: Model,
    q0: ArrayLike,
    *,
    rounds: int = 1,
    duration: float = 1.5,
    controller: Controller = None,
    at: float = 0.0,
    **settings: Any,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return q (nq,), v (nv,) = 0 and the friction springs' stretch (points, 2) in m, at rest.

    q0 (nq,): where it starts, without velocity.  rounds: runs of ``duration`` s, after each of
    which all velocities are set to zero; many short ones quench.  Controller and legs act as they
    do before the time ``at`` (s), where schedules hold their first values.  settings: those of
    ``simulate``, such as legs.  Raises what it raises.
    """
    model.refuse_fixed("settle")
    if np.ndim(q0) != 1:
        raise StateError(
            f"q0 has shape {np.shape(q0)}, not ({model.nq},): settle one start state after another"
        )
    check_settling(model, rounds, duration)
    q, v = np.asarray(q0), np.zeros(model.nv)
    bristles = settings.pop("bristles0", None)
    span: dict[str, Any] = {"output_step": duration, "t_span": (at - duration, at)}
    for _ in range(rounds):
        motion = simulate(model, q, v, controller=controller, bristles0=bristles, **span | settings)
        assert isinstance(motion, Trajectory) and motion.contact is not None  # one start, on ground
        q, bristles = motion.q[-1], motion.contact.bristles[-1]
    return q, v, bristles


def check_settling(model: Model, rounds: object = 1, duration: object = 1.5) -> None:
    """SimulationError where a model cannot come to rest in so many rounds."""
    number("duration", duration, SimulationError, above=0)
    if isinstance(rounds, bool) or not isinstance(rounds, int) or rounds < 1:
        raise refusal("rounds", rounds, "a whole number from 1", SimulationError)
    if not model.contacts:
        raise SimulationError(
            f"{model.name} touches nothing, so it cannot settle: add `contacts` to its scene"
        )
