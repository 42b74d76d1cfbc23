"""What a motion, or many, hold: arrays with named dimensions, units and words, and plain facts."""

import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...basics.attitude import Array
from ...motion.contact import Contact
from ...motion.trajectory import Trajectory
from ...simulation.rollouts import Rollouts
from .labels import AXES, LEGS, TORSO_Q, TORSO_V, joints, points

NAME = re.compile("[A-Za-z_][A-Za-z0-9_]*")
MEASURES = {
    "kinetic": ((), "J", "kinetic energy"),
    "potential": ((), "J", "potential energy"),
    "linear_momentum": (("axis",), "kg m/s", "linear momentum, world"),
    "angular_momentum": (("axis",), "kg m^2/s", "angular momentum about the centre of mass, world"),
}
TOUCHING = {
    "points": (("point", "axis"), "m", "points that can touch the ground, world"),
    "forces": (("point", "axis"), "N", "force of the ground at each of them, world"),
    "bristles": (("point", "plane"), "m", "stretch of the friction springs"),
    "legs": (("leg",), "rad", "angles of the legs"),
}


@dataclass(frozen=True, eq=False)
class Variable:
    """An array, its dimensions, its unit, or one of each label of its last dimension, and words."""

    dims: tuple[str, ...]
    values: np.ndarray
    units: str | Sequence[str]
    words: str

    @property
    def unit(self) -> str:
        """Its unit, or its units in the order of the labels, each once."""
        return self.units if isinstance(self.units, str) else ", ".join(dict.fromkeys(self.units))


@dataclass(frozen=True, eq=False)
class Contents:
    """Labels of all dimensions, leading dimensions (time, or run and time), variables, facts."""

    leading: tuple[str, ...]
    labels: dict[str, Sequence[Any]]
    groups: Sequence[str]  # of each point
    variables: dict[str, Variable]
    facts: dict[str, Any]


def contents(motion: Trajectory | Rollouts) -> Contents:
    """Return the content of a trajectory or of rollouts, SI.

    Arrays are (time, ...) or (run, time, ...), with nan after the end of a run.
    """
    if isinstance(motion, Rollouts):
        return _of_runs(motion)
    segments = motion.segments
    names = joints(segments, motion.model)
    labels: dict[str, Any] = {"time": motion.t} | _labels(names, motion.layout.fixed)
    variables, groups = _states(motion, labels, ("time",)), _groups(motion.contact)
    if motion.contact is not None:
        labels |= _touch_labels(motion.contact)
        for name, array in motion.contact.arrays.items():
            variables[name] = _variable(TOUCHING[name], ("time",), array)
    return Contents(("time",), labels, groups, variables, facts(motion.info))


def _of_runs(runs: Rollouts) -> Contents:
    """What rollouts hold: of each run also when it ended, its error, and its own parameters."""
    leading, model = ("run", "time"), runs.source.model
    labels: dict[str, Any] = {"run": np.arange(len(runs)), "time": runs.t}
    labels |= _labels(joints(model.segments, model), model.fixed)
    variables = _states(runs, labels, leading)
    contact, touching = _contacts(runs)
    if contact is not None:
        labels |= _touch_labels(contact)
        for name, array in touching.items():
            variables[name] = _variable(TOUCHING[name], leading, array)
    variables["ends"] = Variable(("run",), runs.ends, "s", "when the run ended")
    errors = np.array(["" if error is None else str(error) for error in runs.errors])
    variables["errors"] = Variable(("run",), errors, "", "what ended the run early")
    entries = {entry["name"]: entry for entry in model.manifest["parameters"]}
    for name, values in runs.source.parameters.changes.items():
        dims = ("run", "axis")[: values.ndim]
        entry = entries[name]
        variables[name] = Variable(dims, values, entry["unit"], entry["meaning"])
    return Contents(leading, labels, _groups(contact), variables, facts(runs.info))


def _states(
    motion: Any, labels: Mapping[str, Any], leading: tuple[str, ...]
) -> dict[str, Variable]:
    """States, torques and measures, which both kinds have under the same names."""
    tail = len(labels.get("joint", ()))
    of_torso = len(labels["coordinate"]) > tail
    q_units = [*(TORSO_Q.values() if of_torso else ()), *["rad"] * tail]
    v_units = [*(TORSO_V.values() if of_torso else ()), *["rad/s"] * tail]
    found = {
        "q": Variable((*leading, "coordinate"), motion.q, q_units, "configuration"),
        "v": Variable((*leading, "rate"), motion.v, v_units, "velocity"),
    }
    if tail:
        found["tau"] = Variable((*leading, "joint"), motion.tau, "N m", "torques of the tail")
    measures = {
        name: _variable(entry, leading, getattr(motion, name)) for name, entry in MEASURES.items()
    }
    return found | measures


def _variable(
    entry: tuple[tuple[str, ...], str, str], leading: tuple[str, ...], array: np.ndarray
) -> Variable:
    dims, units, words = entry
    return Variable((*leading, *dims), array, units, words)


def _labels(tail: list[str], fixed: bool) -> dict[str, Any]:
    """Labels of the dimensions that every motion has; none of a torso on a fixed base."""
    return {
        "coordinate": [*(() if fixed else TORSO_Q), *tail],
        "rate": [*(() if fixed else TORSO_V), *(f"{name}_dot" for name in tail)],
        "axis": AXES,
    } | ({"joint": tail} if tail else {})


def _touch_labels(contact: Contact) -> dict[str, Any]:
    """Labels of the dimensions of a motion on the ground."""
    legs = {} if contact.legs is None else {"leg": LEGS}
    return {"point": points(contact.groups), "plane": AXES[:2]} | legs


def _groups(contact: Contact | None) -> list[str]:
    """The group of each point."""
    groups = {} if contact is None else contact.groups
    return [name for name, count in groups.items() for _ in range(count)]


def _contacts(runs: Rollouts) -> tuple[Contact | None, dict[str, Array]]:
    """Return the first contact of runs, and the arrays (k, s, ...) of all; nan without contact."""
    first: Contact | None = None
    arrays: dict[str, Array] = {}
    for k in range(len(runs)) if runs.source.model.contacts else ():
        contact = _contact(runs, k)
        if contact is None:
            continue
        if first is None:
            first, shape = contact, (len(runs), len(runs.t))
            arrays = {
                name: np.full((*shape, *array.shape[1:]), np.nan)
                for name, array in contact.arrays.items()
            }
        for name, array in contact.arrays.items():
            arrays[name][k, : len(array)] = array
    return first, arrays


def _contact(runs: Rollouts, k: int) -> Contact | None:
    """Return the contact of run k at the times that it reached; None without contact or samples."""
    error = runs.errors[k]
    motion: Trajectory | None = runs[k] if error is None else error.trajectory
    if motion is None or motion.contact is None:
        return None
    done = runs.source.outcomes[k].done
    return motion.contact.mapped(lambda samples: samples[:done])


def facts(info: Mapping[str, Any]) -> dict[str, Any]:
    """Return the plain values of an info by their names, and all of it as a text of JSON, "info".

    Files know no truth values: they are 0 and 1.
    """
    plain: dict[str, Any] = {}
    for name, value in info.items():
        if isinstance(value, bool | int):
            plain[name] = int(value) if abs(value) < 2**31 else float(value)
        elif isinstance(value, float | str):
            plain[name] = value
    # names that every program reads
    sound = {name: value for name, value in plain.items() if NAME.fullmatch(name)}
    return sound | {"info": json.dumps(info)}
