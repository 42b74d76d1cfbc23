"""Damped flights per second (200 steps of RK4, 11 samples), for the caller.

One call for each flight, and many flights in one call on all cores, each with its own parameters;
st.simulate decides whether those are integrated side by side in lanes. Last column: microseconds of
a flight of one step among 64, which is the cost of a run besides its steps.
"""

from pathlib import Path

import numpy as np

import serpentail as st
from benchmarks.batches import random_inputs
from benchmarks.models import FD, built, label
from benchmarks.timing import best

PER_PROCESSOR = True
FEW, MANY = 64, 6000  # the second number makes more than a million steps
SIZES = ((1, 3), (3, 4), (6, 6), (3, None))
MASSES = (0.003, 0.004)  # kg, of the tails of the first and of the last flight


def measured(folder: Path) -> list[dict]:
    """Return a row for each tail."""
    rows = []
    for size in SIZES:
        model = built(*size)
        row: dict = {"model": label(*size), "one call each, 1/s": single_rate(model)}
        for count in (FEW, MANY):
            row[f"{count} in a call, 1/s"] = 1e9 / flight_ns(model, count, 0.2, 0.02)
        rows.append(row | {"a run, us": flight_ns(model, FEW, 1e-3, 1e-3) / 1e3})
    return rows


def single_rate(model: st.Model) -> float:
    """Return flights a second, each by a call of its own."""
    q, v = starts(model, FEW)
    models = [model.with_parameters(tail_mass=mass) for mass in np.linspace(*MASSES, FEW)]
    calls, how = list(zip(models, q, v, strict=True)), settings(0.2, 0.02)
    return 1e9 * FEW / best(lambda: [st.simulate(*call, **how) for call in calls], 5)


def flight_ns(model: st.Model, count: int, t_span: float, output_step: float) -> float:
    """Return nanoseconds a flight, for a number of flights in one call."""
    q, v = starts(model, count)
    own, how = {"tail_mass": np.linspace(*MASSES, count)}, settings(t_span, output_step)
    return best(lambda: st.simulate(model, q, v, parameters=own, **how), 3) / count


def settings(t_span: float, output_step: float) -> dict:
    """Return the settings of a flight."""
    times = {"t_span": t_span, "output_step": output_step}
    return {"controller": st.Damping(1e-6), "step": 1e-3, "method": "rk4"} | times


def starts(model: st.Model, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return q, v of a number of starts."""
    q, v, _ = random_inputs(model, FD, count)
    q[:, 3] += 2
    return q, v
