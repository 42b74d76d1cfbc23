"""Checks of what users give: numbers, arrays and names, each with an error that says what to do."""

from collections.abc import Collection
from difflib import get_close_matches

import numpy as np

from .errors import PlanningError, SimulationError, StateError


def finite_array(what: str, value) -> np.ndarray:
    """Return a value as a contiguous array; StateError where it is none of finite real numbers."""
    array = real_array(what, value)
    if not np.isfinite(array).all():
        raise StateError(f"{what} is not finite: give finite numbers")
    return array


def real_array(what: str, value, dtype=np.float64, error=StateError) -> np.ndarray:
    """Return a value as a contiguous array; raise ``error`` where it is none of real numbers."""
    try:
        array = np.asarray(value)
    except Exception as reason:  # whatever the __array__ of a foreign type raises
        raise error(f"{what} is not made of real numbers: {reason}") from reason
    if array.dtype.kind not in "fiu":
        raise error(f"{what} is not made of real numbers: its type is {array.dtype}")
    with np.errstate(over="ignore"):  # what float cannot hold becomes inf, which is refused later
        return np.asarray(array, dtype, order="C")


def known(field: str, value, names: Collection[str], error: type[Exception]) -> None:
    """Raise ``error``, with the nearest of the names, where a value is none of them."""
    if not isinstance(value, str) or value not in names:
        near = get_close_matches(value, names, 1) if isinstance(value, str) else []
        remedy = f"did you mean {near[0]!r}?" if near else f"needs {' or '.join(map(repr, names))}"
        raise error(f"{field}: value {value!r}: {remedy}")


def choice(field: str, value, names: Collection[str]) -> None:
    """PlanningError unless the value is a known name."""
    known(field, value, names, PlanningError)


def number(field: str, value, least: float = 0.0, above: bool = True) -> float:
    """Return a finite number above (or from) the least one; PlanningError else."""
    good = (
        isinstance(value, int | float | np.number)
        and not isinstance(value, bool)
        and np.isfinite(value)
    )
    if not good or value < least or (above and value == least):
        raise PlanningError(
            f"{field}: value {value!r}: needs a number {'above' if above else 'from'} {least:g}"
        )
    return float(value)


def numbers(field: str, value, size: int) -> np.ndarray:
    """Return finite numbers (size,), one given number repeated; PlanningError else."""
    try:
        array = np.asarray(value, float)
    except (TypeError, ValueError):
        raise PlanningError(f"{field}: value {value!r}: needs {size} numbers") from None
    if array.shape not in ((), (size,)) or not np.isfinite(array).all():
        raise PlanningError(f"{field}: value {value!r}: needs {size} finite numbers")
    return np.broadcast_to(array, (size,)).copy()


def positive(name: str, value) -> float:
    """Return a number above 0; SimulationError where it is none."""
    number = real_array(name, value, error=SimulationError)
    if number.shape != () or not 0 < number < np.inf:
        raise SimulationError(f"{name} {value!r}: give a number above 0")
    return float(number)


def finite(name: str, value) -> float:
    """Return a finite number; SimulationError where it is none."""
    number = real_array(name, value, error=SimulationError)
    if number.shape != () or not np.isfinite(number):
        raise SimulationError(f"{name} {value!r}: give a finite number")
    return float(number)
