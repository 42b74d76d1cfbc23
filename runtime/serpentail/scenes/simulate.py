"""``scenario``: the motion of a scene's table [simulate], with start, legs and controller."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, overload

import numpy as np

from ..basics.checks import Refusals, did_you_mean, none_of, number, shown
from ..basics.errors import SimulationError
from ..basics.short_repr import brief
from ..model.model import Model
from ..motion.summary import Summary, summary
from ..motion.trajectory import Trajectory
from ..sequence.phase import Phase
from ..sequence.run import SequenceRun
from ..sequence.sequence import Sequence
from ..simulation.controllers.controller import Controller
from ..simulation.controllers.schedules import Legs, Reference
from ..simulation.methods import SETTINGS
from ..simulation.rollouts import Rollouts
from ..simulation.settle import settle
from ..simulation.simulate import simulate
from .acting import controller_of, legs_of, reference_of
from .file import model_of, read_scene, size_of, subtable
from .keys import read, sized
from .overrides import changed
from .phases import phases_of, refuse_beside_phases
from .simulate_keys import NUMBERS, SIMULATE
from .start import start_of


@dataclass(frozen=True, eq=False)
class Scenario:
    """A motion to simulate: a model, its start, and further arguments of ``simulate``.

    Attributes
    ----------
    model : Model
        The model.
    q0, v0 : ndarray, shapes (nq,) and (nv,)
        State at the start.
    duration : float
        Duration from t = 0 (s); of phases, each has its own.
    controller : controller or None
        As of ``simulate``; in phases it acts where a phase has no other.
    legs : Legs or None
        Leg angles over time.
    settings : dict
        Further arguments of ``simulate``.
    phases : tuple of Phase
        Phases of a sequence; empty for a single run.
    """

    model: Model
    q0: np.ndarray
    v0: np.ndarray
    duration: float
    controller: Controller = None
    legs: Legs | None = None
    settings: dict[str, Any] = field(default_factory=dict)
    phases: tuple[Phase, ...] = ()
    __repr__ = brief

    @overload
    def simulate(self) -> Trajectory: ...

    @overload
    def simulate(self, **changes: Any) -> Trajectory | Rollouts: ...

    def simulate(self, **changes: Any) -> Trajectory | Rollouts:
        """Make the motion.

        Parameters
        ----------
        **changes
            Arguments of ``serpentail.simulate`` that replace the scene's. With parameters of many
            runs the result is Rollouts. A scene with phases allows no changes here.

        Returns
        -------
        Trajectory or Rollouts
            The motion.

        Raises
        ------
        SimulationError
            The scene has phases and changes are given, or as of ``serpentail.simulate``.
        StateError, ModelError, PlanningError
            As of ``serpentail.simulate`` and ``Sequence.simulate``.
        """
        if self.phases:
            if changes:
                remedy = "change the scene's values, see ``scenario``"
                raise SimulationError(f"{next(iter(changes))}: this scene has phases: {remedy}")
            return self.sequence().trajectory
        arguments = {"controller": self.controller, "t_span": self.duration} | self.settings
        if self.legs is not None:
            arguments["legs"] = self.legs
        return simulate(self.model, self.q0, self.v0, **arguments | changes)

    def sequence(self) -> SequenceRun:
        """Make the motion of the scene's phases.

        Returns
        -------
        SequenceRun
            The motion and the outcome of each phase.

        Raises
        ------
        SimulationError, PlanningError
            As of ``Sequence.simulate``.
        """
        settings, angles = dict(self.settings), {}
        bristles = settings.pop("bristles0", None)
        if self.legs is not None:
            angles = dict(zip(("gamma", "delta"), self.legs.curve.at(0.0)[0], strict=False))
        sequence = Sequence(self.model, self.phases, settings=settings, **angles)
        return sequence.simulate(self.q0, self.v0, bristles)

    def summary(self, motion: Trajectory, errors: bool = False) -> Summary:
        """Return the numbers of a motion by name; see ``serpentail.summary``.

        Parameters
        ----------
        motion : Trajectory
            The motion.
        errors : bool, default False
            Whether to estimate the numerical error of each number.

        Returns
        -------
        Summary
            The numbers, SI.
        """
        return summary(self.model, motion, errors)


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
        "start.pitch" or "legs.moves.0.rate"; of phases, such as "phase.0.duration".

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
    scene, path = read_scene(path, SimulationError)
    table = subtable(scene, "simulate", path, SimulationError)

    # a change is of a key below [simulate], or of a parameter
    values = dict(changes or {})
    of_table = {
        name: value for name, value in values.items() if name.split(".")[0] in SIMULATE.keys
    }
    of_phases = {name: value for name, value in values.items() if name.split(".")[0] == "phase"}
    of_tables = of_table.keys() | of_phases.keys()
    parameters = {name: value for name, value in values.items() if name not in of_tables}
    _check_changes(parameters)
    model = model_of(scene, path, folder, parameters)
    phases = changed({"phase": scene.get("phase", [])}, of_phases)["phase"]
    return scenario_of(model, changed(table, of_table), path.parent, phases)


def _check_changes(parameters: Mapping) -> None:
    """Refuse names that cannot be parameters, before a model is made."""
    refused = Refusals(SimulationError)
    for name in parameters:
        near = did_you_mean(
            name.split(".")[0], [*SIMULATE.keys, "phase"]
        )  # no parameter is called so
        if near or "." in name:
            remedy = near or "needs a parameter, or a key below [simulate]"
            refused.add(name, f"change {shown(name)}: unknown; {remedy}")
    refused.tell()


def scenario_of(model: Model, table: Mapping, parent: Path, phases: Any = ()) -> Scenario:
    """Return the scenario of a table [simulate] and of tables [[phase]].

    Files in them are relative to ``parent``. SimulationError has a line for each error.
    """
    refused = Refusals(SimulationError)
    table = sized(read(table, SIMULATE, "simulate", refused), SIMULATE, size_of(model))
    settings = {name: table[name] for name in ("method", *NUMBERS) if name in table}
    _check_settings(settings, refused)
    duration: float | None = 0.0  # of phases, each has its own
    if phases:
        refuse_beside_phases(table, refused)
    elif "duration" not in table:
        refused.add("duration", "simulate.duration: no value: needs seconds")
    else:
        duration = refused.attempt("duration", _positive, "simulate.duration", table["duration"])

    # actuation; a straight tail replaces a refused reference, so that further errors are found
    legs = refused.attempt("legs", legs_of, table["legs"]) if "legs" in table else None
    reference = None
    if "reference" in table:
        straight = Reference([0.0, 1.0], np.zeros((2, model.layout.nt)))
        where = "simulate.reference"
        found = refused.attempt("reference", reference_of, where, model, table["reference"], parent)
        reference = found or straight
    law = table.get("controller", {"kind": "none"})
    controller = refused.attempt(
        "controller", controller_of, "simulate.controller", model, law, reference
    )
    start = table.get("start", {})
    state = refused.attempt("start", start_of, model, start, reference)
    found_phases = phases_of(model, phases, (controller, parent), refused)
    refused.tell()
    assert duration is not None and state is not None  # otherwise tell() has raised

    if "settle" in start:
        # actuation while a start settles
        acting = {name: value for name, value in settings.items() if name != "output_step"}
        acting |= {"controller": controller} | ({} if legs is None else {"legs": legs})
        q0, v0, settings["bristles0"] = settle(model, state[0], **acting | dict(start["settle"]))
        state = q0, v0
    return Scenario(model, *state, duration, controller, legs, settings, found_phases)


def _check_settings(settings: Mapping[str, Any], refused: Refusals) -> None:
    """Add an unknown method, and numbers that no method can have, to ``refused``."""
    unknown = none_of("simulate.method", settings.get("method", "auto"), ("auto", *SETTINGS))
    if unknown:
        refused.add("method", unknown)
    for name in NUMBERS:
        if name in settings:
            refused.attempt(name, _positive, f"simulate.{name}", settings[name])


def _positive(field: str, value: Any) -> float:
    """Return a number above 0."""
    return number(field, value, SimulationError, above=0)
