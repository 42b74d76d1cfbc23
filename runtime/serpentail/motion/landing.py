"""How a motion meets the ground: flights and touches by its events, and what its landing was.

The landing is the touch-down that ends the flight about the apex, the highest point of B.
"""

from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from serpentail_scene.layout import OMEGA, QUATERNION, VELOCITY

from ..basics.attitude import Array, rotation_matrix
from ..model.chains import limbs_of
from ..model.model import Model
from ..model.weight import weight_of
from .ground import feet as feet_of
from .resample import smooth
from .trajectory import Trajectory

# standing is: upright, at rest, its weight on the feet
MIN_UPRIGHT = 0.9  # z of the torso's z axis
MAX_SPEED = 0.05  # m/s, of B
MIN_SHARE = 0.5  # of the weight

ROUNDING = 1e-6  # relative, of times that a float model counts
Span = tuple[float, float]


class Landing:
    """Touches, flight and landing of a motion.

    What does not exist is None: in flight, without events (of methods that detect none), without
    feet, or if it does not land.
    """

    def __init__(self, model: Model, motion: Trajectory):
        self.model, self.motion = model, motion
        self.groups = list(motion.contact.groups) if motion.contact else []
        self.has_events = motion.contact is not None and "events" in motion.info

    @cached_property
    def events(self) -> list[dict[str, Any]]:
        """The events within the samples; a resampled motion may have only some of them."""
        if not self.has_events:
            return []
        t = self.motion.t
        slack = ROUNDING * max(abs(t[0]), abs(t[-1]))
        return [e for e in self.motion.events if t[0] - slack <= e["time"] <= t[-1] + slack]

    @cached_property
    def flight(self) -> tuple[float | None, float | None]:
        """Times (s) at which the flight about the apex begins and ends; None: not in the motion."""
        apex = self.motion.t[self.motion.q[:, 2].argmax()]
        for begin, end in self._airborne() if self.has_events else ():
            if begin <= apex and (end is None or apex <= end):
                return (None if begin == -np.inf else begin), end
        return None, None

    def _airborne(self) -> list[tuple[float, float | None]]:
        """Spans in which nothing touches the ground; -inf or None if they exceed the motion."""
        touching = self._touching_first()
        begin: float | None = None if touching else -np.inf
        spans: list[tuple[float, float | None]] = []
        for event in self.events:
            # the last group to leave the ground begins a flight, the first to return ends it
            if event["kind"] == "take_off":
                touching.discard(event["group"])
                begin = None if touching else event["time"]
            else:
                touching.add(event["group"])
                if begin is not None:
                    spans.append((begin, event["time"]))
                begin = None
        return spans if begin is None else [*spans, (begin, None)]

    def _touching_first(self) -> set[str]:
        """The groups that the ground pushes at the first sample."""
        contact = self.motion.contact
        assert contact is not None
        return {name for name in self.groups if (contact.of(name).forces[0, :, 2] > 0).any()}

    def touching_time(self) -> dict[str, float] | None:
        """For how long (s) each group, and each foot by the samples, touches the ground in all."""
        if not self.has_events:
            return None
        first, last = self.motion.t[[0, -1]].tolist()
        begun = dict.fromkeys(self._touching_first(), first)
        spans: dict[str, list[Span]] = {group: [] for group in self.groups}
        for event in self.events:
            group, time = event["group"], event["time"]
            if event["kind"] == "touch_down":
                begun[group] = time
            else:
                spans[group].append((begun.pop(group, first), time))
        for group, begin in begun.items():
            spans[group].append((begin, max(begin, last)))

        # intervals of a foot begin with a force
        steps = np.diff(self.motion.t)
        of_feet = {name: float(steps @ pushed[:-1]) for name, pushed in self._feet_pushed().items()}
        return {
            group: float(sum(b - a for a, b in each)) for group, each in spans.items()
        } | of_feet

    def times(self, kind: str, which: int) -> dict[str, float | None] | None:
        """Time (s) of each group's first (0) or last (-1) event of a kind; of a foot by samples."""
        if not self.has_events:
            return None
        times: dict[str, list[float]] = {group: [] for group in self.groups}
        for event in self.events:
            if event["kind"] == kind:
                times[event["group"]].append(event["time"])
        sign = 1 if kind == "touch_down" else -1
        for name, pushed in self._feet_pushed().items():
            times[name] = self.motion.t[1:][np.diff(pushed.astype(int)) == sign].tolist()
        return {name: each[which] if each else None for name, each in times.items()}

    def _feet_pushed(self) -> dict[str, NDArray[np.bool_]]:
        """For each foot the samples (K,) at which the ground pushes it."""
        return {
            name: np.asarray((forces[..., 2] > 0).any(axis=1))
            for name, forces in feet_of(self.motion).items()
        }

    # The flight about the apex, by its samples alone: at its ends a blow may change what follows.

    @cached_property
    def _flying(self) -> NDArray[np.bool_] | None:
        """The samples (K,) in the flight about the apex; None without an end of it, or a torso."""
        if self.flight == (None, None) or self.model.fixed:
            return None
        begin, end = self.flight
        t, slack = self.motion.t, ROUNDING * abs(float(self.motion.t[-1]))
        after = t >= (-np.inf if begin is None else begin - slack)
        flying: NDArray[np.bool_] = after & (t <= (np.inf if end is None else end + slack))
        return flying if flying.any() else None

    def torso_rate(self, which: int) -> Array | None:
        """Angular velocity (3,) of the torso (rad/s, body) at the take-off (0) or landing (1)."""
        time, flying = self.flight[which], self._flying
        if time is None or flying is None:
            return None
        return smooth(self.motion.t[flying], self.motion.v[flying, OMEGA], np.array([time]))[0]

    def angular_momentum(self, which: int) -> Array | None:
        """Angular momentum (3,) about the centre of mass (kg m^2/s, world) there."""
        if self.flight[which] is None or self._flying is None:
            return None
        return np.asarray(self.motion.angular_momentum[self._flying][-which])

    # What the landing was.

    def group(self) -> str | None:
        """The group that lands first."""
        landing = self.flight[1]
        for event in self.events if landing is not None else ():
            if event["kind"] == "touch_down" and event["time"] == landing:
                return str(event["group"])
        return None

    @cached_property
    def _up_after(self) -> Array | None:
        """The world's z axis in the torso's axes (K, 3), from the landing on."""
        after = self.motion.t >= (np.inf if self.flight[1] is None else self.flight[1])
        return rotation_matrix(self.motion.q[after][:, QUATERNION])[:, 2] if after.any() else None

    def least_upright(self) -> float | None:
        """Least z of the torso's z axis in the samples from the landing on."""
        return None if self._up_after is None else float(self._up_after[:, 2].min())

    def turned(self) -> float | None:
        """Rotation (rad) of the torso about horizontal axes after the landing, in total.

        It is the integral of the horizontal angular velocity, that is the length of the path of the
        world's z axis on the torso. It is computed from the samples' attitudes, which must be less
        than half a turn apart.
        """
        up = self._up_after
        if up is None:
            return None
        sines = np.linalg.norm(np.cross(up[:-1], up[1:]), axis=1)
        return float(np.arctan2(sines, (up[:-1] * up[1:]).sum(axis=1)).sum())

    @cached_property
    def standing(self) -> bool | None:
        """Whether it ends upright, at rest and on its feet, which are the points of limbs."""
        motion, forces = self.motion, carried(self.model, self.motion)
        if forces is None:
            return None
        slow = np.linalg.norm(motion.v[-1, VELOCITY]) < MAX_SPEED
        heavy = forces[-1] > MIN_SHARE * weight_of(self.model.parameters)
        return bool(upright(motion) > MIN_UPRIGHT and slow and heavy)

    def landed(self) -> bool | None:
        """Whether it stands at the end and was never on its back after the landing."""
        least = self.least_upright()
        return None if self.standing is None or least is None else self.standing and least > 0


def carried(model: Model, motion: Trajectory) -> Array | None:
    """Return with how much (N) the ground pushes feet and limbs up, in each sample (K,); None
    without such points.
    """
    contact, own = motion.contact, {"feet", *limbs_of(model)}
    if contact is None or not (feet := [name for name in contact.groups if name in own]):
        return None
    return np.asarray(sum(contact.of(name).forces[..., 2].sum(axis=1) for name in feet))


def upright(motion: Trajectory) -> float:
    """How upright the torso ends: z of its z axis, 1 on its feet, -1 on its back."""
    return float(rotation_matrix(motion.q[-1, QUATERNION])[2, 2])
