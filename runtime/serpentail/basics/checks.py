"""Checks of values that users give.

Each returns the value in a form to work with, or raises the given error. The error names the field,
the value and what the field needs.
"""

from collections.abc import Callable, Collection, Sequence
from operator import index
from typing import Any, TypeVar

import numpy as np
from numpy.typing import DTypeLike, NDArray

from serpentail_scene.messages import did_you_mean, shown
from serpentail_scene.rules import NumberRule
from serpentail_scene.units import in_unit

from .errors import SerpentailError, StateError

Error = type[Exception]
T = TypeVar("T")


class Refusals:
    """Collects the errors about the parts of a table, to raise them all at once."""

    def __init__(self, error: Error) -> None:
        self.error, self.lines = error, dict[str, list[str]]()

    def add(self, part: str, line: str) -> None:
        """Add a line about a part."""
        self.lines.setdefault(part, []).append(line)

    def attempt(self, part: str, make: Callable[..., T], *arguments: Any) -> T | None:
        """Return ``make(*arguments)``; None if the part is refused now or was refused before."""
        if part in self.lines:
            return None
        try:
            return make(*arguments)
        except SerpentailError as error:
            self.add(part, str(error))
            return None

    def tell(self) -> None:
        """Raise the error about all refused parts, one line for each."""
        if self.lines:
            raise self.error("\n".join(line for lines in self.lines.values() for line in lines))


def refusal(field: str, value: object, needs: str, error: Error) -> Exception:
    """Return the error about a value that a field cannot have."""
    return error(needed(field, value, needs))


def needed(field: str, value: object, needs: str) -> str:
    """Return a line about a value that a field cannot have."""
    return f"{field}: value {shown(value)}: needs {needs}"


def real_array(
    field: str, value: object, error: Error = StateError, dtype: DTypeLike = np.float64
) -> NDArray[Any]:
    """Return real numbers of any shape as a contiguous array; they may be nan or infinite."""
    if type(value) is np.ndarray and value.dtype == dtype and value.flags.c_contiguous:
        return value
    try:
        array = np.asarray(value)
    except Exception as reason:  # whatever the __array__ of a foreign type raises
        symbols = type(value).__module__ == "casadi.casadi"
        told = ", or for symbols model.casadi" if symbols else ""
        raise error(
            f"{field}: type {type(value).__name__}: needs real numbers{told} ({reason})"
        ) from reason
    if np.ma.is_masked(value):
        raise error(
            f"{field}: {np.ma.count_masked(value)} masked entries: needs real numbers; use "
            "filled() to choose some"
        )
    if array.dtype.kind not in "fiu":
        if array.dtype.kind == "U":
            raise refusal(field, value, f"real numbers{_no_text(value) or ', not texts'}", error)
        own = ": take its .q or .v" if hasattr(value, "q") else ""
        kind = type(value).__name__ if array.dtype == object else array.dtype
        raise error(f"{field}: type {kind}: needs real numbers{own}")
    with np.errstate(
        over="ignore"
    ):  # numbers too large for float become inf, which is refused later
        return np.asarray(array, dtype, order="C")


def finite_array(
    field: str, value: object, error: Error = StateError, unit: str = ""
) -> NDArray[np.float64]:
    """Return finite real numbers of any shape as a contiguous array; texts are in the unit."""
    array = real_array(field, measured(field, value, unit, error) if unit else value, error)
    refuse_not_finite(field, array, error)
    return array


def refuse_not_finite(field: str, array: NDArray[Any], error: Error, whose: str = "") -> None:
    """Raise the error about the first entry that is nan or infinite, and whose it is."""
    if np.isfinite(array).all():
        return
    index = np.argwhere(~np.isfinite(array))[0].tolist()
    place = f"{field}{index or ''}{whose}"
    raise error(f"{place}: value {array[tuple(index)]}: needs a finite number")


def number(
    field: str,
    value: object,
    error: Error,
    *,
    unit: str = "",
    above: float = -np.inf,
    least: float = -np.inf,
    most: float = np.inf,
) -> float:
    """Return a finite number above one bound, not below another and not beyond the last.

    unit: that a text such as "20 ms" is converted to; none: texts are refused.
    """
    if type(value) is float and above < value < np.inf and least <= value <= most:
        return value
    value = measured(field, value, unit, error) if unit else value
    numbers, rule = numbers_in(value), NumberRule("", "", above, least, most)
    if numbers is None or numbers.shape != () or not satisfying(numbers, rule):
        raise refusal(field, value, f"a {_words('number', rule)}{_no_text(value)}", error)
    return float(numbers)


def whole_number(field: str, value: object, error: Error, *, least: int, most: int) -> int:
    """Return a whole number within bounds."""
    try:
        number = most + 1 if isinstance(value, bool | np.bool_) else index(value)  # type: ignore
    except TypeError:
        number = most + 1
    if not least <= number <= most:
        needs = f"a whole number from {least} to {most}{_no_text(value)}"
        raise refusal(field, value, needs, error)
    return number


def numbers(
    field: str,
    value: object,
    size: int,
    error: Error,
    *,
    unit: str = "",
    least: float = -np.inf,
    most: float = np.inf,
) -> NDArray[np.float64]:
    """Return finite numbers (size,) within bounds, texts as ``number``; one alone is repeated."""
    if type(value) is float and least <= value <= most and abs(value) < np.inf:
        return np.full(size, value)
    value = measured(field, value, unit, error) if unit else value
    numbers, rule = numbers_in(value), NumberRule("", least=least, most=most)
    shapes = ((), (size,))
    if numbers is None or numbers.shape not in shapes or not satisfying(numbers, rule).all():
        needs = f"one or {size} {_words('numbers', rule)}{_no_text(value)}"
        raise refusal(field, value, needs, error)
    return np.broadcast_to(numbers, (size,)).copy()


def measured(field: str, value: Any, unit: str | Sequence[str], error: Error) -> Any:
    """Return a value with each text such as "20 mN m", in arrays too, as a number in the unit."""
    try:
        return in_unit(value, unit)
    except ValueError as reason:
        raise error(f"{field}: value {shown(value)}: {reason}") from None


def numbers_in(value: object) -> NDArray[np.float64] | None:
    """Return real numbers of any shape as an array; None if the value is something else."""
    try:
        return real_array("", value, ValueError)
    except ValueError:
        return None


def satisfying(numbers: NDArray[np.float64], rule: NumberRule) -> NDArray[np.bool_]:
    """Tell which numbers are finite and within the limits of a rule."""
    above_least = (numbers > rule.above) & (numbers >= rule.least)
    return np.isfinite(numbers) & above_least & (numbers <= rule.most)


def _words(noun: str, rule: NumberRule) -> str:
    """Return the limits of a rule in words."""
    to = f" to {rule.most:g}" if rule.most < np.inf else ""
    if rule.above > -np.inf:
        return f"{noun} above {rule.above:g}{to}"
    return f"{noun} from {rule.least:g}{to}" if rule.least > -np.inf else f"finite {noun}{to}"


def _no_text(value: object) -> str:
    """Return the end of a line about a text where numbers belong; "" for other values."""
    if not isinstance(value, str):
        return ""
    try:
        float(value)
    except ValueError:
        return ", not a text"
    return ", not a text: remove the quotes"


def one_of(field: str, value: object, names: Collection[str], error: Error) -> str:
    """Return a value if it is one of the names; the error suggests the nearest one."""
    line = none_of(field, value, names)
    if line:
        raise error(line)
    return str(value)


def none_of(field: str, value: object, names: Collection[str]) -> str:
    """Return a line about a value that is not one of the names, with the nearest; else ""."""
    if isinstance(value, str) and value in names:
        return ""
    remedy = did_you_mean(value, names) or f"needs {' or '.join(map(repr, names))}"
    return f"{field}: value {shown(value)}: {remedy}"
