"""The interface that gives the operations of a tape a meaning.

Numbers are one algebra, a tape is another: the same code evaluates a formula with the one, and
records it with the other.
"""

from fractions import Fraction
from typing import Any, Protocol

Number = int | float | Fraction


class Algebra(Protocol):
    """The operations of a tape; the algebra chooses the values on which they work."""

    def const(self, value: Number, /) -> Any:
        """An exact constant."""

    def unit(self, lane: int, lanes: int, /) -> Any:
        """A value of so many lanes, 1 in one and 0 elsewhere."""

    def lane(self, a: Any, lane: int, /) -> Any:
        """One lane of a value."""

    def placed(self, a: Any, lane: int, lanes: int, value: Any, /) -> Any:
        """A value of so many lanes with one of them replaced."""

    def neg(self, a: Any, /) -> Any:
        """-a."""

    def sin(self, a: Any, /) -> Any:
        """Sine."""

    def cos(self, a: Any, /) -> Any:
        """Cosine."""

    def sqrt(self, a: Any, /) -> Any:
        """Square root."""

    def add(self, a: Any, b: Any, /) -> Any:
        """a + b."""

    def sub(self, a: Any, b: Any, /) -> Any:
        """a - b."""

    def mul(self, a: Any, b: Any, /) -> Any:
        """a b."""

    def div(self, a: Any, b: Any, /) -> Any:
        """a / b."""

    def select(self, c: Any, a: Any, b: Any, /) -> Any:
        """a where c > 0, else b."""

    def decide(self, c: Any, /) -> bool | None:
        """Tell whether c > 0; None if the algebra cannot tell."""


def positive_in_lanes(c: Any) -> bool | None:
    """Tell if a number is positive, or all lanes of an array are; None if lanes differ in it."""
    positive = c > 0
    if not getattr(positive, "ndim", 0):
        return bool(positive)
    return bool(positive[0]) if (positive == positive[0]).all() else None
