"""The plan that a scene file's table [plan] asks for."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import fields
from typing import Any

from ..checks import one_of, refusal, shown
from ..errors import PlanningError
from ..planning.planner import plan
from ..planning.problem import PROBLEM_SETTINGS, Bounds, Goal
from ..planning.result.plan import Plan
from ..planning.settings import PlanSettings
from .file import model_of, read_scene, subtable

ELSEWHERE = "programs can give others, to serpentail.plan"
FREE = "free"  # TOML has no None
CODE_ONLY = ("guess", "path")  # what no file can hold
SETTINGS = (*PROBLEM_SETTINGS, *(entry.name for entry in fields(PlanSettings)))
KEYS = ("start", "goal", "duration", "bounds", *(key for key in SETTINGS if key not in CODE_ONLY))


def planned(path: str, folder: str | None = None) -> Plan:
    """Return the plan that a scene file asks for.

    path: a scene file, or the name of an example; folder: of its model, where that was generated;
    None: it is built, or was.  Raises PlanningError with field, value and
    remedy, ModelError where the folder is of another scene.
    """
    tables, place = read_scene(path, PlanningError)
    arguments = plan_arguments(subtable(tables, "plan", place, PlanningError))
    return plan(model_of(tables, place, folder, {}), **arguments)


def plan_arguments(table: Mapping) -> dict[str, Any]:
    """Return the arguments of ``plan`` that a table [plan] has."""
    _check_keys(table)

    # tables of their own: start, goal and bounds
    start = _part("start", table["start"], ("q", "v"))
    if set(start) != {"q", "v"}:
        raise PlanningError(f"plan.start: value {shown(start)}: needs q and v")
    goal = _part("goal", table.get("goal", {}), _names(Goal))
    bounds = _part("bounds", table.get("bounds", {}), _names(Bounds))

    # the others as they are, but for "free"
    arguments = dict(table) | {
        "start": (start["q"], start["v"]),
        "goal": Goal(**{key: _free(value) for key, value in goal.items()}),
        "bounds": Bounds(**bounds),
    }
    if arguments.get("tolerance") == FREE:
        arguments["tolerance"] = None
    _check_solver(arguments.get("solver", "ipopt"), arguments.get("options", {}))
    return arguments


def _check_solver(solver: Any, options: Any) -> None:
    """PlanningError where a solver could be made to load libraries, run code or write files."""
    if not isinstance(solver, str) or not re.fullmatch("[a-z]+", solver):
        raise refusal("plan.solver", solver, f"a name of a-z; {ELSEWHERE}", PlanningError)
    for name, value in options.items() if isinstance(options, Mapping) else [("", options)]:
        own = re.fullmatch(rf"{solver}\.(?!\w*(file|lib))\w+", name)
        if not own or not isinstance(value, int | float | str):
            needs = f"numbers and words of the solver, such as ipopt.max_iter; {ELSEWHERE}"
            raise refusal(f"plan.options.{name}".rstrip("."), value, needs, PlanningError)


def _check_keys(table: Mapping) -> None:
    """PlanningError where a table [plan] has a key that it cannot have, or lacks one."""
    for name in table:
        if name in CODE_ONLY:
            raise PlanningError(
                f"plan.{name}: value {shown(table[name])}: only programs can give it; call "
                "serpentail.plan"
            )
        one_of("plan: key", name, KEYS, PlanningError)
    for name, needed in (("start", "q and v"), ("duration", "seconds")):
        if name not in table:
            raise PlanningError(f"plan.{name}: no value: needs {needed}")


def _names(kind: type[Goal] | type[Bounds]) -> list[str]:
    return [entry.name for entry in fields(kind)]


def _part(field: str, value: Any, known: Sequence[str]) -> dict:
    """A table in [plan] with known keys."""
    if not isinstance(value, Mapping):
        raise PlanningError(
            f"plan.{field}: value {shown(value)}: needs a table, under a line [plan.{field}]"
        )
    for name in value:
        one_of(f"plan.{field}: key", name, known, PlanningError)
    return dict(value)


def _free(value: Any) -> Any:
    """None for "free", in arrays too."""
    if isinstance(value, list):
        return tuple(None if entry == FREE else entry for entry in value)
    return None if value == FREE else value
