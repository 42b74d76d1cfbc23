"""``Load``: forces from outside on the animal during a run."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from serpentail_scene.layout import PUSH_ON_TORSO

from ...basics.checks import finite_array, one_of, refusal, whole_number
from ...basics.errors import SimulationError
from ...basics.short_repr import brief
from ...model.model import Model
from ...model.state import Quantities
from .piecewise import Piecewise, checked_nodes, linear

FEET = 6  # points: A, M and T of the right foot, then of the left
POINTS = 'a pair of a chain or "feet" and a number, or on a free base "torso" or a place (x, y, z)'


@dataclass(frozen=True, eq=False)
class Load:
    """A force from outside, at a point of the animal: a push, a tether, wind.

    Parameters
    ----------
    point : str, array_like of shape (3,), or pair of str and int
        Where the force acts: "torso" for B; a place in the torso (m, torso axes, from B); or the
        name of a chain and the number of one of its points, from 0 at its root to -1 at its tip:
        ("tail", -1). The numbers of "feet" are 0 to 5: A, M and T of the right foot, then of the
        left.
    times : array_like, shape (K,)
        Two or more increasing times (s); before the first and after the last there is no force.
    force : array_like, shape (K, 3) or (3,)
        Force (N, world axes) at these times, linear between them; or one that does not change.

    Raises
    ------
    SimulationError
        Times or forces are wrong. Whether the model has the point, ``simulate`` checks.

    Examples
    --------
    >>> import serpentail as st
    >>> push = st.Load("torso", ["0.1 s", "101 ms"], [2, 0, 0])
    >>> push.force.shape
    (2, 3)
    """

    point: Any
    times: Quantities
    force: Quantities
    __repr__ = brief

    def __post_init__(self) -> None:
        """Check the nodes."""
        times = finite_array("Load: times", self.times, SimulationError, "s")
        if times.ndim != 1 or len(times) < 2:
            raise refusal("Load: times", self.times, "two or more times, in s", SimulationError)
        force = finite_array("Load: force", self.force, SimulationError, "N")
        if force.shape == (3,):
            force = np.tile(force, (len(times), 1))
        times, force = checked_nodes("Load", "force", (times, force), 3, "N")
        object.__setattr__(self, "times", times)
        object.__setattr__(self, "force", force)


def loads_of(model: Model, loads: Any) -> Piecewise | None:
    """Return forces from outside as the table that the C of a model reads, which gets this C if it
    lacks it; SimulationError if they do not match the model.
    """
    each = [loads] if isinstance(loads, Load) else [] if loads is None else loads
    if not isinstance(each, Sequence) or not all(isinstance(load, Load) for load in each):
        raise refusal("load", loads, "a Load, or a list of them", SimulationError)
    if not each:
        return None
    model.need("loads")
    curves = [linear(np.asarray(load.times), np.asarray(load.force)) for load in each]
    spreads = [_spread(model, load.point) for load in each]
    times = np.unique(np.concatenate([curve.times for curve in curves]))
    times = np.array([times[0] - 1.0, *times, times[-1] + 1.0])
    begins, table = times[:-1], np.zeros((len(times) - 1, len(spreads[0]), 2))
    for curve, spread in zip(curves, spreads, strict=True):
        acts = (begins >= curve.times[0]) & (begins < curve.times[-1])
        pieces = np.stack(curve.at(begins)[:2], axis=-1) * acts[:, None, None]
        table += np.einsum("kfp,cf->kcp", pieces, spread)
    return Piecewise(times, table)


def _spread(model: Model, point: Any) -> np.ndarray:
    """Return how the channels (n, 3) of a model's table follow from a force at a point."""
    groups = {c.name: range(c.points.start, c.points.stop) for c in model.layout.chains}
    points = model.layout.chains[-1].points.stop
    if "feet" in model.contacts:
        groups["feet"] = range(points, points + FEET)
        points += FEET
    spread, unit = np.zeros((PUSH_ON_TORSO + 3 * points, 3)), np.eye(3)
    if isinstance(point, tuple | list) and len(point) == 2:
        own = groups[one_of("Load: point", point[0], groups, SimulationError)]
        bounds = {"least": -len(own), "most": len(own) - 1}
        number = whole_number(f"Load: point of {point[0]}", point[1], SimulationError, **bounds)
        first = PUSH_ON_TORSO + 3 * own[number]
        spread[first : first + 3] = unit
        return spread
    place = np.zeros(3)
    if not isinstance(point, str) or point != "torso":
        place = finite_array("Load: point", point, SimulationError, "m")
    if place.shape != (3,) or model.fixed:
        raise refusal("Load: point", point, POINTS, SimulationError)
    spread[:3], spread[3:PUSH_ON_TORSO] = unit, np.kron(place[:, None], unit)
    return spread
