"""Scenes: a scene file with a table [plan] goes in; the plan of its motion comes out."""

import tomllib
from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path

from ..errors import PlanningError
from ..model import load
from .planner import plan
from .problem import SETTINGS, Bounds, Goal, choice
from .rounds import Method
from .solution import Plan

FREE = "free"  # TOML has no None
CODE = ("guess", "path")  # what no file can hold
KEYS = ("start", "goal", "duration", "bounds", *SETTINGS, *(entry.name for entry in fields(Method)))


def planned(path: str, folder: str | None = None) -> Plan:
    """Return the plan that a scene file asks for; its model is in `folder`, by default generated/<scene>.

    Raises PlanningError with field, value and remedy, ModelError where the model was not generated.
    """
    table, name = read_scene(path)
    arguments = plan_arguments(table)
    return plan(load(folder or Path("generated") / name), **arguments)


def read_scene(path: str) -> tuple[dict, str]:
    """Return the table [plan] of a scene file, and the scene's name."""
    try:
        scene = tomllib.loads(Path(path).read_text(encoding="utf-8-sig"))
    except (OSError, ValueError, RecursionError) as error:
        raise PlanningError(
            f"scene file: value {path!r}: cannot be read ({error}); give a scene file (.toml)"
        ) from error
    table = scene.get("plan")
    if not isinstance(table, Mapping):
        raise PlanningError(f"plan: value {table!r}: {path} has no table [plan]; add one, with start and duration")
    name = scene.get("name", Path(path).stem)
    return dict(table), str(name)


def plan_arguments(table: Mapping) -> dict:
    """Return the arguments of ``plan`` that a table [plan] has."""
    for name in table:
        if name in CODE:
            raise PlanningError(f"plan.{name}: value {table[name]!r}: only programs can give it; call serpentail.plan")
        choice("plan: key", name, [key for key in KEYS if key not in CODE])
    for name in ("start", "duration"):
        if name not in table:
            raise PlanningError(f"plan.{name}: no value: needs {'q and v' if name == 'start' else 'seconds'}")
    start = _part("start", table["start"], ("q", "v"))
    if set(start) != {"q", "v"}:
        raise PlanningError(f"plan.start: value {start!r}: needs q and v")
    goal = {key: _free(value) for key, value in _part("goal", table.get("goal", {}), _names(Goal)).items()}
    bounds = _part("bounds", table.get("bounds", {}), _names(Bounds))
    rest = {key: value for key, value in table.items() if key not in ("start", "goal", "bounds")}
    own = {"start": (start["q"], start["v"]), "goal": Goal(**goal), "bounds": Bounds(**bounds)}
    return own | {key: None if key == "tolerance" and value == FREE else value for key, value in rest.items()}


def _names(kind) -> list[str]:
    return [entry.name for entry in fields(kind)]


def _part(field: str, value, known) -> dict:
    """A table in [plan] with known keys."""
    if not isinstance(value, Mapping):
        raise PlanningError(f"plan.{field}: value {value!r}: needs a table, under a line [plan.{field}]")
    for name in value:
        choice(f"plan.{field}: key", name, known)
    return dict(value)


def _free(value):
    """None for "free", in arrays too."""
    if isinstance(value, list):
        return tuple(None if entry == FREE else entry for entry in value)
    return None if value == FREE else value
