"""The plan that a scene file's table [plan] asks for."""

import re
from collections.abc import Mapping
from typing import Any

from .. import extras
from ..checks import Refusals, needed, refusal, shown
from ..errors import PlanningError
from ..planning.planner import plan
from ..planning.problem import Bounds, Goal
from ..planning.result.plan import Plan
from .file import model_of, read_scene, subtable
from .keys import read
from .plan_keys import FREE, PLAN

ELSEWHERE = "programs can give others, to serpentail.plan"
CODE_ONLY = ("guess", "path", "legs")  # what no file can hold


def planned(path: str, folder: str | None = None) -> Plan:
    """Return the plan that a scene file asks for.

    path: a scene file, or the name of an example; folder: of its model, where that was generated;
    None: it is built, or was.  Raises PlanningError with field, value and
    remedy, ModelError where the folder is of another scene, ExtraMissing without the extra "plan".
    """
    extras.needed("casadi", "plan")  # before the model is built
    tables, place = read_scene(path, PlanningError)
    arguments = plan_arguments(subtable(tables, "plan", place, PlanningError))
    return plan(model_of(tables, place, folder, {}), **arguments)


def plan_arguments(table: Mapping) -> dict[str, Any]:
    """Return the arguments of ``plan`` that a table [plan] has.

    PlanningError has a line for each key that is wrong.
    """
    refused = Refusals(PlanningError)
    _check_keys(table, refused)
    own = {name: value for name, value in table.items() if name not in CODE_ONLY}
    table = read(own, PLAN, "plan", refused)
    solver = table.get("solver", "ipopt"), table.get("options", {})
    refused.attempt("solver", _check_solver, *solver)
    start = table.get("start", {})
    if isinstance(start, Mapping) and "start" in own and set(start) != {"q", "v"}:
        refused.add("start", needed("plan.start", dict(start), "q and v"))
    refused.tell()

    # tables of their own are start, goal and bounds; the others are as they are, but for "free"
    goal = table.get("goal", {})
    if isinstance(goal, Mapping):
        goal = Goal(**{key: _free(value) for key, value in goal.items()})
    arguments = table | {
        "start": (start["q"], start["v"]),
        "goal": goal,
        "bounds": Bounds(**table.get("bounds", {})),
    }
    return {name: None if _is_free(value) else value for name, value in arguments.items()}


def _is_free(value: Any) -> bool:
    """Tell if nothing is demanded."""
    return isinstance(value, str) and value == FREE


def _check_solver(solver: Any, options: Any) -> None:
    """PlanningError where a solver could be made to load libraries, run code or write files."""
    if not isinstance(solver, str) or not re.fullmatch("[a-z]+", solver):
        raise refusal("plan.solver", solver, f"a name of a-z; {ELSEWHERE}", PlanningError)
    for name, value in options.items() if isinstance(options, Mapping) else [("", options)]:
        own = re.fullmatch(rf"{solver}\.(?!\w*(file|lib))\w+", name)
        if not own or not isinstance(value, int | float | str):
            needs = f"numbers and words of the solver, such as ipopt.max_iter; {ELSEWHERE}"
            raise refusal(f"plan.options.{name}".rstrip("."), value, needs, PlanningError)


def _check_keys(table: Mapping, refused: Refusals) -> None:
    """Note keys that no file can have, and those that are missing."""
    for name in CODE_ONLY:
        if name in table:
            remedy = "only programs can give it; call serpentail.plan"
            refused.add(name, f"plan.{name}: value {shown(table[name])}: {remedy}")
    for name, needs in (("start", "q and v"), ("duration", "seconds")):
        if name not in table:
            refused.add(name, f"plan.{name}: no value: needs {needs}")


def _free(value: Any) -> Any:
    """None for "free", in arrays too."""
    if isinstance(value, list):
        return tuple(None if entry == FREE else entry for entry in value)
    return None if value == FREE else value
