"""Microseconds for an implicit step of one run of 64 that stand, as `model.step` makes it.

10 steps in a call, on one core: run by run, and with runs as lanes.
"""

from pathlib import Path

import numpy as np

import serpentail as st
from benchmarks.ground_batches import SIZES, dropped, grounded
from benchmarks.models import label
from benchmarks.timing import best_of
from serpentail.model.stepping.makers import StepCall

PER_PROCESSOR = True
RUNS, ROUNDS = 64, 200
H, STEPS = 2e-4, 10  # s, and steps of a call
SETTLING, DAMPING = 100, 1e-5  # calls, N m s


def measured(folder: Path) -> list[dict]:
    """Return a row for each tail."""
    rows = []
    for size in SIZES:
        model = grounded(*size)
        values = settled(model)
        touching = (model.contact_dynamics(*values.values())[2][..., 2] > 0).sum(axis=1)
        single, lanes = step_times(model, values)
        row = {"model": label(*size), "points in the ground": f"{touching.min()}-{touching.max()}"}
        rows.append(
            row | {"run by run, us": single, "in lanes, us": lanes, "ratio": single / lanes}
        )
    return rows


def settled(model: st.Model) -> dict[str, np.ndarray]:
    """Return states that have come to stand, their tails damped."""
    values = dropped(model, RUNS)
    values["v"] *= 0.3
    values["legs"][:, 4:] = values["bristles"][:] = 0
    out = [values[name] for name in ("q", "v", "bristles")]
    given = {"legs": values["legs"], "bristles": out[2]}
    for _ in range(SETTLING):
        model.step(*out[:2], -DAMPING * values["v"][:, 6:], H, steps=STEPS, out=out, **given)
    return values


def step_times(model: st.Model, values: dict[str, np.ndarray]) -> tuple[float, float]:
    """Return microseconds a step: run by run, and in lanes."""
    stepping, legs = model.stepping, values["legs"].reshape(-1, 2, 4).swapaxes(1, 2).copy()
    parameters = stepping.parameters(model, None, RUNS)

    def once(way: int) -> None:
        state = [values[name].copy() for name in ("q", "v", "tau", "bristles")]
        statuses = np.zeros(RUNS, np.intc)
        held = StepCall(*state, legs, parameters, H, STEPS, "implicit_euler", statuses)
        maker = (stepping.singly, stepping.maker(model, held)[0])[way]
        maker.make(held, 0, RUNS)
        if statuses.any():
            raise RuntimeError(f"status {statuses.max()} of a run that stands")

    single, lanes = best_of((lambda: once(0), lambda: once(1)), ROUNDS)
    return single / (1e3 * RUNS * STEPS), lanes / (1e3 * RUNS * STEPS)
