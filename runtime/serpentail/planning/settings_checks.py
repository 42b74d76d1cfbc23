"""Checks of how to search for a plan."""

import re
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from ..basics.checks import Refusals, needed, number, one_of, refusal, shown, whole_number
from ..basics.errors import PlanningError
from ..model.model import Model
from ..motion.trajectory import Trajectory
from ..optimal.rules import collocation_rule
from .magnitudes import HUGE
from .settings import KINDS, PLACES, PlanSettings, joined, spelled

WHOLE_NUMBERS = {  # least and most of each; beyond the most a search would not end
    "most_intervals": (1, 10_000),
    "rounds": (0, 1000),
    "multi_start": (1, 10_000),
    "retries": (0, 10_000),
    "seed": (0, 2**63 - 1),
}
CHOSEN = dict.fromkeys(("intervals", "controls"), (1, 10_000))  # None: the planner chooses
UNITS = {
    "tolerance": "deg",
    "tail_tolerance": "deg",
    "rate_tolerance": "rad/s",
    "time_limit": "s",
}  # of numbers above 0, or None
SOLVERS = ("auto", "fatrop", "ipopt")


def checked_settings(
    model: Model, given: Mapping[str, Any], old: Mapping[str, Any], refused: Refusals
) -> PlanSettings:
    """Return settings with numbers in their units; add each wrong one to ``refused``.

    given: mesh, tolerances, solver and guess as ``plan`` takes them; old: keywords in PLACES.
    """
    whole: dict[str, Any] = {}
    for name, value in given.items():
        if type(value) is KINDS[name] or name in PLACES:
            whole[name] = value
        elif value is not None:
            needs = f"st.{KINDS[name].__name__}(...), or None"
            refused.add(name, needed(name, value, needs))
    for name in old:
        home = PLACES[name][0]
        if type(given[home]) is KINDS[home]:
            remedy = f"beside {home}: needs {spelled(name)} alone"
            refused.add(name, f"{name}: value {shown(old[name])}: {remedy}")
    usual = {name: kind() for name, kind in KINDS.items()}
    return _checked(model, PlanSettings(**joined({**whole, **old}, usual)), refused)


def _checked(model: Model, settings: PlanSettings, refused: Refusals) -> PlanSettings:
    """Return settings with numbers in their units; add each wrong one to ``refused``."""

    def check(name: str, check: Callable[..., Any], *given: Any) -> Any:
        home, field = PLACES[name]
        where, value = f"{home}.{field}", getattr(getattr(settings, home), field)
        return refused.attempt(where, check, where, value, *given)

    for name, bounds in WHOLE_NUMBERS.items():
        check(name, _check_whole, *bounds)
    for name, bounds in CHOSEN.items():
        check(name, _check_whole, *bounds, True)
    for name in ("track", "through_torso"):
        check(name, _check_switch)
    check("degree", lambda _, value: collocation_rule(value))
    check("options", _check_options)
    check("watch", _check_watch)
    check("solver", one_of, SOLVERS, PlanningError)
    check("guess", _check_guess, model)
    numbers = {name: check(name, _measured, unit) for name, unit in UNITS.items()}
    numbers["guess_damping"] = check("guess_damping", _damping)
    return PlanSettings(**joined(numbers, vars(settings)))


def _check_whole(name: str, value: Any, least: int, most: int, free: bool = False) -> None:
    """PlanningError unless a value is a whole number within bounds, or None if that is free."""
    if not (free and value is None):
        whole_number(name, value, PlanningError, least=least, most=most)


def _check_switch(name: str, value: Any) -> None:
    """PlanningError unless a value is True or False."""
    if not isinstance(value, bool | np.bool_):
        raise refusal(name, value, "True or False", PlanningError)


def _check_watch(name: str, value: Any) -> None:
    """PlanningError unless a value can be called, or is None."""
    if not (value is None or callable(value)):
        raise refusal(name, value, "a function of a Plan, or None", PlanningError)


def _measured(name: str, value: Any, unit: str) -> float | None:
    """Return a number above 0 in a unit, or None."""
    return None if value is None else number(name, value, PlanningError, unit=unit, above=0)


def _damping(name: str, value: Any) -> float:
    """Return a damping (N m s)."""
    return number(name, value, PlanningError, unit="N m s", least=0, most=HUGE)


def _check_options(name: str, options: Any) -> None:
    """PlanningError unless options are a dict of settings of FATROP and IPOPT."""
    if not isinstance(options, dict):
        needs = "a dict, such as {'fatrop.max_iter': 500, 'ipopt.max_iter': 500}"
        raise refusal(name, options, needs, PlanningError)
    for option in options:
        if not re.fullmatch(r"(ipopt|fatrop)\.\w+", str(option)):
            needs = "a name that begins with 'fatrop.' or 'ipopt.'"
            raise PlanningError(f"{name}: {shown(option)}: needs {needs}")


def _check_guess(name: str, guess: Any, model: Model) -> None:
    """PlanningError unless the guess is None, or a motion of such a model."""
    if guess is None:
        return
    if isinstance(guess, tuple | list):
        for k, each in enumerate(guess):
            if not hasattr(each, "trajectory"):
                raise refusal(f"{name}[{k}]", each, "a Plan", PlanningError)
            _check_guess(f"{name}[{k}]", each, model)
        return
    motion = getattr(guess, "trajectory", guess)
    if not isinstance(motion, Trajectory):
        raise refusal(name, guess, "a Plan or a Trajectory", PlanningError)
    if motion.q.shape[1] != model.nq or len(motion.t) < 2:
        needs = f"at least two samples of {model.nq}"
        raise PlanningError(f"{name}: q has shape {motion.q.shape}: needs {needs}")
