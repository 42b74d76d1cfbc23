"""The tails: for each, which steps describe one piece of a segment, so that the same sweeps serve
both.

A segment of the articulated tail has n pieces, its links; a segment of the continuum tail is one
piece.
"""

from ..tail import Tail
from .articulated import ARTICULATED
from .continuum import CONTINUUM
from .mechanism import Mechanism
from .polar import POLAR


def mechanism_of(tail: Tail) -> Mechanism:
    """Return the steps of a tail."""
    if tail.polar:
        return POLAR
    return {"articulated": ARTICULATED, "continuum": CONTINUUM}[tail.kind]
