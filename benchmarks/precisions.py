"""Nanoseconds a state of forward dynamics in double and float, and the largest error of v_dot.

Errors are over the largest entry, against 40 digits. The states can be held exactly by float, so
that the error comes from the arithmetic and, in float, from rounded parameters.
"""

from pathlib import Path

import numpy as np

import serpentail as st
from benchmarks.batches import STATES, ns_a_state, random_inputs
from benchmarks.models import FD, built, label
from tests.references.exact_chain import ExactChain
from tests.references.exact_continuum import ExactContinuum

EXACT = 10  # states that are compared with 40 digits


def measured(folder: Path) -> list[dict]:
    """Return a row for each tail."""
    rows = []
    for size in ((1, 3), (3, 4), (6, 6), (1, None), (3, None)):
        row: dict = {"model": label(*size)}
        for real in ("double", "float"):
            model = built(*size, functions=[FD], real=real)
            single, batch = ns_a_state(model, FD, random_inputs(model, FD, STATES))
            row |= {f"{real}, ns": single, f"side by side, {real}, ns": batch}
            row[f"error, {real}"] = error(model)
        rows.append(row)
    return rows


def error(model: st.Model) -> float:
    """Largest error of v_dot, over the largest entry of each state's."""
    own = model.parameters
    if model.links:
        exact = ExactChain(own, model.segments, model.links)
    else:
        exact = ExactContinuum(own, model.segments)
    states = [x.astype(np.float32).astype(float) for x in random_inputs(model, FD, EXACT)]
    found = model.forward_dynamics(*states).astype(float)
    true = np.array([exact.forward_dynamics(*each) for each in zip(*states, strict=True)])
    return float((np.abs(found - true).max(axis=1) / np.abs(true).max(axis=1)).max())
