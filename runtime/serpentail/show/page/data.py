"""What the page reads: runs with their samples, numbers, events; plots, notes and warnings."""

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from ...model.model import Model
from ...model.weight import weight_of
from ...motion.numbers import UNITS
from ...motion.plausibility import warnings_of
from ...motion.summary import summary
from ...motion.text import as_word
from ...motion.trajectory import Trajectory
from ..animal import BELLY, JOINT, THINNEST, Animal, animal_of
from .samples import packed, samples, thinned

COMMON = 95  # percentile of the forces whose arrow is as long as half the torso
MOST_EVENTS = 1000  # that a page has
LABELS = {  # of the numbers that the page shows
    "duration_s": "duration",
    "take_off_s": "take-off",
    "recontact_s": "landing",
    "landed": "landed, and stands at the end",
    "least_upright_landing": "least upright from the landing on",
    "turned_landing_rad": "turned from the landing on",
    "torso_rate_at_touch_down": "spin at the landing",
    "angular_momentum_at_take_off": "angular momentum",
    "apex_m": "highest torso",
    "com_rise_m": "rise of the centre of mass",
    "tilt_max_deg": "largest tilt of the back",
    "tilt_end_deg": "tilt at the end",
    "impulse_N_s": "impulse of ground, loads and air",
    "peak_ground_force_N": "largest force of the ground",
    "peak_ground_force_weights": "largest force of the ground",
    "peak_group_force_N": "largest force",
    "peak_torque_N_m": "largest joint torque",
    "energy_change_J": "energy gained",
}
# plots: title by array, and the least span of an axis, in its unit
TITLES = {
    "height": "height of the torso (m)",
    "tilt": "tilt of the back (deg)",
    "bends": "bends of the tail's segments (deg)",
    "torque": "joint torques (N m)",
    "force": "force of the ground (N), scale compressed",
    "momentum": "angular momentum about the centre of mass (kg m^2/s)",
    "energy": "energy (J)",
}
LEAST = {"height": 1e-3, "tilt": 0.1, "bends": 0.1, "momentum": 1e-9}


def page_data(
    motions: list[Trajectory], names: list[str], models: list[Model], most: int
) -> dict[str, Any]:
    """Return the data of the page, ready for JSON; most: largest number of samples of a run."""
    shown, notes, warnings, runs = [], [], [], []
    animals = list(map(animal_of, models))
    for motion, name, model, animal in zip(motions, names, models, animals, strict=True):
        few, step = thinned(motion, most)
        shown.append(few)
        prefix = f"{name}: " if len(motions) > 1 else ""
        notes += [prefix + note for note in _notes(motion, step)]
        warnings += [prefix + warning for warning in warnings_of(model, motion)]
        numbers = [*_numbers(model, motion), ("samples", str(len(motion.t)))]
        words = {"name": name, "numbers": numbers, "events": _events(motion, prefix)}
        runs.append(_run(few, model, animal) | words)
    weight = max(float(weight_of(model.parameters)) for model in models)
    return {
        "runs": runs,
        "notes": notes,
        "warnings": warnings,
        "plots": _plots(names, shown, weight or 1.0),
        "length": max(animal.length for animal in animals),
        "force_scale": _common_force(shown) or weight or 1.0,
    }


def _run(motion: Trajectory, model: Model, animal: Animal) -> dict[str, Any]:
    """A run as the page reads it: sizes, and arrays as text."""
    arrays = samples(model, motion)
    box = _box(model)
    lowest = min(arrays["tail"][..., 2].min(), arrays["height"].min() - max(animal.semi_axes))
    return {
        "rows": len(motion.t),
        "points": arrays["tail"].shape[1],
        "bases": _bases(model),
        "tip": model.layout.chains[0].points.stop - 1,
        "legs": 2 if "legs" in arrays else 0,
        "contacts": sum(motion.contact.groups.values()) if motion.contact else 0,
        "grounded": motion.contact is not None or bool(lowest > 0),
        "body": {
            "semi_axes": box or animal.semi_axes,
            "belly": BELLY,
            "box": box is not None,
            "head": [] if box else [asdict(ball) for ball in animal.head],
            "tail_radii": animal.tail_radii,
            "joint": JOINT if animal.jointed else 1,
            "jointed": animal.jointed,
            "leg_radius": animal.leg_radius,
        },
        "arrays": {name: packed(array) for name, array in arrays.items()},
    }


def _box(model: Model) -> list[float] | None:
    """Half the sides (3,), m, of a torso that its scene makes a box, thick enough to be seen."""
    if model.manifest["scene"].get("body", {}).get("torso", {}).get("shape") != "box":
        return None
    inertia = np.array(model.parameters["torso_inertia"])
    squares = 1.5 / model.parameters["torso_mass"] * (inertia.sum() - 2 * inertia)
    half = np.sqrt(np.maximum(squares, 0))
    return np.maximum(half, THINNEST * half.max()).tolist()


def _bases(model: Model) -> list[int]:
    """The tail's points where its segments begin, if these bend in pitch and yaw."""
    first = model.layout.chains[0]
    if model.manifest["scene"]["coordinates"] == "polar":
        return []
    counts = np.broadcast_to(model.manifest["dimensions"]["links"], model.segments)[first.segments]
    return [0, *np.cumsum(counts)[:-1].tolist()]


def _notes(motion: Trajectory, step: int) -> list[str]:
    """What a reader of the page has to know of a run."""
    notes = []
    if "failure" in motion.info:
        notes.append(f"the run failed, and ends here: {motion.info['failure']}")
    if step > 1:
        notes.append(f"one of {step} samples is shown; the numbers are of all {len(motion.t)}.")
    return notes


def labels() -> dict[str, tuple[str, str]]:
    """Return the label and the unit, in brackets, of each number that the page shows."""
    units = {name: f" ({UNITS[name]})" if UNITS[name] else "" for name in LABELS}
    return {name: (label, units[name]) for name, label in LABELS.items()}


def _numbers(model: Model, motion: Trajectory) -> list[tuple[str, str]]:
    """Labels with units, and values, of the numbers that the motion has."""
    numbers, rows = summary(model, motion), []
    for name, (label, unit) in labels().items():
        value = numbers[name]
        for part, number in (value if isinstance(value, dict) else {"": value}).items():
            whose = f": {part.replace('_', ' ')}" if part else ""
            if number is not None:
                rows.append((f"{label}{whose}{unit}", as_word(number)))
    return rows


def _events(motion: Trajectory, prefix: str) -> list[dict[str, Any]]:
    """The first events of the motion: time (s), kind, and a label."""
    return [
        {
            "time": event["time"],
            "kind": event["kind"],
            "label": f"{prefix}{event['group']} {event['kind'].replace('_', ' ')}",
        }
        for event in motion.events[:MOST_EVENTS]
    ]


def _plots(
    names: Sequence[str], motions: Sequence[Trajectory], weight: float
) -> list[dict[str, Any]]:
    """The plots: title, curves of all runs, least span; the weight (N) where forces are scaled."""
    plots = []
    for array, title in TITLES.items():
        curves = []
        for run, (name, motion) in enumerate(zip(names, motions, strict=True)):
            for column, label in enumerate(_columns(array, motion)):
                words = label if len(motions) == 1 else f"{name} {label}".rstrip()
                curves.append({"run": run, "array": array, "column": column, "label": words})
        if curves:
            compressed = weight if array == "force" else 0
            plot = {"title": title, "curves": curves, "compressed": compressed}
            plots.append(plot | {"least": LEAST.get(array, 0)})
    return plots


def _columns(array: str, motion: Trajectory) -> Sequence[str]:
    """The names of an array's columns; none if a motion does not have it."""
    if array in ("height", "tilt", "momentum"):
        return [] if motion.layout.fixed else "xyz" if array == "momentum" else [""]
    if array in ("bends", "torque") and len(motion.layout.chains) > 1:
        return motion.names.tail
    if array in ("bends", "torque"):
        return [f"{bend} {i + 1}" for i in range(motion.segments) for bend in ("pitch", "yaw")]
    if array == "force":
        return list(motion.contact.groups) if motion.contact else []
    return ("total", "kinetic", "potential")


def _common_force(motions: list[Trajectory]) -> float:
    """The 95th percentile of the forces that act, N; 0 where none does."""
    touching = [motion.contact.forces for motion in motions if motion.contact is not None]
    with np.errstate(over="ignore"):  # of a run that blows up
        lengths = [np.linalg.norm(forces, axis=-1).ravel() for forces in touching]
    sizes = np.nan_to_num(np.concatenate([[0.0], *lengths]))
    return float(np.percentile(sizes[sizes > 0], COMMON)) if sizes.any() else 0.0
