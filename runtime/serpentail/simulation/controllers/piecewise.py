"""Piecewise polynomials of time, which the generated C can evaluate too."""

from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from ...basics.checks import finite_array, refusal
from ...basics.errors import SimulationError
from ...basics.short_repr import brief

# shares of the way over shares of the time, coefficients of their powers: at a constant rate; at a
# constant acceleration, so that the rate is largest at the end; the reverse, as a leg that yields;
# from rest to rest
SHAPES = {"linear": (0, 1), "accelerate": (0, 0, 1), "decelerate": (0, 2, -1)}
SHAPES |= {"quintic": (0, 0, 0, 10, -15, 6)}
FASTEST = {"linear": 1.0, "accelerate": 2.0, "decelerate": 2.0, "quintic": 1.875}  # largest rates
JUMP_TOLERANCE = 1e-9  # a jump that is smaller, over the largest value, is rounding


@dataclass(frozen=True, eq=False)
class Piecewise:
    """Piecewise polynomials of time, with one or more channels.

    Before the first time and after the last, the values there are held.

    Parameters
    ----------
    times : ndarray, shape (pieces + 1,)
        Increasing times (s) at which the pieces begin and end.
    coefficients : ndarray, shape (pieces, channels, degree + 1)
        Coefficients of the powers of ``t - times[k]``, constants first.

    Raises
    ------
    SimulationError
        The times do not increase, or the coefficients are not those of their pieces.
    """

    times: np.ndarray
    coefficients: np.ndarray
    __repr__ = brief

    def __post_init__(self) -> None:
        times, coefficients = np.asarray(self.times, float), np.asarray(self.coefficients, float)
        if times.ndim != 1 or len(times) < 2 or not (np.diff(times) > 0).all():
            raise refusal("Piecewise: times", self.times, "increasing times, in s", SimulationError)
        if coefficients.ndim != 3 or len(coefficients) != len(times) - 1:
            needs = f"an array ({len(times) - 1}, channels, degree + 1)"
            raise refusal("Piecewise: coefficients", coefficients.shape, needs, SimulationError)
        object.__setattr__(self, "times", times)
        object.__setattr__(self, "coefficients", coefficients)

    @property
    def channels(self) -> int:
        """Number of channels."""
        return self.coefficients.shape[1]

    @property
    def never_changes(self) -> bool:
        """Whether each channel is one constant."""
        return self.coefficients.shape[::2] == (1, 1)

    def as_lists(self) -> dict[str, Any]:
        """Return times and coefficients as lists, for JSON."""
        return {name: array.tolist() for name, array in vars(self).items()}

    def later(self, delay: float) -> Self:
        """Return the same functions, delayed.

        Parameters
        ----------
        delay : float
            Delay (s).

        Returns
        -------
        Piecewise
            The delayed functions.

        Raises
        ------
        SimulationError
            Rounding would make two of the times equal.
        """
        times = self.times + delay
        if not (np.diff(times) > 0).all():
            needs = "a time at which those of the controller still differ"
            raise refusal("Phases: times", delay, needs, SimulationError)
        return replace(self, times=times)

    def at(self, t: ArrayLike) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Evaluate values, rates and accelerations.

        At a time where two pieces meet, those of the later piece are returned.

        Parameters
        ----------
        t : array_like, shape () or (K,)
            Times (s).

        Returns
        -------
        values, rates, accelerations : ndarray, shape (channels,) or (K, channels)
            Values, and their first and second time derivatives.
        """
        t = np.asarray(t, float)
        if self.never_changes:
            value = self.coefficients[0, :, 0] + np.zeros((*t.shape, 1))
            return value, 0 * value, 0 * value
        inside = np.clip(t, self.times[0], self.times[-1])
        piece = np.clip(np.searchsorted(self.times, t, "right") - 1, 0, len(self.times) - 2)
        held = ((t < self.times[0]) | (t >= self.times[-1]))[..., None]
        x, c = (inside - self.times[piece])[..., None], self.coefficients[piece]
        value, rate, acceleration = (_horner(_derived(c, order), x) for order in range(3))
        return value, np.where(held, 0.0, rate), np.where(held, 0.0, acceleration)

    @np.errstate(over="ignore", invalid="ignore")  # a run refuses numbers that are not finite
    def kinks(self) -> np.ndarray:
        """Return the times at which any derivative jumps: longer steps miss what is short."""
        if self.never_changes:
            return self.times[:0]
        jumps = np.zeros(len(self.times), bool)
        for order in range(self.coefficients.shape[-1]):
            c = _derived(self.coefficients, order)
            widths = np.diff(self.times)[:, None]
            # each piece at both its ends, and the values held outside
            starts, ends, sizes = _horner(c, 0.0), _horner(c, widths), _horner(np.abs(c), widths)
            held = [starts[:1], ends[-1:]] if order == 0 else np.zeros((2, 1, self.channels))
            left, right = np.vstack([held[0], ends]), np.vstack([starts, held[1]])
            jumps |= (np.abs(left - right) > JUMP_TOLERANCE * sizes.max(initial=0)).any(axis=1)
            if jumps.all():
                break
        return self.times[jumps]


def _derived(coefficients: np.ndarray, order: int) -> np.ndarray:
    """Return the coefficients of the derivative of this order."""
    for _ in range(order):
        powers = np.arange(1, coefficients.shape[-1])
        coefficients = coefficients[..., 1:] * powers if len(powers) else 0 * coefficients
    return coefficients


def _horner(coefficients: np.ndarray, x: np.ndarray | float) -> np.ndarray:
    """Evaluate polynomials at x."""
    value = np.zeros(coefficients.shape[:-1])
    for k in reversed(range(coefficients.shape[-1])):
        value = value * x + coefficients[..., k]
    return value


def checked_nodes(
    what: str, name: str, nodes: tuple[ArrayLike, ArrayLike], width: int, unit: str = "rad"
) -> tuple[np.ndarray, np.ndarray]:
    """Return increasing times (K,) and values (K, width); SimulationError names what is wrong.

    unit: that texts among the values are converted to.
    """
    times = finite_array(f"{what}: times", nodes[0], SimulationError, "s")
    values = finite_array(f"{what}: {name}", nodes[1], SimulationError, unit)
    if times.ndim != 1 or len(times) == 0 or values.shape != (len(times), width):
        shapes = f"times {times.shape} and {name} {values.shape}, not (K,) and (K, {width})"
        raise SimulationError(f"{what}: {shapes}")
    if not (np.diff(times) > 0).all():
        raise refusal(f"{what}: times", times.tolist(), "increasing times, in s", SimulationError)
    return times, values


def linear(times: np.ndarray, values: np.ndarray) -> Piecewise:
    """Return straight lines between nodes; a single node gives a constant."""
    return shaped(times, values, "linear")


def shaped(times: np.ndarray, values: np.ndarray, *shapes: str) -> Piecewise:
    """Return ways from node to node, each of a shape of SHAPES, or all of one; a single node gives
    a constant.
    """
    if len(times) == 1:
        return constant(times[0], values[0])
    width = np.diff(times)[:, None]
    shares = np.zeros((len(width), 1, max(len(SHAPES[shape]) for shape in shapes)))
    for piece, shape in zip(shares, np.broadcast_to(shapes, len(width)), strict=True):
        piece[0, : len(SHAPES[shape])] = SHAPES[shape]
    with np.errstate(all="ignore"):
        rise, rows = np.diff(values, axis=0), [values[:-1]]
        rows += [shares[..., k] * rise / width**k for k in range(1, shares.shape[-1])]
    if not np.isfinite(rows).all():
        raise SimulationError(f"times {times.tolist()!s:.60}: too close to each other for values")
    return Piecewise(times, np.stack(rows, axis=-1))


def constant(time: float, values: np.ndarray) -> Piecewise:
    """Return values (channels,) that never change."""
    return Piecewise(np.array([time, time + 1.0]), np.asarray(values, float)[None, :, None])


def spline(times: np.ndarray, values: np.ndarray, ends: object = "not-a-knot") -> Piecewise:
    """Return the cubic spline through nodes; ``ends`` as of SciPy's CubicSpline."""
    from scipy.interpolate import CubicSpline

    coefficients = CubicSpline(times, values, bc_type=ends).c  # highest powers first
    return Piecewise(times, np.moveaxis(coefficients[::-1], 0, -1))
