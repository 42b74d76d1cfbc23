"""Path constraints of a plan, and its clearance above the ground."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..basics.checks import number, numbers_in, refusal, shown
from ..basics.errors import PlanningError
from ..model.model import Model
from .goal import Bounds
from .program.point import any_legs, body_heights

PathConstraint = tuple[Callable[[Any], Any], float, float]  # function of a point, least, most


@dataclass(frozen=True)
class MotorShare:
    """What plans use of motors: a share of each one's power, or of torque and speed together."""

    torque: tuple[float, ...]
    speed: tuple[float, ...] = ()
    power: tuple[float, ...] = ()

    def __call__(self, point: Any) -> Any:
        """Return tau q_dot / P, else tau / T + q_dot / w, of all motors (2m,)."""
        if self.power:
            return point.torque * point.tail_rate / self.power
        return point.torque / self.torque + point.tail_rate / self.speed


def motor_rows(bounds: Bounds) -> tuple[PathConstraint, ...]:
    """Return the path constraints of checked bounds of speed and power."""
    rows: list[PathConstraint] = []
    if bounds.speed is not None:
        rows.append((MotorShare(tuple(bounds.torque), speed=tuple(bounds.speed)), -1.0, 1.0))
    if bounds.power is not None:
        rows.append((MotorShare((), power=tuple(bounds.power)), -np.inf, 1.0))
    return tuple(rows)


def checked_path(path: Any) -> tuple[PathConstraint, ...]:
    """Return checked rows of path constraints."""
    if not isinstance(path, tuple | list):
        needs = "rows (function of a point, least, most)"
        raise refusal("path", path, needs, PlanningError)
    constraints = []
    for k, row in enumerate(path):
        if not isinstance(row, tuple | list) or len(row) != 3 or not callable(row[0]):
            raise PlanningError(
                f"path[{k}]: value {shown(row)}: needs (function of a point, least, most)"
            )
        bounds = numbers_in(row[1:])
        if bounds is None or bounds.shape != (2,):
            raise PlanningError(f"path[{k}]: bounds {shown(row[1:])}: needs two numbers")
        least, most = bounds.tolist()
        if not least <= most:
            raise PlanningError(f"path[{k}]: bounds ({least}, {most}): needs least <= most")
        constraints.append((row[0], least, most))
    return tuple(constraints)


def checked_clearance(value: Any) -> float | None:
    """Return a clearance (m), or None."""
    return None if value is None else number("clearance", value, PlanningError, unit="m", least=0)


def clear_of_ground(
    model: Model, start: tuple[Any, Any] | None, clearance: float
) -> PathConstraint:
    """Return the constraint that keeps the points of tail and torso at least so high (m).

    PlanningError if these have no contact points, or a point is too low at a start that is known.
    """
    if not set(model.contacts) - {"feet"}:
        remedy = "add 'tail' or 'torso' to its scene's contacts, or leave it out"
        raise PlanningError(
            f"clearance: {model.name} has no points of tail or torso that touch: {remedy}"
        )
    if start is None:
        return body_heights, clearance, np.inf
    points, _ = model.contact_points(*start, *any_legs(model))
    lowest = points[model.contacts.get("feet", 0) :, 2].min()
    if lowest < clearance:
        raise PlanningError(
            f"clearance: value {clearance:.6g}: at the start the lowest point of tail and torso is "
            f"at {lowest:.3g} m: begin later, or give less"
        )
    return body_heights, clearance, np.inf
