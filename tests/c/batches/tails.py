"""States of the functions that have batches, and what each of them gives alone."""

import numpy as np
import pytest

from serpentail.model.kernel import Kernel
from serpentail_codegen.targets.c.batch import BATCHED, PARTS

GROUND = PARTS["batch_contact"]
UPRIGHT, LEGS = [1, 0, 0, 0], [3.66, -0.26, 3.66, -0.26, 0, 0, 0, 0]
TOUCHING = ("all", "some", "none")


def in_lanes(monkeypatch):
    """From here on any batch is large, and it fails if states are evaluated one by one."""
    monkeypatch.setattr("serpentail.model.library.MIN_BATCH", 1)
    monkeypatch.setattr(Kernel, "_each", lambda *_: pytest.fail("one by one"))


def states(model, count, seed=0):
    """Random states, one argument a name."""
    rng, tail = np.random.default_rng(seed), model.layout.nt
    sizes = {"q": model.nq, "v": model.nv, "v_dot": model.nv, "tau": tail}
    sizes |= {"multiplier": model.nv, "dq": model.nv, "dv": model.nv, "dtau": tail}
    sizes |= {"x": 4 + 2 * tail, "angular": 3, "weights": 7 + 2 * tail}
    return {name: rng.normal(size=(count, size)) for name, size in sizes.items()}


def on_ground(model, touching, seed=0):
    """Random states by name, one for each word of ``touching``: how many points press there.

    With "some", the height of the animal is drawn between those of its lowest and highest point.
    """
    rng, count = np.random.default_rng(seed), len(touching)
    q, v = np.zeros((count, model.nq)), 0.3 * rng.normal(size=(count, model.nv))
    v[:, 2] -= 1  # m/s: points in the ground press, for they sink
    q[:, 3:7] = UPRIGHT + 0.2 * rng.normal(size=(count, 4))
    q[:, 7:] = 0.3 * rng.normal(size=(count, model.nv - 6))
    legs = LEGS + 0.1 * rng.normal(size=(count, 8))
    values = {"q": q, "v": v, "legs": legs, "angles": legs[:, :4].copy()}
    values["tau"] = 1e-4 * rng.normal(size=(count, model.nv - 6))
    values["bristles"] = 1e-3 * rng.normal(size=(count, 2 * sum(model.contacts.values())))
    for k, word in enumerate(touching):
        points = model.kernel("contact_points")(*given(model, values, "contact_points", k))[0]
        heights = np.sort(points[:, 2])
        between = rng.uniform(heights[0], heights[-1])
        q[k, 2] = -{"all": heights[-1] + 1e-3, "some": between, "none": heights[0] - 0.01}[word]
    return values


def given(model, values, name, *index):
    """The arguments of one function, of all states or of some."""
    return [values[a["name"]][index] for a in model.manifest["functions"][name]["inputs"]]


def evaluated(model, name, values):
    """All numbers that a function gives: of one state, or a row for each of many."""
    outputs = model.kernel(name)(*values)
    outputs = outputs if isinstance(outputs, tuple) else (outputs,)
    lead = np.shape(values[0])[:-1]
    return np.concatenate([np.reshape(o, (*lead, -1)) for o in outputs], axis=-1)


def alone(model, name, values):
    """Every state by a call of its own."""
    count = len(next(iter(values.values())))
    rows = [evaluated(model, name, given(model, values, name, k)) for k in range(count)]
    return np.array(rows)


def batched(model):
    """Names of a model's functions that have batches."""
    return [name for name in BATCHED if name in model.manifest["batch"]["work"]]
