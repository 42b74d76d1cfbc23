"""The numbers of a leap's moves that are searched for."""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ..basics.errors import SimulationError
from ..simulation.controllers.piecewise import FASTEST
from .phase import BEFORE, Phase

ANGLE = 0.9  # rad, that an angle may move to each side of the first guess
LONGER = 2.0  # times, that a duration may become longer or shorter


class Unknown(NamedTuple):
    """A number of a move: its phase, move and key, and its first guess (rad or s)."""

    phase: int
    move: int
    key: str
    guess: float


def unknowns_of(phases: Sequence[Phase], k: int) -> list[Unknown]:
    """Return the angles of all moves of phase k, and durations of moves on the ground.

    SimulationError about moves that have a rate in place of a duration.
    """
    found = []
    for j, move in enumerate(phases[k].moves):
        if "rate" in move:
            field = f"phase {phases[k].name!r}: moves[{j}].rate"
            remedy = "optimise changes durations: give duration, and limits.leg_rate"
            raise SimulationError(f"{field}: value {move['rate']}: {remedy}")
        keys = ("gamma", "delta") if BEFORE in move else ("gamma", "delta", "duration")
        found += [Unknown(k, j, key, float(move[key])) for key in keys if key in move]
    return found


def with_numbers(
    phases: Sequence[Phase], unknowns: Sequence[Unknown], x: np.ndarray
) -> tuple[Phase, ...]:
    """Return phases whose moves have the numbers x."""
    moves = [[{**move} for move in phase.moves] for phase in phases]
    for unknown, value in zip(unknowns, x.tolist(), strict=True):
        moves[unknown.phase][unknown.move][unknown.key] = value
    return tuple(replace(phase, moves=each) for phase, each in zip(phases, moves, strict=True))


def leg_rate(angles: Sequence[float], phases: Sequence[Phase]) -> float:
    """Return the largest rate (rad/s) of the legs in all moves, from their first angles on."""
    (gamma, delta), fastest = angles, 0.0
    for move in (move for phase in phases for move in phase.moves):
        before, gamma, delta = (gamma, delta), move.get("gamma", gamma), move.get("delta", delta)
        way = max(abs(gamma - before[0]), abs(delta - before[1]))
        fastest = max(fastest, FASTEST[move.get("shape", "linear")] * way / move["duration"])
    return float(fastest)
