"""``scenario``: reads the motion of a scene's tables [simulate] and [[phase]]."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ..basics.checks import (
    Refusals,
    number,
    one_of,
    refusal,
)
from ..basics.errors import SimulationError
from ..model.model import Model
from ..model.state import State, state_of
from ..simulation.controllers.schedules import Reference
from ..simulation.methods import SETTINGS
from ..simulation.settle import check_settling, refuse_moving, settle
from .controllers import controller_of, legs_of, loads_of, prescribed_of, reference_of
from .file import model_of, read_scene, size_of, subtable, values_of
from .overrides import changed, split_changes
from .phases import phases_of, refuse_beside_phases
from .scenario import Scenario
from .simulate_keys import NUMBERS, SIMULATE


def scenario(
    path: str | Path, folder: str | Path | None = None, changes: Mapping | None = None
) -> Scenario:
    """Read the motion that a scene file describes in [simulate] and [[phase]].

    Parameters
    ----------
    path : str or path
        A scene file, or the name of an example (see ``examples``).
    folder : str or path, optional
        Generated folder of its model. Default: the model is built, or taken from the cache.
    changes : mapping, optional
        New values by name: of the model's parameters; of keys of [simulate], such as "duration",
        "start.pitch", "simulate.output_step" or "legs.moves.0.rate"; of phases, such as
        "phase.push.duration".

    Returns
    -------
    Scenario
        The motion to simulate.

    Raises
    ------
    SimulationError
        A key is wrong; the message names field, value and remedy of each.
    ModelError
        A parameter is wrong, or the folder belongs to another scene.

    Examples
    --------
    >>> import serpentail as st
    >>> kick = st.scenario("kick", changes={"duration": 0.5})  # doctest: +SKIP
    >>> print(kick.summary(kick.simulate()))  # doctest: +SKIP
    """
    if isinstance(folder, Mapping):
        raise refusal("folder", folder, "a path: give changes={...} by name", SimulationError)
    scene, path = read_scene(path, SimulationError)
    table = subtable(scene, "simulate", path, SimulationError)

    parts = split_changes(changes, {"simulate": SIMULATE.keys, "phase": ["phase"]}, SimulationError)
    model = model_of(scene, path, folder, parts["parameters"])
    phases = changed({"phase": scene.get("phase", [])}, parts["phase"])["phase"]
    return scenario_of(model, changed(table, parts["simulate"]), path.parent, phases)


def scenario_of(model: Model, table: Mapping, parent: Path, phases: Any = ()) -> Scenario:
    """Return the scenario of a table [simulate] and of tables [[phase]].

    Files in them are relative to ``parent``. SimulationError has a line for each error.
    """
    refused = Refusals(SimulationError)
    table = values_of(table, SIMULATE, "simulate", size_of(model), refused)
    settings = _settings(table, refused)
    duration: float | None = 0.0  # of phases, each has its own
    if phases:
        refuse_beside_phases(table, refused)
    elif "duration" not in table:
        refused.add("duration", "simulate.duration: no value: needs seconds")
    else:
        duration = refused.attempt("duration", _positive, "simulate.duration", table["duration"])

    # actuation; a straight tail replaces a refused reference, so that further errors are found
    legs = refused.attempt("legs", legs_of, table["legs"]) if "legs" in table else None
    if "prescribed" in table:
        schedule = refused.attempt("prescribed", prescribed_of, table["prescribed"])
        if schedule is not None:
            times = np.asarray(schedule.times) * size_of(model).get("s", 1.0)
            settings["prescribed"] = replace(schedule, times=times)
    if "load" in table:
        settings["load"] = refused.attempt("load", loads_of, table["load"])
    reference = None
    if "reference" in table:
        straight = Reference([0.0, 1.0], np.zeros((2, model.layout.nt)))
        where = "simulate.reference"
        reference = refused.attempt(
            "reference", reference_of, where, model, table["reference"], parent
        )
        reference = reference or straight
    law = table.get("controller", {"kind": "none"})
    controller = refused.attempt(
        "controller", controller_of, "simulate.controller", model, law, reference
    )
    start = table.get("start", {})
    state = refused.attempt("start", start_of, model, start, reference)
    checked_phases = phases_of(model, phases, controller, parent, refused)
    refused.tell()
    assert duration is not None and state is not None  # otherwise tell() has raised

    if "settle" in start:
        # actuation while a start settles
        acting = {name: value for name, value in settings.items() if name != "output_step"}
        acting |= {"controller": controller} | ({} if legs is None else {"legs": legs})
        q0, v0, settings["bristles0"] = settle(model, state, **acting | dict(start["settle"]))
    else:
        q0, v0 = (array.copy() for array in state)
    return Scenario(model, q0, v0, duration, controller, legs, settings, checked_phases)


def _settings(table: Mapping[str, Any], refused: Refusals) -> dict[str, Any]:
    """Return the method and its numbers; refuse those that no method can have."""
    methods, method = ("auto", *SETTINGS), table.get("method", "auto")
    refused.attempt("method", one_of, "simulate.method", method, methods, SimulationError)
    for name in NUMBERS:
        if name in table:
            refused.attempt(name, _positive, f"simulate.{name}", table[name])
    return {name: table[name] for name in ("method", *NUMBERS) if name in table}


def _positive(field: str, value: Any) -> float:
    """Return a number above 0."""
    return number(field, value, SimulationError, above=0)


def start_of(model: Model, table: Mapping, reference: Any) -> State:
    """Return the state of a table [simulate.start], before the model settles.

    The tail has the given bends, else those of the reference at t = 0, else none.
    """
    curve = getattr(reference, "curve", None)
    tail = None if curve is None else curve.at(0.0)[0]
    words = {name: value for name, value in table.items() if name != "settle"}
    state = state_of(model, words, "simulate.start", SimulationError, tail)
    if "settle" in table:
        check_settling(model, **table["settle"])
        refuse_moving("simulate.start.settle", state)
    return state
