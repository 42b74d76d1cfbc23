"""``settle``: lets a model come to rest on the ground, as a start for other runs."""

from __future__ import annotations

from typing import Any, Unpack

import numpy as np
from numpy.typing import ArrayLike

from ..basics.checks import number, numbers_in, refusal, whole_number
from ..basics.errors import SimulationError, StateError
from ..model.model import Model
from ..model.state import Quantity, State
from ..motion.trajectory import Trajectory
from .controllers.schedules import Legs
from .settings import RunSettings
from .simulate import simulate

MOST_ROUNDS = 100


def settle(
    model: Model,
    q0: ArrayLike | State,
    *,
    rounds: int = 1,
    duration: Quantity = 1.5,
    at: Quantity = 0.0,
    **settings: Unpack[RunSettings],
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Simulate a model on the ground until it is at rest; return that state.

    Parameters
    ----------
    model : Model
        A model with contacts.
    q0 : array_like, shape (nq,), or State
        Configuration at the start, without velocity.
    rounds : int, default 1
        Number of runs, at most 100. All velocities are set to zero after each run, so many short
        runs damp the motion faster.
    duration : float or str, default 1.5
        Duration of a run (s).
    at : float or str, default 0
        Time (s) at which the later motion begins. Controller and legs act as before this time,
        where schedules hold their first values.
    **settings
        Other arguments of ``simulate``, such as ``controller`` and ``legs``.

    Returns
    -------
    q : ndarray, shape (nq,)
        Configuration at rest.
    v : ndarray, shape (nv,)
        Zeros.
    bristles : ndarray, shape (points, 2)
        Stretch of the friction springs (m), for ``bristles0`` of ``simulate``.

    Raises
    ------
    StateError
        ``q0`` is not a single configuration.
    SimulationError
        A setting is wrong, the model has no contacts, or as of ``simulate``.
    ModelError
        The base is fixed, or the scene left a function out.
    """
    model.refuse_fixed("settle")
    if isinstance(q0, State):
        refuse_moving("q0", q0)
        q0 = q0.q
    start = numbers_in(q0)
    if start is None or start.ndim != 1:
        needs = f"one configuration ({model.nq},): settle one start state after another"
        raise refusal("q0", q0, needs, StateError)
    duration = check_settling(model, rounds, duration)
    at = number("at", at, SimulationError, unit="s")
    q, v = start, np.zeros(model.nv)
    given: dict[str, Any] = {"output_step": duration, "t_span": (at - duration, at), **settings}
    if isinstance(given.get("legs"), Legs):
        given["legs"] = given["legs"].before_landing()
    bristles = given.pop("bristles0", None)
    for _ in range(rounds):
        motion = simulate(model, q, v, bristles0=bristles, **given)
        assert isinstance(motion, Trajectory) and motion.contact is not None  # one start, on ground
        q, bristles = motion.q[-1], motion.contact.bristles[-1]
    return q, v, bristles


def check_settling(model: Model, rounds: object = 1, duration: object = 1.5) -> float:
    """Return the duration (s); SimulationError if a model cannot settle, or a number is wrong."""
    seconds = number("duration", duration, SimulationError, unit="s", above=0)
    whole_number("rounds", rounds, SimulationError, least=1, most=MOST_ROUNDS)
    if not model.contacts:
        raise SimulationError(
            f"{model.name} has no contacts, so it cannot settle: add `contacts` to its scene"
        )
    return seconds


def refuse_moving(field: str, start: State) -> None:
    """SimulationError for a start that settles and has a velocity."""
    if start.v.any():
        raise SimulationError(
            f"{field}: a start that settles has no velocity, no spin and no bend_rate: remove them"
        )
