"""Nanoseconds a state on the ground, on one core: one by one, and with states as lanes.

In each of 1024 states some points of feet, tail and torso may touch the ground.
"""

from functools import cache
from pathlib import Path

import numpy as np

import serpentail as st
from benchmarks.batches import ns_a_state
from benchmarks.models import built, label

PER_PROCESSOR = True
SIZES = ((1, 3), (3, 4), (3, None))
FUNCTIONS = ("contact_dynamics", "contact_points")
STATES = 1024
LEGS = [3.66, -0.26, 3.66, -0.26, 0, 0, 0, 0]


def measured(folder: Path) -> list[dict]:
    """Return a row for each tail and function."""
    rows = []
    for size in SIZES:
        model = grounded(*size)
        states = dropped(model, STATES)
        for name in FUNCTIONS:
            inputs = [states[argument] for argument in model.kernels[name].names]
            single, batch = ns_a_state(model, name, inputs)
            row = {"function": name, "model": label(*size), "one by one, ns": single}
            rows.append(row | {"side by side, ns": batch, "ratio": single / batch})
    return rows


@cache
def grounded(segments: int, links: int | None) -> st.Model:
    """Return a model that touches the ground with feet, tail and torso."""
    contacts = ["feet", "tail", "torso"]
    return built(segments, links, contacts=contacts, functions=[*FUNCTIONS, "rollout", "implicit"])


def dropped(model: st.Model, count: int) -> dict[str, np.ndarray]:
    """Return random states by name, their lowest points about as high as the ground."""
    rng, nt = np.random.default_rng(0), model.nv - 6
    q, v = np.zeros((count, model.nq)), 0.3 * rng.normal(size=(count, model.nv))
    q[:, 3:7] = [1, 0, 0, 0] + 0.1 * rng.normal(size=(count, 4))
    q[:, 7:] = 0.3 * rng.normal(size=(count, nt))
    legs = LEGS + 0.1 * rng.normal(size=(count, 8))
    lowest = model.contact_points(q, v, legs)[0][..., 2].min(axis=1)
    q[:, 2] = rng.uniform(-2e-3, 1e-3, count) - lowest
    bristles = 1e-4 * rng.normal(size=(count, 2 * sum(model.contacts.values())))
    tau = 1e-4 * rng.normal(size=(count, nt))
    return {"q": q, "v": v, "tau": tau, "bristles": bristles, "legs": legs}
