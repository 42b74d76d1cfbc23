"""Starts: a user's state, span and step go in; a checked start and output times come out."""

import math
from dataclasses import dataclass

import numpy as np

from ..errors import SimulationError, StateError
from ..library import real_array

MOST_SAMPLES = 10_000_000  # of one run: more are a slip, and fill the memory
SHORTEST = 1e-100  # s: between samples; methods multiply times
EPS = float(np.finfo(float).eps)


@dataclass(frozen=True)
class Start:
    """A checked start and output grid."""

    q0: np.ndarray
    v0: np.ndarray
    start: float
    end: float
    intervals: int

    @classmethod
    def checked(cls, model, state, t_span, output_step) -> "Start":
        """Return a start; StateError or SimulationError where an argument is wrong."""
        q0, v0 = checked_state("q0", state[0], model.nq), checked_state("v0", state[1], model.nv)
        norm = math.hypot(*q0[3:7])
        if norm == 0:
            raise StateError("q0[3:7] is the zero quaternion: upright is (1, 0, 0, 0)")
        q0[3:7] /= norm
        span = real_array("t_span", t_span, error=SimulationError)
        if span.shape not in ((), (2,)):
            raise SimulationError(f"t_span {t_span!r}: give (start, end) in s, or the end")
        start, end = span.tolist() if span.ndim else (0.0, float(span))
        if not (np.isfinite([start, end]).all() and end > start):
            raise SimulationError(f"t_span {t_span!r}: the end must be finite and after the start")
        step = positive("output_step", (end - start) / 200 if output_step is None else output_step)
        if end - start > MOST_SAMPLES * step:
            remedy = f"give {(end - start) / MOST_SAMPLES:.2g} s or more"
            raise SimulationError(f"output_step {step:.3g}: more than {MOST_SAMPLES} samples: {remedy}")
        checked = cls(q0, v0, start, end, max(1, round((end - start) / step)))
        least = max(SHORTEST, EPS * max(abs(start), abs(end)))
        if checked.interval < least:
            raise SimulationError(f"output_step {step:.3g}: too short to move the time: give {least:.2g} s or more")
        return checked

    @property
    def interval(self) -> float:
        """Time between outputs."""
        return (self.end - self.start) / self.intervals

    @property
    def times(self) -> np.ndarray:
        """Output times (intervals + 1,)."""
        return np.linspace(self.start, self.end, self.intervals + 1)


def checked_state(name: str, value, size: int) -> np.ndarray:
    """Return a copy of a finite vector; StateError names what is wrong."""
    array = real_array(name, value).copy()
    if array.shape != (size,):
        raise StateError(f"{name} has shape {array.shape}, not ({size},): one start state")
    if not np.isfinite(array).all():
        raise StateError(f"{name}[{np.flatnonzero(~np.isfinite(array))[0]}] is not finite")
    return array


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
