"""Tumbling kangaroo rats for tests of planning: a tail's sizes and a seed go in; a model and starts
come out.
"""

from functools import cache

import numpy as np

import serpentail as st
from serpentail_codegen.scene.signatures.table import EXACT_DERIVATIVES
from tests.support.models import model_folder

EXACT = sorted(
    {part for name, orders in EXACT_DERIVATIVES.items() for part in (name, *orders[0], *orders[1])}
)
FUNCTIONS = [*EXACT, "bias_force", "pfl", "energy", "momentum", "rollout", "tail_points"]
DURATION = 0.4  # s


@cache
def rat(segments: int = 1, links: int | None = 3, exact: bool = True) -> st.Model:
    """Return a model; without its exact second derivatives, plans take its SX functions."""
    functions = (
        FUNCTIONS
        if exact
        else ["mass_matrix", "forward_dynamics", "inverse_dynamics", *FUNCTIONS[-4:]]
    )
    return st.load(model_folder(segments, links, functions=list(dict.fromkeys(functions))))


def start(model: st.Model, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Return q0, v0 of a rat that was thrown up, pitched by a quarter turn or less, and turns about
    all axes.
    """
    random = np.random.default_rng(seed)
    q, v = np.zeros(model.nq), np.zeros(model.nv)
    pitch = random.uniform(0.4, 1.2)
    q[2:5] = 0.3, np.cos(pitch / 2), np.sin(pitch / 2)
    v[:3] = 0.0, -0.3, 2.4
    v[3:6] = random.uniform(-3, 3, 3)
    q[7:] = random.uniform(-0.2, 0.2, model.nq - 7)
    return q, v


@cache
def planned(**settings) -> st.Plan:
    """Return a plan for the first start, made once a process."""
    model = rat()
    bounds = st.Bounds(angle=np.pi / 3)
    return st.plan(
        model, start=start(model), duration=DURATION, bounds=bounds, track=False, **settings
    )
