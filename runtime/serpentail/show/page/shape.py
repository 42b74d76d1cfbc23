"""How large the animal is, so that the page can draw it: torso, tail, what it takes to see all."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...basics.attitude import Array
from ...model.model import Model
from ...motion.body import semi_axes

THINNEST = 0.15  # a semi-axis that is drawn, over the largest
SLENDER = 0.015  # radius over length of a tail without a parameter for its radius
THICKER = 1.15  # at the root, over the radius
WATER = 1e3  # kg/m^3
MOST_JOINTS = 60  # that are marked on a tail


def shape(model: Model) -> dict[str, Any]:
    """Return semi-axes of the torso (m), radii of the tail (m) between its points, and whether its
    joints are marked.

    The torso is that of ``motion.body``, with semi-axes large enough to be seen; a fixed base is
    drawn as a ball at the tail's mount.
    """
    axes = semi_axes(model)
    if model.fixed:
        reach = float(np.linalg.norm(model.parameters["tail_mount"]))
        axes = np.full(3, max(reach, 2 * usual_radius(model)))
    return {
        "semi_axes": np.maximum(axes, THINNEST * axes.max()).tolist(),
        "tail_radii": tail_radii(model).tolist(),
        "jointed": model.kind == "articulated"
        and model.manifest["dimensions"]["total"] <= MOST_JOINTS,
    }


def tail_radii(model: Model) -> Array:
    """Return the radius (m) of the tail between its points.

    Links with inertias of their own are as thick as cylinders of that inertia, arcs with masses of
    their own as thick as that mass of water. Other tails become thinner towards the tip.
    """
    p, count = model.parameters, model.manifest["dimensions"]["total"]
    usual, found = usual_radius(model), np.zeros(count)
    jointed = jointed_points(model)
    if "link_masses" in p:
        along, masses = np.reshape(p["link_inertias"], (-1, 3))[:, 1], np.array(p["link_masses"])
        found[jointed] = np.where(along > 0, np.sqrt(2 * along / masses), usual)
    if "arc_masses" in p:
        sections = np.array(p["arc_masses"]) / p["arc_lengths"] / WATER
        found[~jointed] = np.repeat(np.sqrt(sections / np.pi), model.samples or 1)
    if {"link_masses", "arc_masses"} & p.keys():
        return found
    return usual * (THICKER - np.arange(count) / (2 * count + 2))


def jointed_points(model: Model) -> NDArray[np.bool_]:
    """Return of each tail point but the first whether a link leads to it, not a part of an arc."""
    links = np.broadcast_to(0 if model.links is None else model.links, model.segments)
    return np.repeat(links > 0, np.where(links > 0, links, model.samples or 1))


def usual_radius(model: Model) -> float:
    """Return the radius (m) of a tail whose links are all alike."""
    p = model.parameters
    return float(p.get("link_radius") or SLENDER * p["tail_length"])


def length(model: Model) -> float:
    """Return how long the animal is with its tail straight, m."""
    return 2 * shape(model)["semi_axes"][1] + float(model.parameters["tail_length"])
