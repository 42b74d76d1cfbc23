"""How large the animal is, so that the page can draw it: torso, tail, what it takes to see all."""

from typing import Any

import numpy as np

from ..model.model import Model
from ..motion.body import semi_axes

THINNEST = 0.15  # a semi-axis that is drawn, over the largest
SLENDER = 0.015  # radius over length of a tail whose radius no parameter tells
MOST_JOINTS = 60  # that are marked on a tail


def shape(model: Model) -> dict[str, Any]:
    """Return semi-axes of the torso and radius of the tail, m, and whether its joints are marked.

    The torso is that of ``motion.body``, no semi-axis too thin to be seen.
    """
    p, axes = model.parameters, semi_axes(model)
    return {
        "semi_axes": np.maximum(axes, THINNEST * axes.max()).tolist(),
        "tail_radius": float(p.get("link_radius") or SLENDER * p["tail_length"]),
        "jointed": model.kind == "articulated"
        and model.manifest["dimensions"]["total"] <= MOST_JOINTS,
    }


def length(model: Model) -> float:
    """Return how long the animal is with its tail straight, m."""
    return 2 * shape(model)["semi_axes"][1] + float(model.parameters["tail_length"])
