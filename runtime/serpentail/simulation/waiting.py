"""Runs that wait to be made again from another start: of a short one most is not the motion but the
making of its records, which do not depend on the start.
"""

from dataclasses import replace
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import ArrayLike

from ..model.model import Model
from .runs.single import CompiledRun
from .controllers.controller import Controller, Damping
from .methods import SCIPY
from .controllers.schedules import Legs
from .start import checked_starts

MOST_RUNS = 4  # that wait, of a model
MOST_SAMPLES = 2_000  # of one: with more its records cost little, and its memory much
PLAIN = {float, int, str, type(None), np.float64, Legs}  # types whose equals mean the same
Asked = tuple[Any, ...]

# A run is taken out while it is made: no two threads have the same one.
_waiting: WeakKeyDictionary[Model, dict[Asked, CompiledRun]] = WeakKeyDictionary()


def asked_for(
    controller: Controller,
    t_span: ArrayLike,
    method: str,
    settings: dict[str, Any],
) -> Asked | None:
    """Return the key by which a run's records are found again; None if they are not kept.

    They are kept for runs without torque or with damping, the same legs, and plain numbers and
    names otherwise.
    """
    acting: tuple[Any, ...] = ()
    if type(controller) is Damping:
        acting = (controller.damping,)
    elif controller is not None:
        return None
    asked = (t_span, method, *settings, *settings.values(), *acting)
    return asked if all(map(_plain, asked)) and method not in SCIPY else None


def _plain(value: Any) -> bool:
    """Tell whether a value is a plain one, or some of them, or legs, which are equal to none but
    themselves.
    """
    kind = type(value)
    return kind in PLAIN or (kind is tuple and PLAIN.issuperset(map(type, value)))


def taken(
    model: Model, asked: Asked | None, state: tuple[ArrayLike, ArrayLike]
) -> CompiledRun | None:
    """Return a kept run for the same request, at its new start; None if there is none.

    StateError if the start is wrong, SimulationError if it is deep in the ground.
    """
    runs = None if asked is None else _waiting.get(model)
    if not runs or asked not in runs:
        return None
    q0, v0, many = checked_starts(model, state)
    run = None if many else runs.pop(asked, None)
    if run is None:
        return None
    start, parameters = replace(run.start, q0=q0, v0=v0), run.memory.parameters
    if run.ground.points:
        run.ground.refuse_deep(model, start, parameters)
    run.again(q0, v0)
    return run


def let_wait(model: Model, asked: Asked | None, run: CompiledRun) -> None:
    """Keep a run that came to its end for the next time, in place of the oldest."""
    if asked is None or run.start.intervals >= MOST_SAMPLES:
        return
    runs = _waiting.get(model)
    if runs is None:
        runs = _waiting.setdefault(model, {})
    for oldest in [*runs][: 1 - MOST_RUNS]:
        runs.pop(oldest, None)
    runs[asked] = run
