"""The cost and the error of float: time of forward dynamics against its error, beside double."""

if __name__ == "__main__":
    from benchmarks import alone

    alone.main("precisions", __doc__)

from pathlib import Path

import numpy as np

import serpentail as st
from benchmarks.batches import c_times, random_states
from benchmarks.fixtures import built, label
from tests.references.exact_chain import ExactChain
from tests.references.exact_continuum import ExactContinuum

EXACT = 10  # states that are compared with 40 digits


def precision_times(folder: Path) -> list[dict]:
    """Nanoseconds a state of forward dynamics, and the largest error of v_dot over its largest
    entry, 40 digits. The states can be held exactly by float, so that the error comes from the
    arithmetic and, in float, from rounded parameters.
    """
    rows = []
    for size in ((1, 3), (3, 4), (6, 6), (1, None), (3, None)):
        row = {"model": label(*size)}
        for real in ("double", "float"):
            model = built(*size, functions=["forward_dynamics"], real=real)
            alone, together = c_times(model)
            row |= {
                f"{real}, ns": alone,
                f"side by side, {real}, ns": together,
                f"error, {real}": error(model),
            }
        rows.append(row)
    return rows


def error(model: st.Model) -> float:
    """Largest error of v_dot, over the largest entry of each state's."""
    own = model.parameters
    exact = (
        ExactChain(own, model.segments, model.links)
        if model.links
        else ExactContinuum(own, model.segments)
    )
    states = [x.astype(np.float32).astype(float) for x in random_states(model, EXACT)]
    found = model.forward_dynamics(*states).astype(float)
    true = np.array([exact.forward_dynamics(*each) for each in zip(*states, strict=True)])
    return float((np.abs(found - true).max(axis=1) / np.abs(true).max(axis=1)).max())
