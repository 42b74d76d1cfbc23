"""Parts of a plan's start that the planner chooses, within ranges."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from serpentail_scene.layout import OMEGA, POSITION, QUATERNION, TAIL_Q, TAIL_V, VELOCITY

from ..basics.attitude import from_angles, pitch_roll_yaw
from ..basics.checks import none_of, numbers, refusal
from ..basics.errors import PlanningError
from ..model.model import Model
from ..model.passive import behind_stops
from .goal import Bounds

State = tuple[np.ndarray, np.ndarray]  # q, v
Range = tuple[np.ndarray, np.ndarray]  # least, most
NEEDS = "a mapping of parts of the start, such as {'tail': (-0.5, 0.5)}"
# part -> place in the state: 0 is q and 1 is v; the attitude's angles are apart
PARTS: dict[str, tuple[int, slice]] = {
    "position": (0, POSITION),
    "attitude": (0, QUATERNION),
    "tail": (0, TAIL_Q),
    "velocity": (1, VELOCITY),
    "torso_rate": (1, OMEGA),
    "tail_rate": (1, TAIL_V),
}


def checked_free_start(model: Model, value: Any) -> dict[str, Range]:
    """Return the ranges of parts, SI; the attitude's are those of pitch, roll and yaw."""
    if value is None:
        return {}
    if not isinstance(value, Mapping):
        raise refusal("free_start", value, NEEDS, PlanningError)
    ranges = {}
    for name, pair in value.items():
        unknown = none_of("free_start: part", name, PARTS)
        if unknown:
            raise PlanningError(unknown)
        ranges[name] = _range(name, pair, model.layout.nt if name.startswith("tail") else 3)
    for angles in ranges.get("tail", ()):
        behind = behind_stops(model, angles[None])
        if behind:
            raise PlanningError(
                f"free_start.tail: {behind}: give one between the stops, or move them"
            )
    return ranges


def _range(name: str, pair: Any, size: int) -> Range:
    field = f"free_start.{name}"
    if not isinstance(pair, tuple | list | np.ndarray) or len(pair) != 2:
        raise refusal(field, pair, "(least, most)", PlanningError)
    least, most = (numbers(field, each, size, PlanningError) for each in pair)
    if (least > most).any() or (least == most).all():
        raise refusal(field, pair, "least below most", PlanningError)
    return least, most


def moved_inside(start: State, ranges: Mapping[str, Range]) -> State:
    """Return a start whose free parts are moved into their ranges."""
    parts = {name: np.clip(part_of(start, name), *ranges[name]) for name in ranges}
    return with_parts(start, parts)


def part_of(start: State, name: str) -> np.ndarray:
    """Return a part of a start; of the attitude, pitch, roll and yaw (rad)."""
    if name == "attitude":
        return pitch_roll_yaw(start[0])
    which, place = PARTS[name]
    return start[which][place]


def with_parts(start: State, parts: Mapping[str, np.ndarray]) -> State:
    """Return a start with other parts, those of ``part_of``."""
    state = start[0].copy(), start[1].copy()
    for name, value in parts.items():
        which, place = PARTS[name]
        state[which][place] = from_angles(value) if name == "attitude" else value
    return state


def within_bounds(ranges: Mapping[str, Range], bounds: Bounds) -> dict[str, Range]:
    """Return the ranges without what is beyond the bounds along the plan."""
    found = dict(ranges)
    for name, bound in (("tail", bounds.angle), ("tail_rate", bounds.rate)):
        if name in found and bound is not None:
            found[name] = np.maximum(found[name][0], -bound), np.minimum(found[name][1], bound)
    return found
