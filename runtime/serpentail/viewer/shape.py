"""How large the animal is, so that the page can draw it: torso, tail, what it takes to see all."""

from typing import Any

import numpy as np

from ..model.model import Model

THINNEST = 0.15  # a semi-axis that is drawn, over the largest
SLENDER = 0.015  # radius over length of a tail whose radius no parameter tells
MOST_JOINTS = 60  # that are marked on a tail


def shape(model: Model) -> dict[str, Any]:
    """Return semi-axes of the torso and radius of the tail, m, and whether its joints are marked.

    The torso is the ellipsoid that touches the ground, else the homogeneous one of its inertia.
    """
    p = model.parameters
    spread = np.sum(p["torso_inertia"]) - 2 * np.array(p["torso_inertia"])
    of_inertia = np.sqrt(np.maximum(2.5 / p["torso_mass"] * spread, 0))
    semi_axes = np.array(p.get("torso_semi_axes", of_inertia))
    semi_axes = np.maximum(semi_axes, THINNEST * semi_axes.max())
    return {
        "semi_axes": semi_axes.tolist(),
        "tail_radius": float(p.get("link_radius") or SLENDER * p["tail_length"]),
        "jointed": model.kind == "articulated"
        and model.manifest["dimensions"]["total"] <= MOST_JOINTS,
    }


def length(model: Model) -> float:
    """Return how long the animal is with its tail straight, m."""
    return 2 * shape(model)["semi_axes"][1] + float(model.parameters["tail_length"])
