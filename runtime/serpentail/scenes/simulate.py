"""Scenarios: a scene file with a table [simulate] goes in; its model, start, schedules and settings
come out.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ..checks import finite_array, number, one_of, refusal
from ..errors import SimulationError
from ..model.model import Model
from ..motion.summary import summary
from ..motion.trajectory import Trajectory
from ..pictures.filmstrip import filmstrip
from ..pictures.skeleton import leg_joints
from ..simulation.controllers import Controller, Damping, Phases, TorqueTable
from ..simulation.methods import SETTINGS
from ..simulation.pfl import KD, KP, Pfl
from ..simulation.schedules import Legs, Reference, shared_among_links
from ..simulation.settle import settle
from ..simulation.simulate import simulate
from .file import model_of, read_scene, subtable
from .overrides import changed

NUMBERS = (*dict.fromkeys(name for own in SETTINGS.values() for name in own), "output_step")
KEYS = ("duration", "method", *NUMBERS, "start", "legs", "reference", "controller")
ANGLES = ("pitch", "roll", "yaw")
START = ("height", *ANGLES, "bends", "velocity", "rate", "settle")
LEGS = ("gamma", "delta", "moves", "times")
REFERENCE = ("times", "bends", "blend", "file")
LAWS = {  # kinds of controllers and what each has
    "none": (),
    "damping": ("damping",),
    "pfl": ("kp", "kd", "feedforward"),
    "torques": ("times", "torques", "damping"),
}


@dataclass(frozen=True, eq=False)
class Scenario:
    """A motion to simulate: a model, its start (q0, v0), and what ``st.simulate`` takes besides, as
    data.

    duration (s) from t = 0 on; controller, legs as in ``simulate``; settings: the rest of its
    arguments.
    """

    model: Model
    q0: np.ndarray
    v0: np.ndarray
    duration: float
    controller: Controller = None
    legs: Legs | None = None
    settings: dict = field(default_factory=dict)

    def simulate(self, **changes) -> Trajectory:
        """Return the motion; changes are arguments of ``st.simulate`` that take the place of the
        scenario's.
        """
        own = {"controller": self.controller, "t_span": self.duration} | self.settings
        own |= {} if self.legs is None else {"legs": self.legs}
        return simulate(self.model, self.q0, self.v0, **own | changes)

    def film(self, motion: Trajectory, path: str | Path, frames: int | Sequence[float] = 8) -> Path:
        """Draw moments of a motion: torso, legs, tail and the ground's forces; frames: how many, or
        their times (s).

        They are drawn about the centre of mass, or about the torso where the scene left out the
        function ``center_of_mass``.
        """
        model, p = self.model, self.model.parameters
        com = None
        if "center_of_mass" in model.kernels:
            com = model.center_of_mass(motion.q, motion.v)[0]
        look = {"tail_mount": p["tail_mount"]}
        look |= {"semi_axes": p["torso_semi_axes"]} if "torso_semi_axes" in p else {}
        look |= (
            {}
            if self.legs is None
            else {"legs": leg_joints(model, motion, self.legs.curve.at(motion.t)[0])}
        )
        return filmstrip(
            motion,
            model.tail_points(motion.q),
            path,
            frames,
            com=com,
            **look,
        )

    def summary(self, motion: Trajectory) -> dict:
        """Return what a motion came to: take-off, apex, how it ends, peak forces, steps and time;
        SI.
        """
        return summary(self.model, motion)


def scenario(
    path: str | Path, folder: str | Path | None = None, changes: Mapping | None = None
) -> Scenario:
    """Return what a scene file's table [simulate] describes.

    folder: the generated one, by default generated/<scene>, made first where it is missing.
    changes: new values by name, of parameters of the model, or of keys below [simulate], such as
    "duration",
    "start.pitch" or "legs.moves.0.rate".
    Raises SimulationError with field, value and remedy, ModelError where parameters are wrong or
    the folder is of
    another scene.
    """
    scene = read_scene(path, SimulationError)
    table = subtable(scene, "simulate", path, SimulationError)
    own = {name: value for name, value in (changes or {}).items() if name.split(".")[0] in KEYS}
    parameters = {name: value for name, value in (changes or {}).items() if name not in own}
    for name in parameters:
        if "." in name:
            raise SimulationError(
                f"change {name!r}: unknown; needs a parameter, or a key below [simulate]"
            )
    model = model_of(scene, path, folder, parameters)
    return scenario_of(model, changed(table, own), Path(path).parent)


def scenario_of(model: Model, table: Mapping, parent: Path) -> Scenario:
    """Return the scenario of a table [simulate]; files in it are relative to ``parent``."""
    _checked("simulate", table, KEYS)
    if "duration" not in table:
        raise SimulationError("simulate.duration: no value: needs seconds")
    legs = _legs(table["legs"]) if "legs" in table else None
    reference = _reference(model, table["reference"], parent) if "reference" in table else None
    acting = {
        "controller": _controller(model, table.get("controller", {"kind": "none"}), reference)
    }
    acting |= {} if legs is None else {"legs": legs}
    settings = {name: table[name] for name in ("method", *NUMBERS) if name in table}
    start = _start(model, table.get("start", {}), reference, acting | _of_settling(settings))
    q0, v0, still = start
    return Scenario(
        model,
        q0,
        v0,
        number("simulate.duration", table["duration"], SimulationError, above=0),
        settings=settings | still,
        **acting,
    )


def _of_settling(settings: dict) -> dict:
    return {name: value for name, value in settings.items() if name != "output_step"}


def _checked(where: str, table, names) -> Mapping:
    if not isinstance(table, Mapping):
        raise SimulationError(f"{where}: value {table!r}: needs a table, under a line [{where}]")
    for name in table:
        one_of(f"{where}: key", name, names, SimulationError)
    return table


def _legs(table) -> Legs:
    table = _checked("simulate.legs", table, LEGS)
    missing = [name for name in ("gamma", "delta") if name not in table]
    if missing or {"moves", "times"} <= set(table):
        raise SimulationError(
            f"simulate.legs: value {dict(table)!r}: needs gamma, delta, and moves or times, not "
            "both"
        )
    if "times" in table:
        return Legs(table["times"], table["gamma"], table["delta"])
    start = [
        number(f"simulate.legs.{name}", table[name], SimulationError) for name in ("gamma", "delta")
    ]
    return Legs.moves(*start, table.get("moves", []))


def _reference(model: Model, table, parent: Path):
    """A Reference, or the Trajectory that `serpentail plan --save` wrote."""
    table = _checked("simulate.reference", table, REFERENCE)
    if set(table) == {"file"}:
        try:
            return Trajectory.load(parent / str(table["file"]))
        except (OSError, ValueError) as error:
            raise SimulationError(
                f"simulate.reference.file: value {table['file']!r}: {error}"
            ) from error
    if not {"times", "bends"} <= set(table) or "file" in table:
        raise SimulationError(
            f"simulate.reference: value {dict(table)!r}: needs times and bends, or a file"
        )
    return Reference.of_bends(model, table["times"], table["bends"], table.get("blend", "quintic"))


def _controller(model: Model, given, reference) -> Controller:
    """One controller of a table, or of an array of tables with `begin` one after another."""
    if isinstance(given, Mapping):
        return _law(model, "simulate.controller", given, reference)
    if not isinstance(given, list) or not given:
        remedy = "needs a table, or tables under lines [[simulate.controller]], with begin"
        raise SimulationError(f"simulate.controller: value {given!r}: {remedy}")
    pairs = []
    for index, table in enumerate(given):
        where = f"simulate.controller[{index}]"
        if not isinstance(table, Mapping) or "begin" not in table:
            raise SimulationError(f"{where}: value {table!r}: needs a table with begin (s)")
        law = {name: value for name, value in table.items() if name != "begin"}
        begin = number(f"{where}.begin", table["begin"], SimulationError)
        pairs.append((begin, _law(model, where, law, reference)))
    return Phases(tuple(pairs))


def _law(model: Model, where: str, table: Mapping, reference) -> Controller:
    kind = table.get("kind")
    one_of(f"{where}.kind", kind, LAWS, SimulationError)
    own = {
        name: value
        for name, value in _checked(where, table, ("kind", *LAWS[kind])).items()
        if name != "kind"
    }
    if kind == "none":
        return None
    if kind == "damping":
        return Damping(**own)
    if kind == "torques":
        return TorqueTable(**{"times": None, "torques": None} | own)
    if reference is None:
        raise SimulationError(
            f"{where}: kind 'pfl' tracks a reference: add a table [simulate.reference]"
        )
    return Pfl(model, reference, **{"kp": KP, "kd": KD} | own)


def _start(model: Model, table, reference, acting: dict) -> tuple[np.ndarray, np.ndarray, dict]:
    """Return q0, v0 and the bristles, where it settled."""
    table = _checked("simulate.start", table, START)
    q = np.concatenate([_pose(table), _tail(model, table, reference)])
    v = np.zeros(model.nv)
    for name, rows in (("velocity", slice(0, 3)), ("rate", slice(3, 6))):
        v[rows] = _three(f"simulate.start.{name}", table.get(name, (0, 0, 0)))
    if "settle" not in table:
        return q, v, {}
    if v.any():
        raise SimulationError(
            "simulate.start.settle: a start that settles has no velocity and no rate: remove them"
        )
    rest = _checked("simulate.start.settle", table["settle"], ("rounds", "duration"))
    q, v, bristles = settle(model, q, **acting | dict(rest))
    return q, v, {"bristles0": bristles}


def _pose(table) -> np.ndarray:
    """Position and quaternion of R = Rz(yaw) Rx(pitch) Ry(roll)."""
    from scipy.spatial.transform import Rotation

    height, pitch, roll, yaw = (
        number(f"simulate.start.{name}", table.get(name, 0.0), SimulationError)
        for name in ("height", *ANGLES)
    )
    turn = Rotation.from_euler("ZXY", [yaw, pitch, roll])
    return np.array([0, 0, height, *np.roll(turn.as_quat(), 1)])


def _tail(model: Model, table, reference) -> np.ndarray:
    """Tail coordinates: of the bends given, else of the reference at t = 0, else straight."""
    if "bends" in table:
        bends = finite_array("simulate.start.bends", table["bends"], SimulationError)
        return shared_among_links(model, bends[None])[0]
    curve = getattr(reference, "curve", None)
    return np.zeros(model.nv - 6) if curve is None else curve.at(0.0)[0]


def _three(name: str, value) -> np.ndarray:
    array = finite_array(name, value, SimulationError)
    if array.shape != (3,):
        raise refusal(name, value, "three numbers", SimulationError)
    return array
