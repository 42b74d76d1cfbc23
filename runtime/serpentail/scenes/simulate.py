"""The motion that a scene file's table [simulate] asks for: start, legs, controller, settings."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, overload

import numpy as np

from ..brief import brief
from ..checks import Refusals, did_you_mean, finite_array, none_of, number, refusal, shown
from ..errors import SimulationError
from ..model.layout import OMEGA, VELOCITY
from ..model.model import Model
from ..motion.summary import Summary, summary
from ..motion.trajectory import Trajectory
from ..sequence.phase import Phase
from ..sequence.sequence import Sequence, SequenceRun
from ..simulation.controllers import Controller
from ..simulation.methods import SETTINGS
from ..simulation.rollouts import Rollouts
from ..simulation.schedules import Legs, Reference, shared_among_links
from ..simulation.settle import check_settling, settle
from ..simulation.simulate import simulate
from .acting import controller_of, legs_of, reference_of
from .file import model_of, read_scene, size_of, subtable
from .keys import read, sized
from .overrides import changed
from .phases import phases_of, refuse_beside_phases
from .simulate_keys import ANGLES, NUMBERS, SIMULATE


@dataclass(frozen=True, eq=False)
class Scenario:
    """A motion to simulate: a model, its start (q0, v0), and what else ``st.simulate`` takes.

    duration (s) from t = 0 on; controller, legs as in ``simulate``; settings: the rest of its
    arguments.  phases: of a sequence, see ``Sequence``; the controller acts in those without one.
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
        """Return the motion; changes replace arguments of ``st.simulate``.

        They may give parameters of many runs, whose motions are Rollouts.  Of a sequence nothing
        can be changed here.
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
        """Return the motion of the scene's phases, and how each went."""
        settings, angles = dict(self.settings), {}
        bristles = settings.pop("bristles0", None)
        if self.legs is not None:
            angles = dict(zip(("gamma", "delta"), self.legs.curve.at(0.0)[0], strict=False))
        sequence = Sequence(self.model, self.phases, settings=settings, **angles)
        return sequence.simulate(self.q0, self.v0, bristles)

    def summary(self, motion: Trajectory) -> Summary:
        """Return the numbers of a motion by name: leap, landing, forces, books, effort; SI."""
        return summary(self.model, motion)


def scenario(
    path: str | Path, folder: str | Path | None = None, changes: Mapping | None = None
) -> Scenario:
    """Return what a scene file's table [simulate], and its tables [[phase]], describe.

    path: a scene file, or the name of an example; see ``examples``.
    folder: of its model, where that was generated; None: it is built, or was.
    changes: new values by name, of parameters of the model, or of keys below [simulate], such as
    "duration", "start.pitch" or "legs.moves.0.rate", or of phases, such as "phase.0.duration".
    Raises SimulationError with field, value and remedy, ModelError where parameters are wrong or
    the folder is of another scene.
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
    """Refuse names of what can be no parameters, before any model is made."""
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
    """Return the scenario of a table [simulate], and of tables [[phase]]; files in them are
    relative to ``parent``.

    SimulationError has a line for each thing that is wrong.
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

    # what acts; a straight tail stands in for a reference that is refused, so that the rest is told
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
    state = refused.attempt("start", _start, model, start, reference)
    found_phases = phases_of(model, phases, (controller, parent), refused)
    refused.tell()
    assert duration is not None and state is not None  # all has been told

    if "settle" in start:
        # what acts while a start settles
        acting = {name: value for name, value in settings.items() if name != "output_step"}
        acting |= {"controller": controller} | ({} if legs is None else {"legs": legs})
        q0, v0, settings["bristles0"] = settle(model, state[0], **acting | dict(start["settle"]))
        state = q0, v0
    return Scenario(model, *state, duration, controller, legs, settings, found_phases)


def _check_settings(settings: Mapping[str, Any], refused: Refusals) -> None:
    """Note a method that is none, and numbers that no method can have."""
    unknown = none_of("simulate.method", settings.get("method", "auto"), ("auto", *SETTINGS))
    if unknown:
        refused.add("method", unknown)
    for name in NUMBERS:
        if name in settings:
            refused.attempt(name, _positive, f"simulate.{name}", settings[name])


def _positive(field: str, value: Any) -> float:
    """Return a number above 0."""
    return number(field, value, SimulationError, above=0)


def _start(model: Model, table: Mapping, reference: Any) -> tuple[np.ndarray, np.ndarray]:
    """Return q0 and v0, before it settles."""
    tail = _tail(model, table, reference)
    if model.fixed:
        of_torso = [f"simulate.start.{name}" for name in table if name != "bends"]
        if of_torso:
            raise SimulationError(
                f"{of_torso[0]}: this scene has a fixed base, whose start has `bends` alone: "
                'remove it, or set base = "free"'
            )
        return tail, np.zeros(model.nv)
    q = np.concatenate([_pose(table), tail])
    v = np.zeros(model.nv)
    v[VELOCITY] = _three("simulate.start.velocity", table.get("velocity", (0, 0, 0)))
    v[OMEGA] = _three("simulate.start.rate", table.get("rate", (0, 0, 0)))
    if "settle" in table:
        check_settling(model, **table["settle"])
        if v.any():
            raise SimulationError(
                "simulate.start.settle: a start that settles has no velocity and no rate: remove "
                "them"
            )
    return q, v


def _pose(table: Mapping) -> np.ndarray:
    """Position and quaternion of R = Rz(yaw) Rx(pitch) Ry(roll)."""
    from scipy.spatial.transform import Rotation

    height, pitch, roll, yaw = (
        number(f"simulate.start.{name}", table.get(name, 0.0), SimulationError)
        for name in ("height", *ANGLES)
    )
    rotation = Rotation.from_euler("ZXY", [yaw, pitch, roll])
    return np.array([0, 0, height, *np.roll(rotation.as_quat(), 1)])


def _tail(model: Model, table: Mapping, reference: Any) -> np.ndarray:
    """Tail coordinates: of the bends given, else of the reference at t = 0, else straight."""
    if "bends" in table:
        bends = finite_array("simulate.start.bends", table["bends"], SimulationError)
        return shared_among_links(model, bends[None])[0]
    curve = getattr(reference, "curve", None)
    return np.zeros(model.layout.nt) if curve is None else curve.at(0.0)[0]


def _three(name: str, value: Any) -> np.ndarray:
    array = finite_array(name, value, SimulationError)
    if array.shape != (3,):
        raise refusal(name, value, "three numbers", SimulationError)
    return array
