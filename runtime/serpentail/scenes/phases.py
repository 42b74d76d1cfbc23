"""The phases that a scene file's tables [[phase]] describe."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from serpentail_scene.keys import Key

from ..basics.checks import Refusals, needed, shown
from ..basics.errors import SimulationError
from ..model.model import Model
from ..sequence.phase import AIRBORNE, BEFORE, GIVEN, LANDING, Phase, Tracking
from ..simulation.controllers import Controller
from ..simulation.ground import KINDS
from .acting import controller_of, reference_of
from .file import size_of
from .keys import read, sized
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
    model: Model, tables: Any, usual: tuple[Controller, Path], refused: Refusals
) -> tuple[Phase, ...]:
    """Return the phases of a scene's tables, and add errors phase by phase.

    usual: the controller of phases without one, and the folder of files.
    """
    if not isinstance(tables, list | tuple):
        refused.add("phase", needed("phase", tables, "tables, under lines [[phase]]"))
        return ()
    found = []
    for k, table in enumerate(tables):
        where = f"phase[{k}]"
        if isinstance(table, Mapping):
            found.append(refused.attempt(where, _phase, where, model, table, usual))
        else:
            refused.add(where, needed(where, table, "a table, under a line [[phase]]"))
    return tuple(phase for phase in found if phase is not None)


def _phase(where: str, model: Model, table: Mapping, usual: tuple[Controller, Path]) -> Phase:
    """Return one phase; SimulationError has a line for each thing that is wrong."""
    refused, (law, folder) = Refusals(SimulationError), usual
    given = {name: value for name, value in table.items() if name != "plan"}
    values = sized(read(given, PHASE, where, refused), PHASE, size_of(model))
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
    elif "plan" not in table:
        values["controller"] = law
    if "plan" in table:
        values["plan"] = _plans(f"{where}.plan", table["plan"], size_of(model))
    if "tracking" in values:
        values["tracking"] = Tracking(**values["tracking"])
    return Phase(**values)


def _plans(where: str, value: Any, size: Mapping[str, float]) -> list[dict[str, Any]]:
    """Return the arguments of one plan or of several."""
    tables = value if isinstance(value, list) else [value]
    plans = []
    for k, table in enumerate(tables):
        place = f"{where}[{k}]" if isinstance(value, list) else where
        if not isinstance(table, Mapping):
            raise SimulationError(f"{place}: value {shown(table)}: needs a table")
        refused = Refusals(SimulationError)
        plans.append(arguments_but_start(table, place, refused, size))
        refused.tell()
    return plans
