"""What springs, damping and stops of a tail ask for and store, from a model's parameters."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from serpentail_scene.parameters import OUT_OF_REACH, name_in

if TYPE_CHECKING:
    from .model import Model

ENDS = (("tail_stop_lower", -1), ("tail_stop_upper", 1))
BEHIND = "{name} is {angle:.6g} rad, behind {stop} {at:.6g} by more than {wide} {width:.6g}"


def passive_force(values: Mapping[str, Any], angles: Any, rates: Any) -> Any:
    """Return the torques (..., 2m), N m, of springs, damping and stops at coordinates and rates."""
    force = np.zeros(np.shape(angles))
    if "tail_stiffness" in values:
        force = force + np.asarray(values["tail_stiffness"]) * (angles - _of(values, "tail_rest"))
    if "tail_damping" in values:
        force = force + np.asarray(values["tail_damping"]) * rates
    for way, sign in _ways(values, angles):
        s, beyond = np.clip(way, 0, 1), np.maximum(way - 1, 0)
        push = _of(values, "tail_stop_stiffness") * _of(values, "tail_stop_width")
        force = force + sign * push * (s**3 * (1 - s / 2) + beyond)
    return force + stop_damping(values, angles) * rates


def stop_damping(values: Mapping[str, Any], angles: Any) -> Any:
    """Return the damping (..., 2m), N m s, of the stops at coordinates."""
    if "tail_stop_damping" not in values:
        return np.zeros(np.shape(angles))
    depths = [np.clip(way, 0, 1) for way, _ in _ways(values, angles)]
    return _of(values, "tail_stop_damping") * sum(s * s * (3 - 2 * s) for s in depths)


def stored_energy(values: Mapping[str, Any], angles: Any) -> Any:
    """Return the energy (...), J, that springs and stops store at tail coordinates (..., 2m)."""
    energy = np.zeros(np.shape(angles))
    if "tail_stiffness" in values:
        stretch = angles - _of(values, "tail_rest")
        energy = energy + _of(values, "tail_stiffness") * stretch**2 / 2
    for way, _ in _ways(values, angles):
        s, beyond = np.clip(way, 0, 1), np.maximum(way - 1, 0)
        scale = _of(values, "tail_stop_stiffness") * _of(values, "tail_stop_width") ** 2
        energy = energy + scale * (s**4 * (5 - 2 * s) / 20 + beyond * (1 + beyond) / 2)
    return energy.sum(axis=-1)


def behind_stops(model: "Model", angles: Any) -> str:
    """Return which tail coordinate of (k, 2m) is the furthest beyond a stop, by more than its
    width.

    The text is empty if there is none.
    """
    values = model.passive_values
    for (name, _), (way, _) in zip(ENDS, _ways(values, angles), strict=False):
        run, coordinate = np.unravel_index(way.argmax(), way.shape)
        if way[run, coordinate] > 1:
            at, width = (
                np.broadcast_to(_of(values, each), np.shape(angles))[run, coordinate]
                for each in (name, "tail_stop_width")
            )
            numbers = {"angle": angles[run, coordinate], "at": at, "width": width}
            owner = model.layout.owners[coordinate]
            words = {"stop": name_in(owner, name), "wide": name_in(owner, "tail_stop_width")}
            return BEHIND.format(name=model.names.tail[coordinate], **words, **numbers)
    return ""


def idle(values: Mapping[str, Any], parts: tuple[str, ...]) -> dict[str, Any]:
    """Return changes of parameters under which "stops", "damping" and "spring" of all chains, and
    "air", do nothing.
    """
    idling = {"stops": {"_stop_lower": -OUT_OF_REACH, "_stop_upper": OUT_OF_REACH}}
    idling |= {"damping": {"_damping": 0.0}, "spring": {"_stiffness": 0.0}}
    ends = [pair for part in parts for pair in idling.get(part, {}).items()]
    names = [n for n in values if not n.endswith("_stop_stiffness") and not n.startswith("torso_")]
    found: dict[str, Any]
    found = {name: value for end, value in ends for name in names if name.endswith(end)}
    if "air" in parts and "air_density" in values:
        found |= {"air_density": 0.0, "wind": (0.0, 0.0, 0.0)}
        found |= {"torso_air_damping": (0.0, 0.0, 0.0)} if "torso_air_damping" in values else {}
    return found


def _of(values: Mapping[str, Any], name: str) -> np.ndarray:
    return np.asarray(values[name], float)


def _ways(values: Mapping[str, Any], angles: Any) -> list[tuple[Any, int]]:
    """Return how far coordinates are in both stops, in widths, and the signs of their forces."""
    if "tail_stop_lower" not in values:
        return []
    width = _of(values, "tail_stop_width")
    return [(sign * (angles - _of(values, name)) / width, sign) for name, sign in ENDS]
