"""States of the functions that have batches, and what each of them gives alone."""

import numpy as np
import pytest

from serpentail.model.kernel import Kernel
from serpentail_codegen.targets.c.batch import BATCHED, PARTS

GROUND = PARTS["batch_contact"]
FREE = [name for name in BATCHED if name not in GROUND]  # of models without contacts

ARGUMENTS = {
    "mass_matrix": ("q",),
    "bias_force": ("q", "v"),
    "inverse_dynamics": ("q", "v", "v_dot"),
    "forward_dynamics": ("q", "v", "tau"),
    "inverse_dynamics_derivatives": ("q", "v", "v_dot"),
    "forward_dynamics_derivatives": ("q", "v", "tau"),
    "inverse_dynamics_vjp": ("q", "v", "v_dot", "multiplier"),
    "forward_dynamics_jvp": ("q", "v", "tau", "dq", "dv", "dtau"),
    "forward_dynamics_vjp": ("q", "v", "tau", "multiplier"),
    "inverse_dynamics_hessian": ("q", "v", "v_dot", "multiplier"),
    "airborne_rates": ("x", "tau", "angular"),
    "airborne_rates_derivatives": ("x", "tau", "angular"),
    "airborne_rates_hessian": ("x", "tau", "angular", "weights"),
    "contact_points": ("q", "v", "legs"),
    "leg_points": ("q", "angles"),
    "contact_dynamics": ("q", "v", "tau", "bristles", "legs"),
}


def in_lanes(monkeypatch):
    """From here on any batch is large, and it fails if states are evaluated one by one."""
    monkeypatch.setattr("serpentail.model.batch.MIN_BATCH", 1)
    monkeypatch.setattr(Kernel, "_each", lambda *_: pytest.fail("one by one"))


def states(model, count, seed=0):
    """Random states, one argument a name."""
    rng, tail = np.random.default_rng(seed), model.layout.nt
    sizes = {"q": model.nq, "v": model.nv, "v_dot": model.nv, "tau": tail}
    sizes |= {"multiplier": model.nv, "dq": model.nv, "dv": model.nv, "dtau": tail}
    sizes |= {"x": 4 + 2 * tail, "angular": 3, "weights": 7 + 2 * tail}
    return {name: rng.normal(size=(count, size)) for name, size in sizes.items()}


def given(model, values, name, *index):
    """The arguments of one function, of all states or of some; of legs only where there are."""
    inputs = [a["name"] for a in model.manifest["functions"][name]["inputs"]]
    return [values[argument][index] for argument in ARGUMENTS[name] if argument in inputs]


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
