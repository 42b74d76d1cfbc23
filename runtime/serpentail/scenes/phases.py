"""The phases that a scene file's tables [[phase]] describe."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from serpentail_scene.keys import Key

from ..basics.checks import Refusals, needed, refusal
from ..basics.errors import SimulationError
from ..model.model import Model
from ..sequence.phase import AIRBORNE, BEFORE, GIVEN, LANDING, Phase, Tracking
from ..simulation.controllers.controller import Controller
from ..simulation.ground import KINDS
from .controllers import controller_of, reference_of
from .file import size_of, values_of
from .plan import PLAN, arguments_but_start
from .simulate_keys import LAWS_OF_ONE, METRES, MOVES, REFERENCE, SECONDS

EVENT = {"type": "array", "prefixItems": [{"enum": list(KINDS)}, {"type": "string"}]}
UNTIL = {"anyOf": [{"enum": [AIRBORNE, LANDING]}, {"type": "array", "items": EVENT}]}
WITHOUT_START = {name: key for name, key in PLAN.keys.items() if name not in GIVEN}
PHASE = Key(
    keys={
        "name": Key(form={"type": "string"}),
        "duration": SECONDS,
        "until": Key(form=UNTIL),
        "clearance": METRES,
        "controller": Key(kinds=LAWS_OF_ONE),
        "reference": Key(keys=REFERENCE),
        "plan": Key(keys=WITHOUT_START, each=Key(keys=WITHOUT_START)),
        "tracking": Key(keys={"kp": Key("1/s^2"), "kd": Key("1/s"), "early": SECONDS}),
        "moves": Key(each=Key(keys=MOVES | {BEFORE: SECONDS})),
    },
    needs=("name", "duration"),
)
PHASES = Key(each=PHASE)
INSTEAD = {  # keys of [simulate] that a scene with phases has elsewhere
    "duration": "each phase has its own",
    "reference": "give it to a phase",
    "load": "phases have no forces from outside",
    "prescribed": "phases have no prescribed joints",
}


def refuse_beside_phases(table: Mapping, refused: Refusals) -> None:
    """Refuse keys of a table [simulate] that cannot be combined with tables [[phase]]."""
    for name, remedy in INSTEAD.items():
        if name in table:
            refused.add(name, f"simulate.{name}: beside tables [[phase]]: {remedy}; remove it")
    legs = table.get("legs", {})
    for name in ("moves", "times"):
        if isinstance(legs, Mapping) and name in legs:
            remedy = "give phases moves; remove it"
            refused.add("legs", f"simulate.legs.{name}: beside tables [[phase]]: {remedy}")


def phases_of(
    model: Model, tables: Any, default: Controller, folder: Path, refused: Refusals
) -> tuple[Phase, ...]:
    """Return the phases of a scene's tables, and add errors phase by phase.

    default: the controller of phases without one; folder: of the files in the tables.
    """
    if not isinstance(tables, list | tuple):
        refused.add("phase", needed("phase", tables, "tables, under lines [[phase]]"))
        return ()
    phases = []
    for k, table in enumerate(tables):
        where = f"phase[{k}]"
        if isinstance(table, Mapping):
            phases.append(refused.attempt(where, _phase, where, model, table, default, folder))
        else:
            refused.add(where, needed(where, table, "a table, under a line [[phase]]"))
    return tuple(phase for phase in phases if phase is not None)


def _phase(where: str, model: Model, table: Mapping, default: Controller, folder: Path) -> Phase:
    """Return one phase; SimulationError has a line for each thing that is wrong."""
    refused, size = Refusals(SimulationError), size_of(model)
    rest = {name: value for name, value in table.items() if name != "plan"}
    values = values_of(rest, PHASE, where, size, refused)
    for name, needs in (("name", "a word"), ("duration", "seconds, at most")):
        if name not in table:
            refused.add(name, f"{where}.{name}: no value: needs {needs}")
    refused.tell()

    reference = values.pop("reference", None)
    if reference is not None:
        reference = reference_of(f"{where}.reference", model, reference, folder)
    if "controller" in values:
        values["controller"] = controller_of(
            f"{where}.controller", model, values["controller"], reference
        )
    else:
        values["controller"] = default
    if isinstance(table.get("plan"), list):
        values["plan"] = [
            _plan(f"{where}.plan[{k}]", each, size) for k, each in enumerate(table["plan"])
        ]
    elif "plan" in table:
        values["plan"] = _plan(f"{where}.plan", table["plan"], size)
    if "tracking" in values:
        values["tracking"] = Tracking(**values["tracking"])
    return Phase(**values)


def _plan(where: str, table: Any, size: Mapping[str, float]) -> dict[str, Any]:
    """Return the arguments of a plan."""
    if not isinstance(table, Mapping):
        raise refusal(where, table, "a table", SimulationError)
    refused = Refusals(SimulationError)
    arguments = arguments_but_start(table, where, refused, size)
    refused.tell()
    return arguments
