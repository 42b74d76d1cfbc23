"""Starts, spans and sample times of runs, checked."""

import math
import os
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from serpentail_scene.layout import QUATERNION

from ..basics.checks import finite_array, number, real_array, refusal, refuse_not_finite
from ..basics.errors import SimulationError, StateError
from ..model.lazy import lazy_property
from ..model.model import Model

# by default, of one start and of each of many: a hundred samples take as long as a flight in lanes
INTERVALS, INTERVALS_OF_MANY = 200, 20
MOST_SAMPLES = 10_000_000  # of all runs: more are a mistake, and would fill the memory
SHORTEST = 1e-100  # s: between samples; methods multiply times
EPS = float(np.finfo(float).eps)
MOST_STEPS = 1e9  # of one run: hours
COPIES = 3  # of every sample: written by the C, stored in a trajectory, and derived


@dataclass(frozen=True, eq=False)
class Start:
    """Checked starts q0 (k, nq), v0 (k, nv) and output times.

    ``many``: k runs, not a single one.
    """

    q0: np.ndarray
    v0: np.ndarray
    start: float
    end: float
    intervals: int
    many: bool
    model: Model

    @classmethod
    def checked(
        cls,
        model: Model,
        state: tuple[ArrayLike, ArrayLike],
        t_span: ArrayLike,
        output_step: object,
    ) -> "Start":
        """Return starts; StateError or SimulationError if an argument is wrong."""
        q0, v0, many = checked_starts(model, state)
        # the grid of output times, the end among them
        start, end = checked_span(t_span)
        if output_step is None:
            output_step = (end - start) / (INTERVALS_OF_MANY if many else INTERVALS)
        step = number("output_step", output_step, SimulationError, unit="s", above=0)
        if len(q0) * (end - start) > MOST_SAMPLES * step:
            remedy = f"give {len(q0) * (end - start) / MOST_SAMPLES:.2g} s or more"
            whose = f" of {len(q0)} runs" if many else ""
            raise SimulationError(
                f"output_step {step:.3g}: more than {MOST_SAMPLES} samples{whose}: {remedy}"
            )
        checked = cls(q0, v0, start, end, max(1, round((end - start) / step)), many, model)
        least = max(SHORTEST, EPS * max(abs(start), abs(end)))
        if checked.interval < least:
            raise SimulationError(
                f"output_step {step:.3g}: too short to move the time: give {least:.2g} s or more"
            )
        refuse_overfull(model, checked.runs, checked.intervals + 1)
        return checked

    @property
    def runs(self) -> int:
        """Number of runs."""
        return len(self.q0)

    @property
    def interval(self) -> float:
        """Time between outputs."""
        return (self.end - self.start) / self.intervals

    @lazy_property
    def times(self) -> np.ndarray:
        """Output times (intervals + 1,)."""
        times = np.arange(self.intervals + 1) * self.interval + self.start
        times[-1] = self.end
        return times

    def sampled_at(self, times: np.ndarray) -> "Start":
        """Return the start of the same runs, with outputs at other times; first and last are."""
        other = replace(self, intervals=len(times) - 1)
        vars(other)["times"] = times
        return other


def checked_span(t_span: ArrayLike) -> tuple[float, float]:
    """Return start and end (s); SimulationError if they are wrong."""
    if type(t_span) is float and 0 < t_span < math.inf:
        return 0.0, t_span
    span = finite_array("t_span", t_span, SimulationError, "s")
    if span.shape not in ((), (2,)):
        raise refusal("t_span", t_span, "(start, end) in s, or the end", SimulationError)
    start, end = span.tolist() if span.ndim else (0.0, float(span))
    if not end > start:
        raise refusal("t_span", t_span, "an end after the start", SimulationError)
    return start, end


def checked_starts(
    model: Model, state: tuple[ArrayLike, ArrayLike]
) -> tuple[np.ndarray, np.ndarray, bool]:
    """Return q0 (k, nq), its quaternions unit ones, v0 (k, nv), and whether k runs were given."""
    q0 = checked_states("q0", state[0], model.nq)
    v0 = checked_states("v0", state[1], model.nv)
    many = q0.ndim == 2 or v0.ndim == 2
    q0, v0 = _paired(q0, v0)
    if model.fixed:
        return q0, v0, many
    norms = [math.hypot(*quaternion) for quaternion in q0[:, QUATERNION].tolist()]
    if not all(norms):
        where = f" of run {norms.index(0.0)}" if many else ""
        raise StateError(f"q0[3:7]{where} is the zero quaternion: upright is (1, 0, 0, 0)")
    q0[:, QUATERNION] /= np.array(norms)[:, None]
    return q0, v0, many


def checked_states(name: str, value: ArrayLike, size: int) -> np.ndarray:
    """Return finite vectors (size,) or (k, size); StateError names what is wrong."""
    array = real_array(name, value)
    if array.shape[-1:] != (size,) or array.ndim > 2 or not array.size:
        raise StateError(
            f"{name} has shape {array.shape}, not ({size},) of one start state, or (k, {size}) of "
            "k runs"
        )
    quickly = array.ndim == 1 and math.isfinite(np.vdot(array, array))  # large ones take threads
    if not quickly and not np.isfinite(array).all():
        rows = np.atleast_2d(array)
        run = int(np.isfinite(rows).all(axis=1).argmin())
        refuse_not_finite(name, rows[run], StateError, f" of run {run}" if array.ndim == 2 else "")
    return array


def _paired(q0: np.ndarray, v0: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return copies (k, size), a single one repeated; StateError if numbers of runs differ."""
    counts = {len(array) for array in (q0, v0) if array.ndim == 2}
    if len(counts) > 1:
        raise StateError(
            f"q0 has {len(q0)} runs, v0 {len(v0)}: give as many of both, or one of either"
        )
    if not counts:
        return np.array(q0, ndmin=2), np.array(v0, ndmin=2)
    runs = counts.pop()
    q0 = np.broadcast_to(q0, (runs, q0.shape[-1]))
    v0 = np.broadcast_to(v0, (runs, v0.shape[-1]))
    return np.array(q0, order="C"), np.array(v0, order="C")


def refuse_endless(name: str, step: float, span: float, most_steps: float = MOST_STEPS) -> None:
    """SimulationError if steps of at most this length (s) are too many for a span (s)."""
    if span > most_steps * step:
        raise SimulationError(
            f"{name} {step:.3g}: needs {span / step:.2g} steps, more than {most_steps:g}: give "
            f"{span / most_steps:.2g} s or more"
        )


def refuse_overfull(model: Model, runs: int, samples: int) -> None:
    """SimulationError if the samples of runs need more memory than this machine has."""
    width = model.nq + model.nv + model.layout.nt + 10 * sum(model.contacts.values())
    need, have = 8.0 * COPIES * width * samples * runs, memory()
    if need > have:
        whose = f" of each of {runs} runs" if runs > 1 else ""
        raise SimulationError(
            f"output_step: {samples} samples{whose} need {need / 1e9:.3g} GB, this machine has "
            f"{have / 1e9:.3g} GB: give a longer output_step, or fewer runs at once"
        )


def memory() -> float:
    """Return the memory (bytes) of this machine; infinite if unknown."""
    try:
        return float(os.sysconf("SC_PHYS_PAGES")) * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, ValueError, OSError):
        return math.inf
