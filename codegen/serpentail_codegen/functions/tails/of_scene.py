"""Which tail a scene has."""

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
