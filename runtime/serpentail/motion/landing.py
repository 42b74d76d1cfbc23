"""How a motion meets the ground: flights and touches by its events, and what its landing was.

The landing is the touch-down that ends the flight about the apex, the highest point of B.
"""

from typing import Any

import numpy as np

from serpentail_scene.layout import QUATERNION, VELOCITY

from ..basics.attitude import Array, rotation_matrix
from ..model.model import Model
from .body import weight
from .feet import feet_times, feet_touching
from .trajectory import Trajectory

# standing is: upright, at rest, its weight on the feet
MIN_UPRIGHT = 0.9  # z of the torso's z axis
MAX_SPEED = 0.05  # m/s, of B
MIN_SHARE = 0.5  # of the weight

ROUNDING = 1e-6  # relative, of times that a float model counts
Spans = list[tuple[float, float]]


def knows_events(motion: Trajectory) -> bool:
    """Tell whether the motion is on the ground and its events were detected."""
    return motion.contact is not None and "events" in motion.info


def flight(motion: Trajectory) -> tuple[float | None, float | None]:
    """Times (s) at which the flight about the apex begins and ends; None: not in the motion."""
    if not knows_events(motion):
        return None, None
    apex = motion.t[motion.q[:, 2].argmax()]
    for begin, end in airborne(motion):
        if begin <= apex and (end is None or apex <= end):
            return (None if begin == -np.inf else begin), end
    return None, None


def events(motion: Trajectory) -> list[dict[str, Any]]:
    """Return the events within the samples; a resampled motion may have only some of them."""
    slack = ROUNDING * max(abs(motion.t[0]), abs(motion.t[-1]))
    begin, end = motion.t[0] - slack, motion.t[-1] + slack
    return [event for event in motion.events if begin <= event["time"] <= end]


def airborne(motion: Trajectory) -> list[tuple[float, float | None]]:
    """Return spans in which nothing touches the ground; -inf or None if they exceed the motion."""
    touching = _touching_first(motion)
    begin: float | None = None if touching else -np.inf
    spans: list[tuple[float, float | None]] = []
    for event in events(motion):
        # the last group to leave the ground begins a flight, the first to return ends it
        if event["kind"] == "take_off":
            touching.discard(event["group"])
            begin = None if touching else event["time"]
        else:
            touching.add(event["group"])
            if begin is not None:
                spans.append((begin, event["time"]))
            begin = None
    if begin is not None:
        spans.append((begin, None))
    return spans


def touches(motion: Trajectory) -> dict[str, Spans] | None:
    """Return spans (s) in which each group touches the ground; None if no events were detected."""
    if not knows_events(motion):
        return None
    begun = dict.fromkeys(_touching_first(motion), float(motion.t[0]))
    spans: dict[str, Spans] = {group: [] for group in _groups(motion)}
    for event in events(motion):
        group, time = event["group"], event["time"]
        if event["kind"] == "touch_down":
            begun[group] = time
        else:
            spans[group].append((begun.pop(group, float(motion.t[0])), time))
    for group, begin in begun.items():
        spans[group].append((begin, max(begin, float(motion.t[-1]))))
    return spans


def touching_time(motion: Trajectory) -> dict[str, float] | None:
    """For how long (s) each group, and each foot by the samples, touches the ground in all."""
    spans = touches(motion)
    if spans is None:
        return None
    of_groups = {group: float(sum(b - a for a, b in each)) for group, each in spans.items()}
    return of_groups | feet_touching(motion)


def times_of(motion: Trajectory, kind: str, which: int) -> dict[str, float | None] | None:
    """Time (s) of each group's event of a kind, by its place: 0 the first, -1 the last one.

    That of a foot is a sample.
    """
    if not knows_events(motion):
        return None
    found: dict[str, list[float]] = {group: [] for group in _groups(motion)}
    for event in events(motion):
        if event["kind"] == kind:
            found[event["group"]].append(event["time"])
    of_groups = {group: times[which] if times else None for group, times in found.items()}
    return of_groups | feet_times(motion, kind, which)


def _groups(motion: Trajectory) -> list[str]:
    """The groups of points that can touch."""
    return list(motion.contact.groups) if motion.contact else []


def _touching_first(motion: Trajectory) -> set[str]:
    """The groups that the ground pushes at the first sample."""
    contact = motion.contact
    if contact is None:
        return set()
    return {name for name in _groups(motion) if (contact.of(name).forces[0, :, 2] > 0).any()}


# What the landing was.


def landing_group(motion: Trajectory) -> str | None:
    """The group that lands first."""
    landing = flight(motion)[1]
    for event in events(motion) if landing is not None else ():
        if event["kind"] == "touch_down" and event["time"] == landing:
            return str(event["group"])
    return None


def least_upright(motion: Trajectory) -> float | None:
    """Least z of the torso's z axis in the samples from the landing on."""
    up = _up_after(motion)
    return None if up is None else float(up[:, 2].min())


def turned(motion: Trajectory) -> float | None:
    """Return the rotation (rad) of the torso about horizontal axes after the landing, in total.

    It is the integral of the horizontal angular velocity, that is the length of the path of the
    world's z axis on the torso. It is computed from the samples' attitudes, which must be less than
    half a turn apart.
    """
    up = _up_after(motion)
    if up is None:
        return None
    sines = np.linalg.norm(np.cross(up[:-1], up[1:]), axis=1)
    return float(np.arctan2(sines, (up[:-1] * up[1:]).sum(axis=1)).sum())


def _up_after(motion: Trajectory) -> Array | None:
    """The world's z axis in the torso's axes (K, 3), from the landing on; None without one."""
    landing = flight(motion)[1]
    after = motion.t >= (np.inf if landing is None else landing)
    return rotation_matrix(motion.q[after][:, QUATERNION])[:, 2] if after.any() else None


def upright(motion: Trajectory) -> float:
    """How upright the torso ends: z of its z axis, 1 on its feet, -1 on its back."""
    return float(rotation_matrix(motion.q[-1, QUATERNION])[2, 2])


def standing(model: Model, motion: Trajectory) -> bool | None:
    """Tell if it ends upright, at rest and on its feet; None without feet."""
    if motion.contact is None or "feet" not in motion.contact.groups:
        return None
    carried = motion.contact.of("feet").forces[-1, :, 2].sum()
    slow = np.linalg.norm(motion.v[-1, VELOCITY]) < MAX_SPEED
    return bool(upright(motion) > MIN_UPRIGHT and slow and carried > MIN_SHARE * weight(model))


def landed(model: Model, motion: Trajectory) -> bool | None:
    """Tell if it stands at the end and was never on its back after the landing.

    None if it does not land, or has no feet.
    """
    stands, least = standing(model, motion), least_upright(motion)
    return None if stands is None or least is None else stands and least > 0
