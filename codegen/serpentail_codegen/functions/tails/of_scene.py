"""Chooses the mechanism of a tail."""

from ..tail import Tail
from .articulated import ARTICULATED
from .continuum import CONTINUUM
from .mechanism import Mechanism
from .mixed import MIXED
from .polar import POLAR


def mechanism_of(tail: Tail, kind: str = "") -> Mechanism:
    """Return the steps of a tail; in a mixed tail those of segments of a kind, or of all."""
    if tail.polar:
        return POLAR
    if tail.kind == "mixed":
        return MIXED[kind]
    return {"articulated": ARTICULATED, "continuum": CONTINUUM}[tail.kind]
