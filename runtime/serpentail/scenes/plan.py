"""Scenes: a scene file with a table [plan] goes in; the plan of its motion comes out."""

from collections.abc import Mapping
from dataclasses import fields

from ..checks import choice
from ..errors import PlanningError
from ..planning.settings import PlanSettings
from ..planning.planner import plan
from ..planning.problem import PROBLEM_SETTINGS, Bounds, Goal
from ..planning.result.plan import Plan
from .file import model_of, read_scene, subtable

FREE = "free"  # TOML has no None
CODE = ("guess", "path")  # what no file can hold
KEYS = ("start", "goal", "duration", "bounds", *PROBLEM_SETTINGS, *(entry.name for entry in fields(PlanSettings)))


def planned(path: str, folder: str | None = None) -> Plan:
    """Return the plan that a scene file asks for; its model is in `folder`, by default
    generated/<scene>.

    Raises PlanningError with field, value and remedy, ModelError where the folder is of another
    scene.
    """
    scene = read_scene(path, PlanningError)
    arguments = plan_arguments(subtable(scene, "plan", path, PlanningError))
    return plan(model_of(scene, path, folder, {}), **arguments)


def plan_arguments(table: Mapping) -> dict:
    """Return the arguments of ``plan`` that a table [plan] has."""
    for name in table:
        if name in CODE:
            raise PlanningError(
                f"plan.{name}: value {table[name]!r}: only programs can give it; call "
                "serpentail.plan"
            )
        choice("plan: key", name, [key for key in KEYS if key not in CODE])
    for name in ("start", "duration"):
        if name not in table:
            raise PlanningError(
                f"plan.{name}: no value: needs {'q and v' if name == 'start' else 'seconds'}"
            )
    start = _part("start", table["start"], ("q", "v"))
    if set(start) != {"q", "v"}:
        raise PlanningError(f"plan.start: value {start!r}: needs q and v")
    goal = {
        key: _free(value)
        for key, value in _part("goal", table.get("goal", {}), _names(Goal)).items()
    }
    bounds = _part("bounds", table.get("bounds", {}), _names(Bounds))
    rest = {key: value for key, value in table.items() if key not in ("start", "goal", "bounds")}
    own = {"start": (start["q"], start["v"]), "goal": Goal(**goal), "bounds": Bounds(**bounds)}
    return own | {
        key: None if key == "tolerance" and value == FREE else value for key, value in rest.items()
    }


def _names(kind) -> list[str]:
    return [entry.name for entry in fields(kind)]


def _part(field: str, value, known) -> dict:
    """A table in [plan] with known keys."""
    if not isinstance(value, Mapping):
        raise PlanningError(
            f"plan.{field}: value {value!r}: needs a table, under a line [plan.{field}]"
        )
    for name in value:
        choice(f"plan.{field}: key", name, known)
    return dict(value)


def _free(value):
    """None for "free", in arrays too."""
    if isinstance(value, list):
        return tuple(None if entry == FREE else entry for entry in value)
    return None if value == FREE else value
