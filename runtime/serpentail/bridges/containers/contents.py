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

NAME = re.compile("[A-Za-z_][A-Za-z0-9_]*")
AXES = ("x", "y", "z")
LEGS = ("gamma_right", "delta_right", "gamma_left", "delta_left")
FOOT = ("right_A", "right_M", "right_T", "left_A", "left_M", "left_T")
# dimensions, unit and meaning of the arrays of motions; None: each number has its own unit
ARRAYS: dict[str, tuple[tuple[str, ...], str | None, str]] = {
    "q": (("coordinate",), None, "configuration"),
    "v": (("rate",), None, "velocity"),
    "tau": (("joint",), "N m", "torques of the tail"),
    "kinetic": ((), "J", "kinetic energy"),
    "potential": ((), "J", "potential energy"),
    "linear_momentum": (("axis",), "kg m/s", "linear momentum, world"),
    "angular_momentum": (("axis",), "kg m^2/s", "angular momentum about the centre of mass, world"),
    # on the ground
    "points": (("point", "axis"), "m", "points that can touch the ground, world"),
    "forces": (("point", "axis"), "N", "force of the ground at each of them, world"),
    "bristles": (("point", "plane"), "m", "stretch of the friction springs"),
    "legs": (("leg",), "rad", "angles of the legs"),
}


@dataclass(frozen=True, eq=False)
class Quantity:
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
    """Labels of all dimensions, leading dimensions (time, or run and time), quantities, facts."""

    leading: tuple[str, ...]
    labels: dict[str, Sequence[Any]]
    groups: Sequence[str]  # of each point
    quantities: dict[str, Quantity]
    facts: dict[str, Any]


def contents(motion: Trajectory | Rollouts) -> Contents:
    """Return the content of a trajectory or of rollouts, SI.

    Arrays are (time, ...) or (run, time, ...), with nan after the end of a run.
    """
    labels: dict[str, Any] = {"time": motion.t}
    if isinstance(motion, Rollouts):
        labels = {"run": np.arange(len(motion))} | labels
        names = motion.source.model.names
        contact, touching = _contacts(motion)
    else:
        names, contact = motion.names, motion.contact
        touching = {} if contact is None else contact.arrays
    leading = tuple(labels)

    # names of the numbers
    labels |= {"coordinate": [*names.q], "rate": [*names.v], "axis": AXES}
    labels |= {"joint": [*names.tail]} if names.tail else {}
    groups = {} if contact is None else contact.groups
    if contact is not None:
        labels |= {"point": points(groups), "plane": AXES[:2]}
        labels |= {} if contact.legs is None else {"leg": LEGS}

    own_units = {"q": [*names.q.values()], "v": [*names.v.values()]}
    quantities = {}
    for name, (dims, unit, words) in ARRAYS.items():
        if set(dims) <= labels.keys():
            values = touching[name] if name in touching else getattr(motion, name)
            units = own_units[name] if unit is None else unit
            quantities[name] = Quantity((*leading, *dims), values, units, words)
    if isinstance(motion, Rollouts):
        quantities |= _of_runs(motion)
    each_group = [name for name, count in groups.items() for _ in range(count)]
    return Contents(leading, labels, each_group, quantities, facts(motion.info))


def points(groups: Mapping[str, int]) -> list[str]:
    """Return the names of the points that touch the ground, such as feet_right_A, tail_1."""
    names = []
    for group, count in groups.items():
        numbered = tuple(str(k + 1) for k in range(count))
        whole = (group, count) == ("feet", len(FOOT))
        names += [f"{group}_{name}" for name in (FOOT if whole else numbered)]
    return names


def _of_runs(runs: Rollouts) -> dict[str, Quantity]:
    """When each run ended, its error, and its own parameters."""
    errors = np.array(["" if error is None else str(error) for error in runs.errors])
    quantities = {
        "ends": Quantity(("run",), runs.ends, "s", "when the run ended"),
        "errors": Quantity(("run",), errors, "", "what ended the run early"),
    }
    entries = {entry["name"]: entry for entry in runs.source.model.manifest["parameters"]}
    for name, values in runs.source.parameters.changes.items():
        dims, entry = ("run", "axis")[: values.ndim], entries[name]
        quantities[name] = Quantity(dims, values, entry["unit"], entry["meaning"])
    return quantities


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

    Files know no truth values: they are 0 and 1. A name is left out that not every program reads.
    """
    plain: dict[str, Any] = {}
    for name, value in info.items():
        if not NAME.fullmatch(name):
            continue
        if isinstance(value, bool | int):
            plain[name] = int(value) if abs(value) < 2**31 else float(value)
        elif isinstance(value, float | str):
            plain[name] = value
    return plain | {"info": json.dumps(info)}
