"""What the page reads: runs with their samples, numbers, events; plots, notes and warnings."""

from typing import Any

import numpy as np

from ...model.model import Model
from ...motion.body import weight as weight_of
from ...motion.plausibility import warnings_of
from ...motion.trajectory import Trajectory
from .figures import events, figures
from .packing import packed
from .panels import panels
from .samples import samples, thinned
from .shape import length, shape

COMMON = 95  # percentile of the forces whose arrow is as long as half the torso


def page_data(
    motions: list[Trajectory], names: list[str], models: list[Model], most: int
) -> dict[str, Any]:
    """Return the data of the page, ready for JSON; most: largest number of samples of a run."""
    shown, notes, warnings, runs = [], [], [], []
    for motion, name, model in zip(motions, names, models, strict=True):
        few, step = thinned(motion, most)
        shown.append(few)
        prefix = f"{name}: " if len(motions) > 1 else ""
        notes += [prefix + each for each in _notes(motion, step)]
        warnings += [prefix + each for each in warnings_of(model, motion)]
        numbers = [*figures(model, motion), ("samples", str(len(motion.t)))]
        words = {"name": name, "numbers": numbers, "events": events(motion, prefix)}
        runs.append(_run(few, model) | words)
    weight = max(map(weight_of, models))
    return {
        "runs": runs,
        "notes": notes,
        "warnings": warnings,
        "plots": panels(names, shown, weight or 1.0),
        "length": max(map(length, models)),
        "force_scale": _common_force(shown) or weight or 1.0,
    }


def _run(motion: Trajectory, model: Model) -> dict[str, Any]:
    """A run as the page reads it: sizes, and arrays as text."""
    arrays = samples(model, motion)
    return {
        "rows": len(motion.t),
        "points": arrays["tail"].shape[1],
        "legs": 2 if "legs" in arrays else 0,
        "contacts": sum(motion.contact.groups.values()) if motion.contact else 0,
        "grounded": motion.contact is not None,
        "body": shape(model),
        "arrays": {name: packed(array) for name, array in arrays.items()},
    }


def _notes(motion: Trajectory, step: int) -> list[str]:
    """What a reader of the page has to know of a run."""
    notes = []
    if "failure" in motion.info:
        notes.append(f"the run failed, and ends here: {motion.info['failure']}")
    if step > 1:
        notes.append(f"one of {step} samples is shown; the numbers are of all {len(motion.t)}.")
    return notes


def _common_force(motions: list[Trajectory]) -> float:
    """The 95th percentile of the forces that act, N; 0 where none does."""
    touching = [motion.contact.forces for motion in motions if motion.contact is not None]
    with np.errstate(over="ignore"):  # of a run that blows up
        every = [np.linalg.norm(forces, axis=-1).ravel() for forces in touching]
    sizes = np.nan_to_num(np.concatenate([[0.0], *every]))
    return float(np.percentile(sizes[sizes > 0], COMMON)) if sizes.any() else 0.0
