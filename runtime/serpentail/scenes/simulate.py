"""The motion that a scene file's table [simulate] asks for: start, legs, controller, settings."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, overload

import numpy as np

from ..brief import brief
from ..checks import Refusals, finite_array, none_of, number, one_of, refusal, shown
from ..errors import SimulationError
from ..model.layout import OMEGA, VELOCITY
from ..model.model import Model
from ..motion.summary import Summary, summary
from ..motion.trajectory import Trajectory
from ..simulation.controllers import Controller, Damping, Phases, TorqueTable
from ..simulation.methods import SETTINGS
from ..simulation.pfl import KD, KP, Pfl
from ..simulation.rollouts import Rollouts
from ..simulation.schedules import Legs, Reference, shared_among_links
from ..simulation.settle import check_settling, settle
from ..simulation.simulate import simulate
from .file import model_of, read_scene, subtable
from .keys import read
from .overrides import changed
from .simulate_keys import ANGLES, LAWS, NUMBERS, SIMULATE


@dataclass(frozen=True, eq=False)
class Scenario:
    """A motion to simulate: a model, its start (q0, v0), and what else ``st.simulate`` takes.

    duration (s) from t = 0 on; controller, legs as in ``simulate``; settings: the rest of its
    arguments.
    """

    model: Model
    q0: np.ndarray
    v0: np.ndarray
    duration: float
    controller: Controller = None
    legs: Legs | None = None
    settings: dict[str, Any] = field(default_factory=dict)
    __repr__ = brief

    @overload
    def simulate(self) -> Trajectory: ...

    @overload
    def simulate(self, **changes: Any) -> Trajectory | Rollouts: ...

    def simulate(self, **changes: Any) -> Trajectory | Rollouts:
        """Return the motion; changes replace arguments of ``st.simulate``.

        They may give parameters of many runs, whose motions are Rollouts.
        """
        arguments = {"controller": self.controller, "t_span": self.duration} | self.settings
        if self.legs is not None:
            arguments["legs"] = self.legs
        return simulate(self.model, self.q0, self.v0, **arguments | changes)

    def summary(self, motion: Trajectory) -> Summary:
        """Return the numbers of a motion by name: leap, landing, forces, books, effort; SI."""
        return summary(self.model, motion)


def scenario(
    path: str | Path, folder: str | Path | None = None, changes: Mapping | None = None
) -> Scenario:
    """Return what a scene file's table [simulate] describes.

    path: a scene file, or the name of an example; see ``examples``.
    folder: of its model, where that was generated; None: it is built, or was.
    changes: new values by name, of parameters of the model, or of keys below [simulate], such as
    "duration", "start.pitch" or "legs.moves.0.rate".
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
    parameters = {name: value for name, value in values.items() if name not in of_table}
    for name in parameters:
        if "." in name:
            raise SimulationError(
                f"change {shown(name)}: unknown; needs a parameter, or a key below [simulate]"
            )
    model = model_of(scene, path, folder, parameters)
    return scenario_of(model, changed(table, of_table), path.parent)


def scenario_of(model: Model, table: Mapping, parent: Path) -> Scenario:
    """Return the scenario of a table [simulate]; files in it are relative to ``parent``.

    SimulationError has a line for each thing that is wrong.
    """
    refused = Refusals(SimulationError)
    table = read(table, SIMULATE, "simulate", refused)
    settings = {name: table[name] for name in ("method", *NUMBERS) if name in table}
    _check_settings(settings, refused)
    if "duration" not in table:
        refused.add("duration", "simulate.duration: no value: needs seconds")
    duration = refused.attempt("duration", _positive, "simulate.duration", table.get("duration"))

    # what acts; a straight tail stands in for a reference that is refused, so that the rest is told
    legs = refused.attempt("legs", _legs, table["legs"]) if "legs" in table else None
    reference = None
    if "reference" in table:
        straight = Reference([0.0, 1.0], np.zeros((2, model.layout.nt)))
        found = refused.attempt("reference", _reference, model, table["reference"], parent)
        reference = found or straight
    law = table.get("controller", {"kind": "none"})
    controller = refused.attempt("controller", _controller, model, law, reference)
    start = table.get("start", {})
    state = refused.attempt("start", _start, model, start, reference)
    refused.tell()
    assert duration is not None and state is not None  # all has been told

    if "settle" in start:
        # what acts while a start settles
        acting = {name: value for name, value in settings.items() if name != "output_step"}
        acting |= {"controller": controller} | ({} if legs is None else {"legs": legs})
        q0, v0, settings["bristles0"] = settle(model, state[0], **acting | dict(start["settle"]))
        state = q0, v0
    return Scenario(model, *state, duration, controller, legs, settings)


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


def _legs(table: Mapping) -> Legs:
    missing = [name for name in ("gamma", "delta") if name not in table]
    if missing or {"moves", "times"} <= set(table):
        raise SimulationError(
            f"simulate.legs: value {shown(dict(table))}: needs gamma, delta, and moves or times, "
            "not both"
        )
    if "times" in table:
        return Legs(table["times"], table["gamma"], table["delta"])
    gamma, delta = (
        number(f"simulate.legs.{name}", table[name], SimulationError) for name in ("gamma", "delta")
    )
    return Legs.moves(gamma, delta, table.get("moves", []))


def _reference(model: Model, table: Mapping, parent: Path) -> Reference | Trajectory:
    """A Reference, or the Trajectory that `serpentail plan --save` wrote."""
    if set(table) == {"file"}:
        try:
            return Trajectory.load(parent / str(table["file"]))
        except (OSError, ValueError) as error:
            raise SimulationError(
                f"simulate.reference.file: value {shown(table['file'])}: {error}"
            ) from error
    if not {"times", "bends"} <= set(table) or "file" in table:
        raise SimulationError(
            f"simulate.reference: value {shown(dict(table))}: needs times and bends, or a file"
        )
    return Reference.of_bends(model, table["times"], table["bends"], table.get("blend", "quintic"))


def _controller(model: Model, value: Any, reference: Any) -> Controller:
    """One controller of a table, or of an array of tables with `begin` one after another."""
    if isinstance(value, Mapping):
        return _law(model, "simulate.controller", value, reference)
    if not isinstance(value, list) or not value:
        remedy = "needs a table, or tables under lines [[simulate.controller]], with begin"
        raise SimulationError(f"simulate.controller: value {shown(value)}: {remedy}")
    pairs = []
    for index, table in enumerate(value):
        where = f"simulate.controller[{index}]"
        if not isinstance(table, Mapping) or "begin" not in table:
            raise SimulationError(f"{where}: value {shown(table)}: needs a table with begin (s)")
        law = {name: value for name, value in table.items() if name != "begin"}
        begin = number(f"{where}.begin", table["begin"], SimulationError)
        pairs.append((begin, _law(model, where, law, reference)))
    return Phases(tuple(pairs))


def _law(model: Model, where: str, table: Mapping, reference: Any) -> Controller:
    """The controller of a table, by its kind."""
    kind = one_of(f"{where}.kind", table.get("kind"), LAWS, SimulationError)
    values = {name: value for name, value in table.items() if name != "kind"}
    if kind == "none":
        return None
    if kind == "damping":
        return Damping(**values)
    if kind == "torques":
        return TorqueTable(**{"times": None, "torques": None} | values)
    if reference is None:
        raise SimulationError(
            f"{where}: kind 'pfl' tracks a reference: add a table [simulate.reference]"
        )
    return Pfl(model, reference, **{"kp": KP, "kd": KD} | values)


def _start(model: Model, table: Mapping, reference: Any) -> tuple[np.ndarray, np.ndarray]:
    """Return q0 and v0, before it settles."""
    q = np.concatenate([_pose(table), _tail(model, table, reference)])
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
