"""What acts in a scene's simulation: its tables of controllers, references and legs."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ..basics.checks import number, one_of, refusal, shown
from ..basics.errors import SimulationError
from ..model.model import Model
from ..motion.trajectory import Trajectory
from ..simulation.controllers.controller import Controller, Damping, Phases, TorqueTable
from ..simulation.controllers.load import Load
from ..simulation.controllers.pfl import KD, KP, Pfl
from ..simulation.controllers.prescribed import Prescribed
from ..simulation.controllers.schedules import Legs, Reference
from .simulate_keys import LAWS, LOAD

NODES = ("moves", "times", "blend")  # of a table [simulate.prescribed]: not the names of chains


def legs_of(table: Mapping) -> Legs:
    """Return the legs of a table [simulate.legs]."""
    missing = [name for name in ("gamma", "delta") if name not in table]
    if missing or {"moves", "times"} <= set(table):
        needs = "gamma, delta, and moves or times, not both"
        raise refusal("simulate.legs", dict(table), needs, SimulationError)
    if "times" in table:
        return Legs(table["times"], table["gamma"], table["delta"])
    gamma, delta = (
        number(f"simulate.legs.{name}", table[name], SimulationError) for name in ("gamma", "delta")
    )
    return Legs.moves(gamma, delta, table.get("moves", []))


def prescribed_of(table: Mapping) -> Prescribed:
    """Return the schedule of a table [simulate.prescribed]: angles by chain, moves or times."""
    angles = {name: value for name, value in table.items() if name not in NODES}
    if {"moves", "times"} <= table.keys() or ("blend" in table and "times" not in table):
        needs = "either moves, or times and perhaps blend"
        raise refusal("simulate.prescribed", dict(table), needs, SimulationError)
    if "times" not in table:
        return Prescribed.moves(angles, table.get("moves", []))
    return Prescribed(table["times"], angles, table.get("blend", "quintic"))


def loads_of(tables: list[dict[str, Any]]) -> list[Load]:
    """Return the forces of tables [[simulate.load]]."""
    for k, table in enumerate(tables):
        if len(table) < len(LOAD):
            needs = "point, times and force"
            raise refusal(f"simulate.load[{k}]", table, needs, SimulationError)
    return [Load(**table) for table in tables]


def reference_of(where: str, model: Model, table: Mapping, parent: Path) -> Reference | Trajectory:
    """Return a Reference, or the Trajectory that `serpentail plan --save` wrote."""
    if set(table) == {"file"}:
        try:
            return Trajectory.load(parent / str(table["file"]))
        except (OSError, ValueError) as error:
            raise SimulationError(f"{where}.file: value {shown(table['file'])}: {error}") from error
    if not {"times", "bends"} <= set(table) or "file" in table:
        raise refusal(where, dict(table), "times and bends, or a file", SimulationError)
    return Reference.of_bends(model, table["times"], table["bends"], table.get("blend", "quintic"))


def controller_of(where: str, model: Model, value: Any, reference: Any) -> Controller:
    """Return the controller of a table, or of an array of tables with `begin` one after another."""
    if isinstance(value, Mapping):
        return law_of(where, model, value, reference)
    if not isinstance(value, list) or not value:
        needs = f"a table, or tables under lines [[{where}]], with begin"
        raise refusal(where, value, needs, SimulationError)
    pairs = []
    for index, table in enumerate(value):
        place = f"{where}[{index}]"
        if not isinstance(table, Mapping) or "begin" not in table:
            raise refusal(place, table, "a table with begin (s)", SimulationError)
        law = {name: value for name, value in table.items() if name != "begin"}
        begin = number(f"{place}.begin", table["begin"], SimulationError)
        pairs.append((begin, law_of(place, model, law, reference)))
    return Phases(tuple(pairs))


def law_of(where: str, model: Model, table: Mapping, reference: Any) -> Controller:
    """Return the controller of a table, by its kind."""
    kind = one_of(f"{where}.kind", table.get("kind"), LAWS, SimulationError)
    values = {name: value for name, value in table.items() if name != "kind"}
    if kind == "none":
        return None
    if kind == "damping":
        return Damping(**values)
    if kind == "torques":
        return TorqueTable(**{"times": None, "torques": None} | values)
    if reference is None:
        parent = where.split(".controller", maxsplit=1)[0]
        raise SimulationError(
            f"{where}: kind 'pfl' tracks a reference: add a table [{parent}.reference]"
        )
    return Pfl(model, reference, **{"kp": KP, "kd": KD} | values)
