"""Rules for values of a scene: words that complete "needs ...", a test, and the JSON Schema."""

import math
import sys
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True)
class NumberRule:
    """A rule for numbers, and its name in manifests if it is of parameters.

    of_body: the numbers are moments of inertia, none above the sum of the other two.
    """

    name: str
    words: str = ""
    above: float = -math.inf
    least: float = -math.inf
    most: float = math.inf
    of_body: bool = False

    def holds(self, numbers: Collection[Any]) -> bool:
        """Tell if all are finite numbers that satisfy the rule."""
        for x in numbers:
            if not is_finite(x) or not (self.above < x and self.least <= x <= self.most):
                return False
        return not self.of_body or 2 * max(numbers) <= sum(numbers) * ROUNDING

    @property
    def schema(self) -> dict[str, float]:
        """The JSON Schema of one number."""
        limits = {
            "exclusiveMinimum": self.above,
            "minimum": self.least,
            "maximum": self.most,
        }
        return {name: limit for name, limit in limits.items() if math.isfinite(limit)}


ROUNDING = 1 + 1e-12  # lets a flat body, with equal sums, pass
FINITE = NumberRule("finite")
POSITIVE = NumberRule("positive", "above 0", above=0)
NOT_NEGATIVE = NumberRule("not_negative", "0 or above", least=0)
BODY_INERTIA = NumberRule(
    "body_inertia", "above 0, none above the sum of the other two", above=0, of_body=True
)
FRACTION = NumberRule("fraction", "above 0 and up to 1", above=0, most=1)
# of parameters
NUMBER_RULES = {
    rule.name: rule for rule in (FINITE, POSITIVE, NOT_NEGATIVE, BODY_INERTIA, FRACTION)
}


def within(least: float, most: float) -> NumberRule:
    """Return the rule that numbers are between two limits."""
    return NumberRule("", f"from {least:g} to {most:g}", least=least, most=most)


def is_whole(x: object) -> bool:
    """Tell if x is an integer, but not true or false."""
    return isinstance(x, int) and not isinstance(x, bool)


def is_finite(x: Any) -> bool:
    """Tell if x is a number that a float can hold."""
    return (is_whole(x) or isinstance(x, float)) and abs(x) <= sys.float_info.max


@dataclass(frozen=True)
class KeyRule:
    """A rule for the value of a key."""

    text: str
    holds: Callable[[Any], bool]
    schema: Mapping[str, Any] = field(default_factory=dict)


ANY = KeyRule("", lambda _: True)
FLAG = KeyRule("true or false, without quotes", lambda x: isinstance(x, bool), {"type": "boolean"})
TEXT = KeyRule('a text, in "quotes"', lambda x: isinstance(x, str), {"type": "string"})
COUNT = KeyRule(
    "a whole number, 1 or above",
    lambda x: is_whole(x) and x >= 1,
    {"type": "integer", "minimum": 1},
)
TABLES = KeyRule(
    "tables, under lines [[phase]]",
    lambda x: isinstance(x, list | tuple) and all(isinstance(each, Mapping) for each in x),
    {"type": "array", "items": {"type": "object"}},
)


def table(name: str) -> KeyRule:
    """Return the rule that a value is a table."""
    text = f"a table, under a line [{name}]"
    return KeyRule(text, lambda x: isinstance(x, Mapping), {"type": "object"})


def one_of(names: Sequence[str]) -> KeyRule:
    """Return the rule that a value is one of these names."""
    text = " or ".join(f'"{name}"' for name in names)
    return KeyRule(text, lambda x: isinstance(x, str) and x in names, {"enum": list(names)})


def different(names: Sequence[str], text: str, least: int = 0) -> KeyRule:
    """Return the rule that a value is an array of different ones of these names."""

    def holds(value: Any) -> bool:
        listed = isinstance(value, list | tuple) and len(value) >= least
        return listed and all(name in names and value.count(name) == 1 for name in value)

    schema = {"type": "array", "items": {"enum": list(names)}, "uniqueItems": True}
    return KeyRule(text, holds, schema | ({"minItems": least} if least else {}))
