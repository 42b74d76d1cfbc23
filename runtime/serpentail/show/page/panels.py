"""The panels that the page plots over time, and the curves of each run in them."""

from collections.abc import Sequence
from typing import Any

from ...motion.trajectory import Trajectory

LEAST = {"height": 1e-3, "tilt": 0.1, "bends": 0.1}  # that an axis spans, in its unit
ENERGIES = ("total", "kinetic", "potential")


def panels(
    names: Sequence[str], motions: Sequence[Trajectory], weight: float
) -> list[dict[str, Any]]:
    """Return the panels: title, curves, and the least span of the axis.

    For forces also the weight (N) where the scale changes.
    """
    titles = {
        "height": "height of the torso (m)",
        "tilt": "tilt of the back (deg)",
        "bends": "bends of the tail's segments (deg)",
        "torque": "joint torques (N m)",
        "force": "force of the ground (N), scale compressed",
        "energy": "energy (J)",
    }
    found = []
    for array, title in titles.items():
        curves = []
        for run, (name, motion) in enumerate(zip(names, motions, strict=True)):
            for column, label in enumerate(_columns(array, motion)):
                words = label if len(motions) == 1 else f"{name} {label}".strip()
                curves.append({"run": run, "array": array, "column": column, "label": words})
        if curves:
            compressed = weight if array == "force" else 0
            panel = {"title": title, "curves": curves, "compressed": compressed}
            found.append(panel | {"least": LEAST.get(array, 0)})
    return found


def _columns(array: str, motion: Trajectory) -> Sequence[str]:
    """Return the names of an array's columns; none if a motion does not have it."""
    if array in ("height", "tilt") and motion.layout.fixed:
        return []
    if array in ("bends", "torque"):
        return [f"{bend} {i + 1}" for i in range(motion.segments) for bend in ("pitch", "yaw")]
    if array == "force":
        return list(motion.contact.groups) if motion.contact else []
    return ENERGIES if array == "energy" else [""]
