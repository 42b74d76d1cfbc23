"""Planning problems: what a user asks for goes in, checked field by field; a frozen PlanningProblem comes
out.
"""

from collections.abc import Callable
from dataclasses import dataclass, fields
from functools import partial

import numpy as np

from ..checks import choice, number, numbers
from ..errors import PlanningError
from .nlp.coordinates import KINDS
from .nlp.node import FORMULATIONS

OBJECTIVES = ("effort", "energy", "time")
# N m s: the effort counts a tail's rates as torques, or a plan whirls a light tail at no cost
SMOOTHING = 3e-4
SLACK = 1e-6  # rad, rad/s: how far a start may be beyond its bounds


@dataclass(frozen=True)
class Goal:
    """What holds at the end; None leaves a part free, and so does a None among the tail's numbers.

    attitude: "upright" (any yaw) or a quaternion (w, x, y, z), torso to world.  torso_rate (3,):
    rad/s in body axes.
    tail (2m,): rad.  tail_rate (2m,): rad/s.  turns (2,): whole turns of pitch and roll at an
    upright end, for the
    attitude "euler" alone; by default those nearest to the guess, as in Sect. 3.2.
    """

    attitude: object = "upright"
    torso_rate: object = (0.0, 0.0, 0.0)
    tail: object = None
    tail_rate: object = None
    turns: object = None


@dataclass(frozen=True)
class Bounds:
    """Largest magnitudes along the motion, each one number or one a tail coordinate; None: no
    bound.

    angle (rad), rate (rad/s), torque (N m), torque_rate (N m/s, from node to node).
    """

    angle: object = None
    rate: object = None
    torque: object = 0.02
    torque_rate: object = None


@dataclass(frozen=True, eq=False)
class PlanningProblem:
    """A checked problem: arrays have their shapes, values are finite, the start obeys its
    bounds.
    """

    q0: np.ndarray
    v0: np.ndarray
    goal: Goal
    duration: tuple[float, float]
    bounds: Bounds
    objective: str | Callable = "effort"
    smoothing: float = SMOOTHING
    damping: float = 0.0
    path: tuple[tuple[Callable, float, float], ...] = ()
    formulation: str = "airborne"
    attitude: str = "quaternion"


PROBLEM_SETTINGS = ("objective", "smoothing", "damping", "path", "formulation", "attitude")


def checked_problem(model, start, goal, duration, bounds, **settings) -> PlanningProblem:
    """Return the problem; PlanningError names the first field that is wrong, its value and the
    remedy.
    """
    q0, v0 = _start(model, start)
    goal, bounds = _goal(goal, q0.size - 7), _bounds(bounds, q0.size - 7)
    _start_inside(q0[7:], bounds.angle, "angle", "rad")
    _start_inside(v0[6:], bounds.rate, "rate", "rad/s")
    wrong = {"objective": _objective, "path": _path}
    wrong |= {name: partial(number, name, above=False) for name in ("smoothing", "damping")}
    for name, bound in (("tail", bounds.angle), ("tail_rate", bounds.rate)):
        _goal_inside(name, getattr(goal, name), bound)
    settings = {
        name: wrong.get(name, lambda value: value)(value) for name, value in settings.items()
    }
    choice("formulation", settings.get("formulation", "airborne"), FORMULATIONS)
    choice("attitude", settings.get("attitude", "quaternion"), KINDS)
    return PlanningProblem(q0, v0, goal, _duration(duration), bounds, **settings)


def _vector(field: str, value, size: int) -> np.ndarray:
    if np.ndim(value) == 0:
        raise PlanningError(f"{field}: value {value!r}: needs {size} numbers")
    return numbers(field, value, size)


def _start(model, start) -> tuple[np.ndarray, np.ndarray]:
    if not isinstance(start, tuple | list) or len(start) != 2:
        raise PlanningError(f"start: value {start!r}: needs (q0, v0), two arrays")
    q0, v0 = _vector("start[0]", start[0], model.nq), _vector("start[1]", start[1], model.nv)
    norm = np.linalg.norm(q0[3:7])
    if norm == 0:
        raise PlanningError("start[0][3:7]: the zero quaternion: upright is (1, 0, 0, 0)")
    q0[3:7] /= norm
    return q0, v0


def _goal(goal, size: int) -> Goal:
    if not isinstance(goal, Goal):
        raise PlanningError(f"goal: value {goal!r}: needs a serpentail.Goal")
    attitude = goal.attitude
    if (
        attitude is not None and attitude != "upright"
        if isinstance(attitude, str)
        else attitude is not None
    ):
        attitude = _vector("goal.attitude", attitude, 4)
        if np.linalg.norm(attitude) == 0:
            raise PlanningError("goal.attitude: the zero quaternion: upright is (1, 0, 0, 0)")
        attitude = attitude / np.linalg.norm(attitude)
    rate = None if goal.torso_rate is None else _vector("goal.torso_rate", goal.torso_rate, 3)
    tails = [_some(f"goal.{name}", getattr(goal, name), size) for name in ("tail", "tail_rate")]
    turns = None if goal.turns is None else np.round(_vector("goal.turns", goal.turns, 2))
    return Goal(attitude, rate, *tails, turns)


def _some(field: str, value, size: int) -> np.ndarray | None:
    """Return numbers (size,), nan where they are free; None where all are."""
    if value is None:
        return None
    try:
        array = np.array([np.nan if entry is None else float(entry) for entry in value])
        free = np.array([entry is None for entry in value])
    except (TypeError, ValueError):
        raise PlanningError(
            f"{field}: value {value!r}: needs {size} numbers, None where free"
        ) from None
    if array.shape != (size,) or not np.isfinite(array[~free]).all():
        raise PlanningError(
            f"{field}: value {value!r}: needs {size} finite numbers, None where free"
        )
    return array


def _bounds(bounds, size: int) -> Bounds:
    if not isinstance(bounds, Bounds):
        raise PlanningError(f"bounds: value {bounds!r}: needs a serpentail.Bounds")
    found = {}
    for field in fields(Bounds):
        value = getattr(bounds, field.name)
        found[field.name] = None if value is None else numbers(f"bounds.{field.name}", value, size)
        if value is not None and not (found[field.name] > 0).all():
            raise PlanningError(f"bounds.{field.name}: value {value!r}: needs magnitudes above 0")
    return Bounds(**found)


def _start_inside(values: np.ndarray, bound: np.ndarray | None, name: str, unit: str) -> None:
    if bound is None:
        return
    k = int(np.argmax(np.abs(values) - bound))
    if abs(values[k]) > bound[k] + SLACK:
        raise PlanningError(
            f"bounds.{name}: the start's tail coordinate {k} has {values[k]:.6g} {unit}, beyond "
            f"{bound[k]:.6g}: "
            "widen the bound, or start inside it"
        )


def _goal_inside(name: str, values: np.ndarray | None, bound: np.ndarray | None) -> None:
    if values is None or bound is None:
        return
    beyond = np.flatnonzero(np.abs(values) > bound)  # nan: free
    if beyond.size:
        k = beyond[0]
        raise PlanningError(
            f"goal.{name}: entry {k} is {values[k]:.6g}, beyond its bound {bound[k]:.6g}: change "
            "one"
        )


def _duration(duration) -> tuple[float, float]:
    pair = duration if isinstance(duration, tuple | list) else (duration, duration)
    if len(pair) != 2:
        raise PlanningError(
            f"duration: value {duration!r}: needs one number, or (least, most), in s"
        )
    least, most = (number("duration", value) for value in pair)
    if most < least:
        raise PlanningError(f"duration: value {duration!r}: needs least <= most, in s")
    return least, most


def _objective(objective):
    if not callable(objective):
        choice("objective", objective, OBJECTIVES)
    return objective


def _path(path) -> tuple:
    rows = []
    for k, row in enumerate(path):
        if not isinstance(row, tuple | list) or len(row) != 3 or not callable(row[0]):
            raise PlanningError(
                f"path[{k}]: value {row!r}: needs (function of a point, least, most)"
            )
        least, most = float(row[1]), float(row[2])
        if not least <= most:
            raise PlanningError(f"path[{k}]: bounds ({least}, {most}): needs least <= most")
        rows.append((row[0], least, most))
    return tuple(rows)
