"""``gradient``: a number that depends on the end of a simulation, and its gradient."""

from collections.abc import Callable
from typing import Any, Unpack

import numpy as np

from ...basics.errors import SimulationError
from ...model.model import Model
from ...model.state import SPAN, Quantity, Span
from ..settings import RunSettings
from ..simulate import simulate
from .gradient import Gradient

STEP = 1e-6  # of central differences of a loss, over the size of what it is moved by


def gradient(
    model: Model,
    loss: Callable[[np.ndarray, np.ndarray], float],
    q0: Any,
    v0: Quantity | None = None,
    t_span: Span = SPAN,
    **settings: Unpack[RunSettings],
) -> tuple[float, Gradient]:
    """Simulate a motion, and return a number that depends on its end, with its gradient.

    Parameters
    ----------
    model : Model
        The model.
    loss : callable
        Function of q (nq,) and v (nv,) at the end that returns a number. Its own derivative is
        taken by central differences.
    q0, v0, t_span, **settings
        As of ``simulate``, with one start.

    Returns
    -------
    value : float
        The loss.
    gradient : Gradient
        Its gradient by start, parameters, damping, torques and legs; see ``Trajectory.vjp``.

    Raises
    ------
    SimulationError, StateError
        As of ``simulate`` and ``Trajectory.vjp``; or the loss is no finite number.

    Examples
    --------
    >>> height = lambda q, v: q[2]
    >>> value, by = st.gradient(model, height, q0, v0, 0.05, legs=legs)  # doctest: +SKIP
    >>> by.v0[2], by.by("mu")  # doctest: +SKIP
    """
    motion = simulate(model, q0, v0, t_span, **settings)
    q, v = motion.q[-1], motion.v[-1]
    weights = np.zeros((2, model.nv))
    for k, row in enumerate(np.eye(model.nv)):
        step = STEP * max(1.0, abs(v[k]))
        turned = [_number(loss, model.integrate(q, row, h), v) for h in (STEP, -STEP)]
        moved = [_number(loss, q, v + h * row) for h in (step, -step)]
        weights[:, k] = (turned[0] - turned[1]) / (2 * STEP), (moved[0] - moved[1]) / (2 * step)
    return _number(loss, q, v), motion.vjp(*weights)


def _number(loss: Callable[[np.ndarray, np.ndarray], float], q: Any, v: np.ndarray) -> float:
    """Return what a loss gives; SimulationError if that is no finite number."""
    found = loss(np.array(q), np.array(v))
    if not np.isfinite(found):
        raise SimulationError(f"loss: value {found!r:.80}: needs a finite number")
    return float(found)
