"""What it takes to give the operations of a tape a meaning.

Numbers are one algebra, a tape is another: the same code then evaluates a formula, or records it.
"""

from fractions import Fraction
from typing import Any, Protocol

Number = int | float | Fraction


class Algebra(Protocol):
    """The operations of a tape; what they work on is up to the algebra."""

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
        """Whether c > 0; None where the algebra cannot tell."""
