"""Settling: a model and a state go in; the state of rest that it comes to on the ground comes
out.
"""

import numpy as np

from ..checks import number
from ..errors import SimulationError, StateError
from .controllers import Controller
from .simulate import simulate


def settle(
    model,
    q0,
    *,
    rounds: int = 1,
    duration: float = 1.5,
    controller: Controller = None,
    at: float = 0.0,
    **settings,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return q (nq,), v (nv,) = 0 and the friction springs' stretch (points, 2) in m after coming
    to rest from q0.

    rounds: runs of ``duration`` s, after each of which all velocities are set to zero; many short
    ones quench.
    Controller and legs act as they do before the time ``at`` (s), where schedules hold their first
    values.
    settings: those of ``simulate``, such as legs.  Raises what it raises.
    """
    if np.ndim(q0) != 1:
        raise StateError(
            f"q0 has shape {np.shape(q0)}, not ({model.nq},): settle one start state after another"
        )
    number("duration", duration, SimulationError, above=0)
    if isinstance(rounds, bool) or not isinstance(rounds, int) or rounds < 1:
        raise SimulationError(f"rounds: value {rounds!r}: needs a whole number from 1")
    if not model.contacts:
        raise SimulationError(
            f"{model.name} touches nothing, so it cannot settle: add `contacts` to its scene"
        )
    still, v = {}, np.zeros(model.nv)
    settings = {
        "output_step": duration,
        "controller": controller,
        "t_span": (at - duration, at),
    } | settings
    for _ in range(rounds):
        end = simulate(model, q0, v, **settings | still)
        q0, still = end.q[-1], {"bristles0": end.contact.bristles[-1]}
    return q0, v, still["bristles0"]
