"""The plan that a scene file's table [plan] asks for."""

import re
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from serpentail_scene.keys import Key, one_word
from serpentail_scene.units import in_unit

from ..basics import extras
from ..basics.checks import Refusals, needed, refusal, shown
from ..basics.errors import PlanningError
from ..model.model import Model
from ..optimal.rules import MOST_DEGREE
from ..planning.goal import GOALS, HALF_TURN, Bounds, Goal
from ..planning.planner import plan
from ..planning.problem import OBJECTIVES
from ..planning.result.plan import Plan
from ..planning.settings import SOLVERS, WHOLE_NUMBERS, joined
from .file import UNSIZED, model_of, read_scene, size_of, subtable, values_of
from .keys import sized
from .overrides import changed, split_changes

FREE = "free"  # TOML has no None
WORK = Key("N m s")
Q_UNITS = ("m",) * 3 + ("1",) * 4 + ("rad",)  # of q; the last one of all tail coordinates
V_UNITS = ("m/s",) * 3 + ("rad/s",)


def _whole(least: int, most: int) -> Key:
    """Return the key of a whole number."""
    return Key(form={"type": "integer", "minimum": least, "maximum": most})


def _or_free(unit: str) -> Key:
    """Return the key of numbers that may be left free."""
    return Key(unit, depth=1, words=(FREE,))


def _bound(unit: str, *words: str) -> Key:
    """Return the key of a bound, also by names: it may be as wide as it likes."""
    one = Key(unit, depth=1, usual=False)
    return replace(one, named=one, words=words)


GOAL = {
    "attitude": Key("1", depth=1, words=("upright", FREE)),
    "torso_rate": Key("rad/s", depth=2, words=(FREE,)),
    "tail": _or_free("rad"),
    "tail_rate": _or_free("rad/s"),
    "chains": Key(named=_or_free("rad")),
    "chain_rates": Key(named=_or_free("rad/s")),
}
BOUNDS = {
    "angle": _bound("rad", HALF_TURN, FREE),
    "rate": _bound("rad/s"),
    "torque": _bound("N m"),
    "torque_rate": _bound("N m/s"),
    "tension": _bound("N"),
    "speed": _bound("rad/s"),
    "power": _bound("W"),
}
FREE_START = {
    "position": Key("m", depth=2),
    "attitude": Key("rad", depth=2),
    "tail": Key("rad", depth=2),
    "velocity": Key("m/s", depth=2),
    "torso_rate": Key("rad/s", depth=2),
    "tail_rate": Key("rad/s", depth=2),
}
# of parameters, whose units the model knows
PAIR = {"type": "array", "minItems": 2, "maxItems": 2}
RANGES = {"type": "object", "additionalProperties": PAIR}
PLAN = Key(
    keys={
        "start": Key(
            keys={"q": Key(Q_UNITS, depth=1), "v": Key(V_UNITS, depth=1)}, needs=("q", "v")
        ),
        "goal": Key(keys=GOAL, words=tuple(GOALS)),
        "duration": Key("s", depth=1),
        "bounds": Key(keys=BOUNDS),
        # of the problem
        "objective": one_word(*OBJECTIVES),
        "smoothing": WORK,
        "damping": WORK,
        "clearance": Key("m"),
        "design": Key(form=RANGES),
        "design_totals": Key(form={"type": "object"}),
        "free_start": Key(keys=FREE_START),
        # of the search
        **{name: _whole(*bounds) for name, bounds in WHOLE_NUMBERS.items()},
        "degree": _whole(1, MOST_DEGREE),
        "tolerance": Key("deg", words=(FREE,)),
        "tail_tolerance": Key("deg", words=(FREE,)),
        "rate_tolerance": Key("rad/s", words=(FREE,)),
        "solver": one_word(*SOLVERS),
        "options": Key(form={"type": "object"}),
        "guess_damping": WORK,
        "time_limit": Key("s", usual=False),
        "track": Key(form={"type": "boolean"}),
        "through_torso": Key(form={"type": "boolean"}),
    },
    needs=("start", "duration"),
)
ELSEWHERE = "programs can give others, to serpentail.plan"
CODE_ONLY = ("guess", "path", "legs", "watch")  # values that no file can hold


def planned(path: str, folder: str | None = None, changes: Mapping | None = None) -> Plan:
    """Plan the motion that a scene file describes in [plan].

    Parameters
    ----------
    path : str or path
        A scene file, or the name of an example (see ``examples``).
    folder : str or path, optional
        Generated folder of its model. Default: the model is built, or taken from the cache.
    changes : mapping, optional
        New values by name: of keys of [plan], such as "duration" or "bounds.torque"; others are
        parameters of the model.

    Returns
    -------
    Plan
        The plan.

    Raises
    ------
    PlanningError
        A key is wrong; the message names field, value and remedy. Or as of ``plan``.
    ModelError
        A parameter is wrong, or the folder belongs to another scene.
    ExtraMissing
        The extra "plan" is not installed.
    """
    extras.needed("casadi", "plan")  # before the model is built
    tables, place = read_scene(path, PlanningError)
    parts = split_changes(changes, {"plan": PLAN.keys}, PlanningError)
    table = changed(subtable(tables, "plan", place, PlanningError), parts["plan"])
    plan_arguments(table)  # errors are raised before a model is built
    model = model_of(tables, place, folder, parts["parameters"])
    return plan(model, **arguments_for(model, table))


def arguments_for(model: Model, table: Mapping) -> dict[str, Any]:
    """Return the arguments of ``plan`` that a table [plan] has, in the size of the model's body."""
    size = size_of(model)
    arguments = plan_arguments(table, size)
    units = {p["name"]: p["unit"] for p in model.manifest["parameters"]}
    for key in ("design", "design_totals"):
        design = arguments.get(key)
        if size and isinstance(design, Mapping):
            arguments[key] = {
                name: _in_size(pair, units.get(name, "1"), size) for name, pair in design.items()
            }
    return arguments


def _in_size(pair: Any, unit: str, size: Mapping[str, float]) -> Any:
    """Return least and most of a parameter in the size of a body; wrong ones as they are."""
    try:
        return sized(in_unit(pair, unit), Key(unit), size)
    except ValueError:
        return pair  # ``plan`` refuses it


def plan_arguments(table: Mapping, size: Mapping[str, float] = UNSIZED) -> dict[str, Any]:
    """Return the arguments of ``plan`` that a table [plan] has, in the size of a body.

    PlanningError has a line for each key that is wrong.
    """
    refused = Refusals(PlanningError)
    for name, needs in (("start", "q and v"), ("duration", "seconds")):
        if name not in table:
            refused.add(name, f"plan.{name}: no value: needs {needs}")
    arguments = arguments_but_start(table, "plan", refused, size)
    start = table.get("start")
    if isinstance(start, Mapping) and not {"q", "v"} <= set(start):
        known = {name: value for name, value in start.items() if name in ("q", "v")}
        refused.add("start", needed("plan.start", known, "q and v"))
    refused.tell()
    start = arguments["start"]
    return arguments | {"start": (start["q"], start["v"])}


def arguments_but_start(
    table: Mapping, where: str, refused: Refusals, size: Mapping[str, float]
) -> dict[str, Any]:
    """Return the arguments of ``plan`` that a table of a scene has, in the size of a body, its
    start as it is there; refuse each key that is wrong.
    """
    for name in CODE_ONLY:
        if name in table:
            remedy = "only programs can give it; call serpentail.plan"
            refused.add(name, f"{where}.{name}: value {shown(table[name])}: {remedy}")
    rest = {name: value for name, value in table.items() if name not in CODE_ONLY}
    table = values_of(rest, PLAN, where, size, refused)
    refused.attempt("options", _check_options, table.get("options", {}))
    if refused.lines:
        return {}

    # goal and bounds are tables; other values are passed on, except "free"
    goal = table.get("goal", {})
    if isinstance(goal, Mapping):
        goal = Goal(**{key: _free_parts(value) for key, value in goal.items()})
    arguments = {name: _unless_free(value) for name, value in table.items()}
    bounds = {name: _unless_free(value) for name, value in table.get("bounds", {}).items()}
    return joined(arguments | {"goal": goal, "bounds": Bounds(**bounds)}, {})


def _check_options(options: Any) -> None:
    """PlanningError for an option that could load libraries, run code or write files."""
    for name, value in options.items() if isinstance(options, Mapping) else [("", options)]:
        harmless = re.fullmatch(r"(ipopt|fatrop)\.(?!\w*(file|lib))\w+", name)
        if not harmless or not isinstance(value, int | float | str):
            needs = f"numbers and words of the solver, such as ipopt.max_iter; {ELSEWHERE}"
            raise refusal(f"plan.options.{name}".rstrip("."), value, needs, PlanningError)


def _unless_free(value: Any) -> Any:
    """Return a value, or None in place of "free"."""
    return None if isinstance(value, str) and value == FREE else value


def _free_parts(value: Any) -> Any:
    """Return a part of a goal, None in place of "free" in arrays and tables, too."""
    if isinstance(value, Mapping):
        return {name: _free_parts(part) for name, part in value.items()}
    return tuple(map(_unless_free, value)) if isinstance(value, list) else _unless_free(value)
