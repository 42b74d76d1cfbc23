"""A planning problem, checked field by field before anything is derived."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np

from serpentail_scene.layout import QUATERNION, TAIL_Q, Layout

from ..basics.checks import Refusals, number, numbers_in, one_of, refusal, refuse_not_finite, shown
from ..basics.errors import PlanningError
from ..basics.short_repr import brief
from ..model.chains import refuse_several
from ..model.model import Model
from ..model.passive import behind_stops
from ..model.state import State
from ..simulation.controllers.schedules import Legs
from .design import Design, checked_design, with_totals
from .free_start import Range, checked_free_start, moved_inside, within_bounds
from .goal import GOALS, Bounds, Goal
from .magnitudes import HUGE, checked_bounds, checked_duration
from .named import numbers_by_name
from .paths import PathConstraint, checked_clearance, checked_path, clear_of_ground, motor_rows

OBJECTIVES = ("effort", "energy", "time")
# N m s: the effort counts a tail's rates as torques, or a plan whirls a light tail at no cost
SMOOTHING = 3e-4
OF_ONE_TAIL = ("design", "design_totals", "free_start", "clearance", "legs")
START_SLACK = 1e-6  # rad, rad/s: how far a start may be beyond its bounds


@dataclass(frozen=True, eq=False)
class PlanningProblem:
    """A checked problem: arrays have their shapes, values are finite, bounds hold at the start."""

    q0: np.ndarray
    v0: np.ndarray
    goal: Goal
    duration: tuple[float, float]
    bounds: Bounds
    objective: str | Callable[[Any], Any]
    smoothing: float
    damping: float
    path: tuple[PathConstraint, ...]  # including that of the clearance
    clearance: float | None
    legs: Legs | None
    design: Design = field(default_factory=Design)
    free_start: Mapping[str, Range] = field(default_factory=dict)  # q0, v0 are then the guess's
    __repr__ = brief

    @property
    def is_free(self) -> bool:
        """Tell if parameters or parts of the start are unknowns."""
        return bool(self.design.size or self.free_start)

    @property
    def rows(self) -> tuple[PathConstraint, ...]:
        """The path constraints and what the motors can do."""
        return (*self.path, *motor_rows(self.bounds))


def checked_problem(
    model: Model, task: tuple[Any, Any, Any, Any], settings: dict[str, Any], refused: Refusals
) -> PlanningProblem | None:
    """Return the problem of (start, goal, duration, bounds) and settings; None if it is refused.

    ``refused`` collects each field that is wrong, its value and the remedy.
    """
    # start, goal and bounds, and whether the bounds allow start and goal
    attempt, settings = refused.attempt, dict(settings)
    _refuse_of_several(model, settings, refused)
    free = settings.pop("free_start", None)
    design = attempt("design", checked_design, model, settings.pop("design", None))
    totals = settings.pop("design_totals", None)
    if design is not None:
        design = attempt("design_totals", with_totals, model, design, totals)
    free = attempt("free_start", checked_free_start, model, free)
    start = attempt("start", _start, model, task[0])
    if start is not None and free is not None:
        start = moved_inside(start, free)
    goal = attempt("goal", checked_goal, task[1], model.layout)
    duration, bounds = (
        attempt("duration", checked_duration, model, task[2]),
        attempt("bounds", checked_bounds, model, task[3]),
    )
    usual = isinstance(task[3], Bounds) and isinstance(task[3].angle, str)
    if usual and start is not None and bounds is not None and goal is not None:
        bounds = _as_far_as(bounds, start[0][TAIL_Q], goal.tail, (free or {}).get("tail"))
    if start is not None and bounds is not None:
        attempt("bounds.angle", _start_inside, model, start[0], bounds.angle, "angle")
        attempt("bounds.rate", _start_inside, model, start[1], bounds.rate, "rate")
    if start is not None:
        attempt("start", _between_stops, "start", model, start[0][TAIL_Q])
    if goal is not None and goal.tail is not None:
        attempt("goal.tail", _between_stops, "goal.tail", model, goal.tail)
    if goal is not None and bounds is not None:
        attempt("goal.tail", _goal_inside, "tail", goal.tail, bounds.angle)
        attempt("goal.tail_rate", _goal_inside, "tail_rate", goal.tail_rate, bounds.rate)

    # settings
    checked: dict[str, Any] = {
        name: attempt(name, SETTINGS[name], value) for name, value in settings.items()
    }
    attempt("drive", _refuse_on_passive, model, bounds, checked["damping"])
    if checked["clearance"] is not None and start is not None:
        known = None if design is None or design.size or free else start
        row = attempt("clearance", clear_of_ground, model, known, checked["clearance"])
        checked["path"] = (*(checked["path"] or ()), row)
    if refused.lines or start is None or goal is None or duration is None or bounds is None:
        return None
    assert design is not None and free is not None  # else they are refused
    checked |= {"design": design, "free_start": within_bounds(free, bounds)}
    return PlanningProblem(*start, goal, duration, bounds, **checked)


def _vector(field: str, value: Any, size: int) -> np.ndarray:
    """Return a copy of finite numbers (size,); PlanningError otherwise."""
    array = numbers_in(value)
    if array is None or array.shape != (size,):
        raise refusal(field, value, f"{size} numbers", PlanningError)
    refuse_not_finite(field, array, PlanningError)
    return array.copy()


def _unit_quaternion(field: str, quaternion: np.ndarray) -> np.ndarray:
    """Return the quaternion with norm 1; PlanningError if it is zero."""
    largest = np.abs(quaternion).max()
    if largest == 0:
        raise PlanningError(f"{field}: the zero quaternion: upright is (1, 0, 0, 0)")
    if not 1 / HUGE < largest < HUGE:  # whose squares are no numbers, or 0
        quaternion = quaternion / largest
    return quaternion / np.linalg.norm(quaternion)


def _start(model: Model, start: Any) -> tuple[np.ndarray, np.ndarray]:
    start = tuple(start) if isinstance(start, State) else start
    if not isinstance(start, tuple | list) or len(start) != 2:
        raise PlanningError(f"start: value {shown(start)}: needs (q0, v0), two arrays, or a state")
    q0, v0 = _vector("start[0]", start[0], model.nq), _vector("start[1]", start[1], model.nv)
    q0[QUATERNION] = _unit_quaternion("start[0][3:7]", q0[QUATERNION])
    return q0, v0


def checked_goal(goal: Any, layout: Layout) -> Goal:
    """Return a goal with arrays for 2m tail coordinates; None means upright and at rest."""
    if goal is None:
        goal = Goal()
    if isinstance(goal, str):
        goal = GOALS[one_of("goal", goal, GOALS, PlanningError)]
    if not isinstance(goal, Goal):
        raise PlanningError(f"goal: value {shown(goal)}: needs a serpentail.Goal")
    attitude = goal.attitude
    upright = isinstance(attitude, str) and attitude == "upright"
    if attitude is not None and not upright:
        quaternion = _vector("goal.attitude", attitude, 4)
        attitude = _unit_quaternion("goal.attitude", quaternion)
    return Goal(
        attitude,
        None if goal.torso_rate is None else _rates("goal.torso_rate", goal.torso_rate),
        _of_coordinates("tail", goal.tail, "chains", goal.chains, layout),
        _of_coordinates("tail_rate", goal.tail_rate, "chain_rates", goal.chain_rates, layout),
    )


def _of_coordinates(
    name: str, value: Any, by_name: str, named: Any, layout: Layout
) -> np.ndarray | None:
    """Return numbers (2m,) of a goal, nan for free ones; None if all are free.

    value: of all coordinates; named: by the names of chains, in its place.
    """
    if named is None:
        return None if value is None else _partly_free(f"goal.{name}", value, layout.nt)
    if not isinstance(named, Mapping) or value is not None:
        needs = f"a mapping from names of chains, and no goal.{name} beside it"
        raise refusal(f"goal.{by_name}", named, needs, PlanningError)

    def read(field: str, given: Any, size: int) -> np.ndarray:
        return _partly_free(field, given if np.ndim(given) else [given] * size, size)

    free = np.full(layout.nt, np.nan)
    return numbers_by_name(f"goal.{by_name}", layout, named, free, read)


def _rates(field: str, value: Any) -> np.ndarray:
    """Return numbers (3,), or least and most (2, 3) if one of them is a range."""
    entries = value if isinstance(value, tuple | list) or np.ndim(value) else []
    if not any(np.ndim(entry) for entry in entries):
        return _vector(field, value, 3)
    pairs = [numbers_in(entry if np.ndim(entry) else (entry, entry)) for entry in entries]
    if len(pairs) != 3 or not all(pair is not None and pair.shape == (2,) for pair in pairs):
        raise refusal(field, value, "3 numbers, each may be (least, most)", PlanningError)
    limits = np.array(pairs).T
    refuse_not_finite(field, limits, PlanningError)
    if (limits[0] > limits[1]).any():
        raise refusal(field, value, "least below most", PlanningError)
    return limits


def _partly_free(field: str, value: Any, size: int) -> np.ndarray:
    """Return numbers (size,), nan for free ones."""
    if np.ma.is_masked(value):
        raise PlanningError(f"{field}: has masked entries: give None where it is free")
    try:
        entries = [*value]
    except TypeError:
        entries = [value]
    array = numbers_in([0.0 if entry is None else entry for entry in entries])
    if array is None or array.shape != (size,) or not np.isfinite(array).all():
        raise PlanningError(
            f"{field}: value {shown(value)}: needs {size} finite numbers, None where free"
        )
    return np.where([entry is None for entry in entries], np.nan, array)


def _as_far_as(
    bounds: Bounds, start: np.ndarray, goal: np.ndarray | None, free: Range | None
) -> Bounds:
    """Return bounds whose usual angles are as wide as start and goal ask for."""
    asked = [start, *([] if goal is None else [np.nan_to_num(goal)]), *(free or ())]
    return replace(bounds, angle=np.max(np.abs([bounds.angle, *asked]), axis=0))


def _start_inside(model: Model, state: np.ndarray, bound: np.ndarray | None, name: str) -> None:
    if bound is None:
        return
    values = state[-len(bound) :]
    k = int(np.argmax(np.abs(values) - bound))
    if abs(values[k]) > bound[k] + START_SLACK:
        units = model.names.q if name == "angle" else model.names.v
        entry, unit = [*units.items()][k - len(bound)]
        raise PlanningError(
            f"bounds.{name}: the start has {entry} = {values[k]:.6g} {unit}, beyond "
            f"{bound[k]:.6g}: widen the bound, or start inside it"
        )


def _between_stops(name: str, model: Model, angles: np.ndarray) -> None:
    behind = behind_stops(model, angles[None])
    if behind:
        raise PlanningError(f"{name}: {behind}: give one between the stops, or move them")


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


def _refuse_of_several(model: Model, settings: Mapping[str, Any], refused: Refusals) -> None:
    """Refuse settings that plans of several chains do not have."""
    for name in [n for n in OF_ONE_TAIL if settings[n] is not None]:
        refused.attempt(name, refuse_several, model, name, "leave it out", PlanningError)


def _refuse_on_passive(model: Model, bounds: Bounds | None, damping: float | None) -> None:
    """PlanningError for what needs a motor at each coordinate."""
    passive = [n for n, own in zip(model.names.tail, model.layout.driven, strict=True) if not own]
    rated = bounds is not None and bounds.torque_rate is not None
    asked = {"damping": bool(damping), "bounds.torque_rate": rated}
    for name in [name for name, here in asked.items() if passive and here]:
        raise PlanningError(
            f"{name}: needs a motor at each coordinate, and {passive[0]} is passive: leave it out, "
            'or set drive = "torque" in the scene'
        )


def _objective(objective: Any) -> str | Callable[[Any], Any]:
    if not callable(objective):
        one_of("objective", objective, OBJECTIVES, PlanningError)
    return objective


def _legs(legs: Any) -> Legs | None:
    if legs is not None and not isinstance(legs, Legs):
        raise refusal("legs", legs, "Legs, such as st.Legs.fixed(gamma, delta)", PlanningError)
    return legs


def _work(name: str) -> Callable[[Any], float]:
    """Return the check of a damping."""
    return partial(number, name, error=PlanningError, unit="N m s", least=0, most=HUGE)


SETTINGS: dict[str, Callable[[Any], Any]] = {  # of the problem, and their checks
    "objective": _objective,
    "smoothing": _work("smoothing"),
    "damping": _work("damping"),
    "path": checked_path,
    "clearance": checked_clearance,
    "legs": _legs,
}
