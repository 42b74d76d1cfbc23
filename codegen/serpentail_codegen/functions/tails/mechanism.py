"""The tails: for each, which steps describe one piece of a segment, so that the same sweeps serve
both.

A segment of the articulated tail has n pieces, its links; a segment of the continuum tail is one
piece.
"""

from collections.abc import Callable
from dataclasses import dataclass

from ...ir.program import Array, Index, Ref
from ...ir.step import specialised
from ...mechanics.lower import derive
from ..draft import Draft
from ..tail import Tail


@dataclass(frozen=True)
class Mechanism:
    """How one piece moves, what it weighs, and how it passes things on; steps are SymPy
    functions.
    """

    pieces: Callable[[Tail], int]
    prepare: Callable[[Draft, bool], None]
    prepare_samples: Callable[[Draft], None]
    pose: Callable
    twist: Callable
    gather: Callable
    gather_wrench: Callable
    gather_moment: Callable
    move: Callable[[Draft, Index, dict[str, Ref], Array | None, Ref], None]
    momentum: Callable[[Draft, Index, dict[str, Ref]], None]
    power: Callable


def still(d: Draft, function: Callable, moving: bool = True):
    """Return a step, specialised to a tail that does not accelerate unless it does, and to rest
    where the draft is.
    """
    step = derive(function)
    zeros = {
        "rest": {"rates": (0, 0), "w": (0, 0, 0)} if d.at_rest else {},
        "unforced": {"accelerations": (0, 0)},
    }
    zeros["unforced"] = {} if moving else zeros["unforced"]
    for name, constants in zeros.items():
        step = specialised(step, f"{step.name}_{name}", **constants) if constants else step
    return step


def motion(d: Draft, i: Index, v_dot: Array | None) -> dict[str, Ref]:
    """Rates, and accelerations if there are any, of segment i."""
    return {"rates": d.rates(i)} | ({"accelerations": v_dot.part(6 + 2 * i, 2)} if v_dot else {})
