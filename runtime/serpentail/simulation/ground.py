"""Settings of a run on the ground: legs, friction springs, events to stop at."""

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..basics.checks import finite_array, refusal
from ..basics.errors import SimulationError
from ..model.kernel import RunKernel
from ..model.model import Model
from ..model.parameters import RunParameters
from ..model.weight import weight_of
from ..motion.contact import Contact
from .controllers.load import loads_of
from .controllers.piecewise import Piecewise
from .controllers.prescribed import curve_of
from .controllers.schedules import Legs
from .start import Start

KINDS = ("touch_down", "take_off")
MAX_STATIC_LOAD = (
    5.0  # weights: a static force of one point beyond it means a start inside the ground
)
LANDED_AT = "landed_at"  # in a run's info: the time (s) at which the legs' landing began
LEG_ANGLES = 4  # of both legs, which their rates follow
MOST_EVENTS = 10_000  # that are kept
DEEP = (
    "q0{whose}: point {point} ({group}) is {depth:.3g} mm deep at the start, more than "
    "{limit:.3g} mm: raise q0[2] by {height:.4g} m"
)


@dataclass(frozen=True, eq=False)
class GroundSettings:
    """Checked settings of runs on the ground, bristles (k, points, 2); without contacts none.

    given: angles of prescribed joints over time, and loads: forces from outside, if there are any,
    also in flight.
    """

    groups: dict[str, int] = field(default_factory=dict)
    legs: Legs | None = None
    bristles: np.ndarray = field(default_factory=lambda: np.zeros((1, 0, 2)))
    stop_at: int = 0
    given: Piecewise | None = None
    loads: Piecewise | None = None

    @classmethod
    def checked(
        cls, model: Model, start: Start, parameters: RunParameters, settings: dict
    ) -> "GroundSettings":
        """Take legs, prescribed, load, bristles0, stop_at out of settings; SimulationError if one
        is wrong.
        """
        given = curve_of(model, start.many, settings.pop("prescribed", None))
        loads = loads_of(model, settings.pop("load", None))
        choices = {name: settings.pop(name, None) for name in ("legs", "bristles0", "stop_at")}
        groups = model.contacts
        if not groups:
            for name, value in choices.items():
                if value is not None:
                    remedy = "leave it out, or add `contacts` to the scene"
                    raise SimulationError(
                        f"{name} {value!r}: {model.name} has no contacts: {remedy}"
                    )
            return cls(given=given, loads=loads)
        legs = _legs(groups, choices["legs"])
        bristles = _bristles(groups, start, choices["bristles0"])
        ground = cls(groups, legs, bristles, _stops(groups, choices["stop_at"]), given, loads)
        ground.refuse_deep(model, start, parameters)
        return ground

    @property
    def points(self) -> int:
        """Number of points that can touch the ground."""
        return sum(self.groups.values())

    def near(self, record: Any) -> dict[str, Any]:
        """The pass above the ground, of a record of C, that is the closest for its error."""
        point = {"group": self._group_of(record.near_point), "point": record.near_point}
        numbers = {name: getattr(record, f"near_{name}") for name in ("time", "height", "error")}
        return point | numbers

    def legs_at(self, t: ArrayLike, landed_at: float = np.inf) -> tuple[np.ndarray, ...]:
        """Return the argument ``legs`` (8,) or (K, 8) at t (s), or ``given``; nothing without feet
        and prescribed joints.

        landed_at: the time (s) at which the landing of the legs began, if it did.
        """
        if self.legs is None:
            return self.given_at(t)
        found = np.concatenate(self.legs.curve.at(t)[:2], axis=-1)
        if self.legs.landing is not None and np.isfinite(landed_at):
            since = np.asarray(t, float) - landed_at
            late = np.concatenate(self.legs.landing.at(since)[:2], axis=-1)
            found = np.where((since >= 0)[..., None], late, found)
        return (found,)

    def given_at(self, t: ArrayLike) -> tuple[np.ndarray, ...]:
        """Return the argument ``given`` (3, n) or (K, 3, n) at t (s); nothing without it."""
        return () if self.given is None else (np.stack(self.given.at(t), axis=-2),)

    def refuse_deep(self, model: Model, start: Start, parameters: RunParameters) -> None:
        """SimulationError if a point begins deeper than a static force could press it."""
        heights, p = self._heights(model, start, parameters), parameters.values
        weight = weight_of(p)
        limits = np.broadcast_to((MAX_STATIC_LOAD * weight / p["K_n"]) ** (2 / 3), start.runs)
        wrong = np.flatnonzero(-heights.min(axis=1) > limits)
        if len(wrong):
            heights, limit, k = heights[wrong[0]], limits[wrong[0]], int(heights[wrong[0]].argmin())
            deepest, whose = -float(heights[k]), f" of run {wrong[0]}" if start.many else ""
            lengths = {"depth": 1e3 * deepest, "limit": 1e3 * limit, "height": deepest}
            point = {"point": k, "group": self._group_of(k)}
            raise SimulationError(DEEP.format(whose=whose, **point, **lengths))

    def _heights(self, model: Model, start: Start, parameters: RunParameters) -> np.ndarray:
        """Heights (k, points) in m of the points at the starts."""
        if not start.many:
            points, _ = model.contact_points(start.q0[0], start.v0[0], *self.legs_at(start.start))
            return points[None, :, 2]
        kernel, one = model.kernel("contact_points"), (start.runs, 1)
        legs = (np.broadcast_to(each, (*one, 8)) for each in self.legs_at(start.start))
        states = (start.q0[:, None], start.v0[:, None], *legs)
        inputs = [np.array(array, kernel.dtype, order="C") for array in states]
        outputs = [np.zeros((*one, self.points, 3), kernel.dtype) for _ in range(2)]
        evaluate = RunKernel(kernel, parameters.vectors, inputs, outputs)
        for k in range(start.runs):
            evaluate(k, 1)
        return outputs[0][:, 0, :, 2]

    def _group_of(self, k: int) -> str:
        """Return the group of point k."""
        ends = np.cumsum(list(self.groups.values()))
        return list(self.groups)[int(np.searchsorted(ends, k, "right"))]

    def contact(
        self, model: Model, t: np.ndarray, state: tuple[np.ndarray, ...], landed_at: float
    ) -> Contact | None:
        """Return the contact at times (K,) of (q, v, tau, bristles); None without contacts.

        landed_at: as of ``legs_at``.
        """
        if not self.groups:
            return None
        q, v, tau, bristles = state
        legs = self.legs_at(t, landed_at)
        positions, _ = model.contact_points(q, v, *legs)
        stretch = bristles.reshape(len(bristles), -1)
        forces = model.kernel("contact_rates")(q, v, tau, stretch, *legs)[2]
        angles = legs[0][:, :LEG_ANGLES] if self.legs else None
        return Contact(positions, forces, bristles, self.groups, angles)

    def events(self, times: list[float], numbers: list[int]) -> list[dict[str, Any]]:
        """Return events of the C interface as plain data.

        A group whose force ceases and comes again while a point of it is still in the ground has
        not taken off.
        """
        groups = list(self.groups)
        events: list[dict[str, Any]] = []
        left: dict[int, dict] = {}  # groups without force that are still in the ground
        for time, number in zip(times, numbers, strict=True):
            group, kind = divmod(number, len(KINDS))
            if group >= len(groups):
                left.pop(number - len(KINDS) * len(groups), None)
                continue
            event = {"time": float(time), "group": groups[group], "kind": KINDS[kind]}
            if KINDS[kind] == "take_off":
                left[group] = event
            elif group in left:
                events.remove(left.pop(group))
                continue
            events.append(event)
        return events


def _legs(groups: dict[str, int], legs: Any) -> Legs | None:
    """Return the legs, which a model with feet must have, and no other."""
    if "feet" in groups and not isinstance(legs, Legs):
        raise SimulationError(
            f"legs {legs!r}: this model has feet: give Legs, such as Legs.fixed(gamma, delta)"
        )
    if "feet" not in groups and legs is not None:
        raise SimulationError(
            'legs: this model has no feet: leave them out, or add "feet" to `contacts` of its scene'
        )
    return legs


def _bristles(groups: dict[str, int], start: Start, bristles: ArrayLike | None) -> np.ndarray:
    """Return the stretch of every run, (k, points, 2); one is repeated."""
    shape = (sum(groups.values()), 2)
    if bristles is None:
        return np.zeros((start.runs, *shape))
    stretch = finite_array("bristles0", bristles, SimulationError, "m")
    if stretch.shape != shape and not (start.many and stretch.shape == (start.runs, *shape)):
        raise SimulationError(f"bristles0 has shape {stretch.shape}: give {shape}, in m")
    return np.array(np.broadcast_to(stretch, (start.runs, *shape)), order="C")


def _stops(groups: dict[str, int], stop_at: Iterable[tuple[str, str]] | None) -> int:
    """Return the bits of the events to stop at: pairs (kind, group)."""
    bits: dict[tuple[str, ...], int] = {}
    for group in groups:
        for kind in KINDS:
            bits[kind, group] = 1 << len(bits)
    try:
        pairs = {tuple(pair) for pair in (() if stop_at is None else stop_at)}
        return sum(bits[pair] for pair in pairs)
    except (TypeError, KeyError):
        choices = ", ".join(map(repr, bits))
        needs = f"a list of pairs out of {choices}"
        raise refusal("stop_at", stop_at, needs, SimulationError) from None
