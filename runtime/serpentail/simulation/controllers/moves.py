"""Moves of the legs one after another: from tables to nodes of a schedule."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...basics.checks import number, one_of, refusal, shown
from ...basics.errors import SimulationError
from .piecewise import FASTEST, SHAPES

MOVE = {"at": "s", "gamma": "rad", "delta": "rad", "duration": "s", "rate": "rad/s", "shape": ""}
TOUCH_DOWN = "touch_down"  # of a move: in place of a time
Angles = tuple[float, float]  # gamma and delta (rad)
Node = tuple[float, Angles, str]  # time (s), angles there, shape of the way to it


@dataclass(frozen=True, eq=False)
class Moves:
    """Nodes of moves: times (K,) in s, angles (K, 2) in rad, shapes of the K - 1 ways between.

    landing: goal, duration (s) and shape of the move that begins at a touch-down, if there is one.
    """

    times: np.ndarray
    angles: np.ndarray
    shapes: list[str]
    landing: tuple[Angles, float, str] | None

    @property
    def landing_from(self) -> float:
        """The time (s) from which on a touch-down counts."""
        return float(self.times[-1]) if len(self.times) > 1 else 0.0


def moves_of(first: np.ndarray, moves: Iterable[Mapping[str, Any]]) -> Moves:
    """Return the nodes of moves from the angles ``first`` (2,); SimulationError names a wrong one.

    ``Legs.moves`` explains their keys.
    """
    if isinstance(moves, str | Mapping) or not isinstance(moves, Iterable):
        raise refusal("legs.moves", moves, "an array of tables", SimulationError)
    start: Angles = float(first[0]), float(first[1])
    nodes: list[Node] = [(-math.inf, start, "")]
    landing = None
    for index, given in enumerate(moves):
        field = f"legs.moves[{index}]"
        if landing is not None:
            remedy = f"value {shown(given)}: follows a move at {TOUCH_DOWN}, which is the last: "
            raise SimulationError(f"{field}: {remedy}remove it, or give it to a later phase")
        move = _checked_move(field, given)
        way = _way(field, move, nodes[-1][1])
        if move["at"] == TOUCH_DOWN:
            landing = way
        else:
            nodes += _nodes(field, move["at"], way, nodes[-1])
    times, angles, shapes = zip(*(nodes[1:] or [(0.0, start, "")]), strict=True)
    return Moves(np.array(times), np.array(angles), list(shapes[1:]) or ["linear"], landing)


def move_value(field: str, key: str, value: Any, unit: str) -> Any:
    """Return the checked value of a key of a move: a number, in its unit, or a word."""
    if key == "shape":
        return one_of(field, value, SHAPES, SimulationError)
    if key == "at" and isinstance(value, str) and value == TOUCH_DOWN:
        return value
    return number(field, value, SimulationError, unit=unit)


def _checked_move(field: str, move: object) -> dict[str, Any]:
    """Return a move whose keys and values are complete; SimulationError otherwise."""
    if not isinstance(move, Mapping):
        raise refusal(field, move, f"a table of {', '.join(MOVE)}", SimulationError)
    for name in move:
        one_of(f"{field}: key", name, MOVE, SimulationError)
    checked = {
        name: move_value(f"{field}.{name}", name, value, MOVE[name]) for name, value in move.items()
    }
    goes = "gamma" in move or "delta" in move
    if "at" not in move or not goes or ("rate" in move) == ("duration" in move):
        needs = "at, gamma or delta, and one of rate, duration"
        raise refusal(field, dict(move), needs, SimulationError)
    return checked


def _way(field: str, move: Mapping[str, Any], angles: Angles) -> tuple[Angles, float, str]:
    """Return where a move goes, how long that takes (s), and its shape."""
    goal = move.get("gamma", angles[0]), move.get("delta", angles[1])
    shape = move.get("shape", "linear")
    if "duration" in move:
        duration = move["duration"]
    else:
        way = FASTEST[shape] * max(abs(x - y) for x, y in zip(goal, angles, strict=True))
        duration = way / number(f"{field}.rate", move["rate"], SimulationError, above=0)
    if not 0 < duration < math.inf:
        needs = "a duration above 0, and another angle than before"
        raise SimulationError(f"{field}: takes {duration!r} s: needs {needs}")
    return goal, duration, shape


def _nodes(field: str, at: float, way: tuple[Angles, float, str], last: Node) -> list[Node]:
    """Return the nodes that a move adds after the last one; SimulationError if it is too early."""
    (goal, duration, shape), (end, angles, _) = way, last
    if at < end:
        remedy = f"value {shown(at)}: the move before it ends at {end:.6g} s: move it after that"
        raise SimulationError(f"{field}.at: {remedy}")
    # a move that follows at once begins at the last node
    held = [] if at == end else [(at, angles, "linear")]
    return [*held, (at + duration, goal, shape)]
