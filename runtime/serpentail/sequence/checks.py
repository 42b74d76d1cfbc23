"""Checks of a sequence against its model."""

from typing import Any

from ..basics.checks import number, refusal
from ..basics.errors import SimulationError
from ..model.model import Model
from ..simulation.controllers.controller import parts_of
from .phase import Phase


def check_legs(model: Model, gamma: Any, delta: Any) -> None:
    """SimulationError if angles of the legs are missing, or the model has no legs."""
    has = "feet" in model.contacts
    for name, value in (("gamma", gamma), ("delta", delta)):
        if has:
            number(f"Sequence: {name}", value, SimulationError)
        elif value is not None:
            raise SimulationError(f"Sequence: {name}: {model.name} has no legs: leave it out")


def check_phase(model: Model, phase: Phase) -> None:
    """SimulationError if a model cannot make a phase: its events, its controller or its moves."""
    where = f"phase {phase.name!r}"
    if phase.until is not None and not model.contacts:
        remedy = "add `contacts` to its scene, or leave it out"
        raise SimulationError(f"{where}: until: {model.name} has no contacts: {remedy}")
    for kind, group in phase.stop_at(model):
        if group not in model.contacts:
            choices = ", ".join(map(repr, model.contacts))
            needs = f"one of {choices}"
            raise refusal(f"{where}: until: {kind}", group, needs, SimulationError)
    try:
        parts_of(phase.controller, model.layout.nt)
    except SimulationError as error:
        raise SimulationError(f"{where}: {error}") from error
    if phase.moves and "feet" not in model.contacts:
        raise SimulationError(f"{where}: moves: {model.name} has no legs: leave them out")
