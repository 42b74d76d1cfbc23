"""Where gains hold: pushed flights, simulated, and the errors from which they ended wrong."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from serpentail_scene.layout import OMEGA, QUATERNION, TAIL_Q, TAIL_V

from ...basics.errors import SimulationError
from ...basics.short_repr import brief
from ...motion.trajectory import Trajectory
from ...simulation.controllers.controller import Phases
from ...simulation.controllers.piecewise import Piecewise
from ..flight import flight
from ..result.truth import attitude_errors
from .riccati import NONE

if TYPE_CHECKING:
    from .gains import Gains

BEGINS = (0.0, 0.25, 0.5, 0.75)  # of the duration: when pushes come
LEAST, MOST = 0.1, 20.0  # rad/s, of pushes
STEP = 1e-3  # s, of RK4


@dataclass(frozen=True, eq=False)
class Validity:
    """Flights of a plan's own model that were pushed, and where they tell that gains hold.

    A push adds its size (rad/s) to the torso's angular velocity, about a random axis, and normally
    distributed numbers of that size to the tail's rates.

    Attributes
    ----------
    push : float
        The largest push (rad/s) below the least with which a flight ended wrong.
    region : ndarray, shape (knots,)
        At each knot the least cost of an error from which a flight ended wrong; 1e30 if none did.
    pushes, errors : ndarray, shape (flights,)
        Sizes of the pushes (rad/s), in their order, and distances from the goal's attitude at the
        end (deg), 0 if the goal leaves it free; inf for a flight that could not be computed.
    """

    push: float
    region: np.ndarray
    pushes: np.ndarray
    errors: np.ndarray
    __repr__ = brief


def validity_of(gains: Gains, flights: int, seed: int) -> Validity:
    """Return where gains hold; gains.within: largest error at the end (deg) that is right."""
    motion, random = gains.plan.trajectory, np.random.default_rng(seed)
    problem, free, nt = gains.plan.problem, gains.unwatched(), gains.model.layout.nt
    pushes = np.sort(LEAST * (MOST / LEAST) ** random.uniform(size=flights))
    errors, costs = np.full(flights, np.inf), np.zeros((flights, len(gains.times)))
    for i, push in enumerate(pushes):
        # the sample of the plan at which it is pushed, and the flight from there
        k = int(np.searchsorted(motion.t, BEGINS[i % len(BEGINS)] * gains.plan.duration))
        axis, tail, v = random.normal(size=3), random.normal(size=nt), motion.v[k].copy()
        v[OMEGA.start :] += push * np.concatenate([axis / np.linalg.norm(axis), tail])
        law, rest = Phases([(-motion.t[k], free)]), gains.plan.duration - motion.t[k]
        start = motion.q[k], v
        sample = {"method": "rk4", "step": STEP, "output_step": STEP}
        try:
            flown = flight(gains.model, start, law, rest, **sample)
        except SimulationError as error:
            if error.trajectory is not None:
                costs[i] = _costs(gains, error.trajectory, motion.t[k])
            continue
        ends = motion.q[-1, QUATERNION], flown.q[-1, QUATERNION]
        errors[i] = 0.0 if problem.goal.attitude is None else attitude_errors(problem, *ends)[1]
        costs[i] = _costs(gains, flown, motion.t[k])
    wrong = ~(errors <= gains.within)
    least = pushes[wrong].min(initial=np.inf)
    # a flight has no cost at knots before its push
    region = np.where(costs > 0, costs, NONE)[wrong].min(axis=0, initial=NONE)
    return Validity(float(pushes[pushes < least].max(initial=0)), region, pushes, errors)


def _costs(gains: Gains, flown: Trajectory, begin: float) -> np.ndarray:
    """Return the largest cost (knots,) of a flight's errors while each knot's gains act.

    begin: time of the plan (s) at which it begins.
    """
    t = flown.t + begin
    e = gains.error(t, flown.q, flown.v)
    knot = np.clip(np.searchsorted(gains.times, t, side="right") - 1, 0, None)
    i, j = np.tril_indices(e.shape[1])
    found = np.zeros(len(gains.times))
    np.maximum.at(found, knot, np.sum(gains.tables["costs"][knot] * e[:, i] * e[:, j], axis=1))
    return found


def error_of(plan: Piecewise, t: np.ndarray, q: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Return the errors (K, n) of states at times t (K,) from a plan's channels (see gains.h)."""
    nt = q.shape[1] - 7
    values = plan.at(t)[0][:, nt:]
    (w, a), (w1, b) = ((r[:, :1], r[:, 1:4]) for r in (values[:, :4], q[:, QUATERNION]))
    turn = w * b - w1 * a - np.cross(a, b)
    sign = np.where(w * w1 + np.sum(a * b, axis=1, keepdims=True) < 0, -2, 2)
    rest = np.column_stack([v[:, OMEGA], q[:, TAIL_Q], v[:, TAIL_V]]) - values[:, 4:]
    return np.concatenate([sign * turn, rest], axis=1)
