"""Ground: a model with contacts, legs and a start go in; what a run on the ground needs, and what
it met, come out.
"""

from dataclasses import dataclass, field

import numpy as np

from ..checks import finite_array
from ..errors import SimulationError
from ..model.kernel import RunKernel
from ..model.parameters import RunParameters, total_mass
from ..motion.contact import Contact
from .schedules import Legs
from .start import Start

KINDS = ("touch_down", "take_off")
MAX_STATIC_LOAD = (
    5.0  # weights: a static force of one point beyond it means a start inside the ground
)
MOST_EVENTS = 10_000  # that are kept


@dataclass(frozen=True, eq=False)
class Ground:
    """The checked settings of runs on the ground, bristles (k, points, 2); without contacts there
    is nothing to set.
    """

    groups: dict[str, int] = field(default_factory=dict)
    legs: Legs | None = None
    bristles: np.ndarray | None = None
    stop_at: int = 0

    @classmethod
    def checked(cls, model, start: Start, parameters: RunParameters, settings: dict) -> "Ground":
        """Take legs, bristles0 and stop_at out of settings; SimulationError where they are wrong,
        or missing.
        """
        given = {name: settings.pop(name, None) for name in ("legs", "bristles0", "stop_at")}
        groups = model.contacts
        if not groups:
            for name in [name for name in given if given[name] is not None]:
                remedy = "leave it out, or add `contacts` to the scene"
                raise SimulationError(
                    f"{name} {given[name]!r}: {model.name} touches nothing: {remedy}"
                )
            return cls()
        legs, bristles = _legs(groups, given["legs"]), _bristles(groups, start, given["bristles0"])
        ground = cls(groups, legs, bristles, _stops(groups, given["stop_at"]))
        ground.refuse_deep(model, start, parameters)
        return ground

    @property
    def points(self) -> int:
        """Number of points that can touch the ground."""
        return sum(self.groups.values())

    def legs_at(self, t) -> tuple[np.ndarray, ...]:
        """Return the argument ``legs`` (8,) or (K, 8) at t (s), angles and rates, where there are
        feet.
        """
        return () if self.legs is None else (np.concatenate(self.legs.curve.at(t)[:2], axis=-1),)

    def refuse_deep(self, model, start: Start, parameters: RunParameters) -> None:
        """SimulationError where a point begins so deep that only a blow could have brought it
        there.
        """
        heights, p = self._heights(model, start, parameters), parameters.values
        weight = total_mass(p) * p["gravity"]
        limits = np.broadcast_to((MAX_STATIC_LOAD * weight / p["K_n"]) ** (2 / 3), start.runs)
        wrong = np.flatnonzero(-heights.min(axis=1) > limits)
        if len(wrong):
            heights, limit, k = heights[wrong[0]], limits[wrong[0]], int(heights[wrong[0]].argmin())
            deepest, whose = -float(heights[k]), f" of run {wrong[0]}" if start.many else ""
            where = f"point {k} ({self._group_of(k)}) is {1e3 * deepest:.3g} mm deep at the start"
            raise SimulationError(
                f"q0{whose}: {where}, more than {1e3 * limit:.3g} mm: raise q0[2] by {deepest:.4g} "
                "m"
            )

    def _heights(self, model, start: Start, parameters: RunParameters) -> np.ndarray:
        """Heights (k, points) in m of the points at the starts."""
        kernel, one = model.kernel("contact_points"), (start.runs, 1)
        legs = (np.broadcast_to(each, (*one, 8)) for each in self.legs_at(start.start))
        inputs = [
            np.array(a, kernel.dtype, order="C")
            for a in (start.q0[:, None], start.v0[:, None], *legs)
        ]
        outputs = [np.zeros((*one, self.points, 3), kernel.dtype) for _ in range(2)]
        evaluate = RunKernel(kernel, parameters.vectors, inputs, outputs)
        for k in range(start.runs):
            evaluate(k, 1)
        return outputs[0][:, 0, :, 2]

    def _group_of(self, k: int) -> str:
        ends = np.cumsum(list(self.groups.values()))
        return list(self.groups)[int(np.searchsorted(ends, k, "right"))]

    def contact(self, model, t, state) -> Contact | None:
        """Return what touches the ground in samples: times (K,), (q, v, tau, bristles); None in
        flight.
        """
        if not self.groups:
            return None
        q, v, tau, bristles = state
        legs = self.legs_at(t)
        positions, _ = model.contact_points(q, v, *legs)
        _, _, forces = model.contact_dynamics(q, v, tau, bristles.reshape(len(bristles), -1), *legs)
        return Contact(positions, forces, bristles, self.groups)

    def event(self, t: float, number: int) -> dict:
        """Return an event of the C interface as plain data."""
        return {
            "time": float(t),
            "group": list(self.groups)[number // 2],
            "kind": KINDS[number % 2],
        }


def _legs(groups, legs) -> Legs | None:
    if "feet" in groups and not isinstance(legs, Legs):
        raise SimulationError(
            f"legs {legs!r}: this model has feet: give Legs, such as Legs.fixed(gamma, delta)"
        )
    if "feet" not in groups and legs is not None:
        raise SimulationError(
            'legs: this model has no feet: leave them out, or add "feet" to `contacts` of its scene'
        )
    return legs


def _bristles(groups, start: Start, bristles) -> np.ndarray:
    """Return the stretch of every run, (k, points, 2); one is repeated."""
    shape = (sum(groups.values()), 2)
    found = (
        np.zeros(shape)
        if bristles is None
        else finite_array("bristles0", bristles, SimulationError)
    )
    if found.shape not in ({shape, (start.runs, *shape)} if start.many else {shape}):
        raise SimulationError(f"bristles0 has shape {found.shape}: give {shape}, in m")
    return np.array(np.broadcast_to(found, (start.runs, *shape)), order="C")


def _stops(groups, stop_at) -> int:
    """Return the bits of the events to stop at: pairs (kind, group)."""
    known = {
        (kind, group): 2 * g + k for g, group in enumerate(groups) for k, kind in enumerate(KINDS)
    }
    try:
        pairs = [] if stop_at is None else [tuple(pair) for pair in stop_at]
        return sum(1 << known[pair] for pair in set(pairs))
    except (TypeError, KeyError):
        choices = ", ".join(map(repr, known))
        raise SimulationError(
            f"stop_at {stop_at!r}: give a list of pairs out of {choices}"
        ) from None
