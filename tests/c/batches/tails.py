"""Batches: states side by side give what each of them gives alone, in any number, from any thread,
errors included.
"""

from functools import cache

import numpy as np

import serpentail as st
from serpentail_codegen.targets.c.batch import BATCHED, PARTS

from ...support.models import model_folder

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
}


@cache
def model(kind="articulated", segments=2, links=2, profile="fast", **options):
    """A model with all functions that have batches."""
    folder = model_folder(segments, links, name=f"{kind}_batch", functions=FREE, **options)
    return st.load(folder, profile=profile)


def states(model, count, seed=0):
    """Random states, one argument a name."""
    rng = np.random.default_rng(seed)
    sizes = {"q": model.nq, "v": model.nv, "v_dot": model.nv, "tau": model.nv - 6}
    sizes |= {"multiplier": model.nv, "dq": model.nv, "dv": model.nv, "dtau": model.nv - 6}
    tail = model.nv - 6
    sizes |= {"x": 4 + 2 * tail, "angular": 3, "weights": 7 + 2 * tail}
    return {name: rng.normal(size=(count, size)) for name, size in sizes.items()}


def given(arguments, name):
    """The arguments of one function."""
    return [arguments[a] for a in ARGUMENTS[name]]


def evaluated(model, name, values):
    """All numbers that a function gives: of one state, or a row for each of many."""
    outputs = model.kernel(name)(*values)
    outputs = outputs if isinstance(outputs, tuple) else (outputs,)
    lead = np.shape(values[0])[:-1]
    return np.concatenate([np.reshape(o, (*lead, -1)) for o in outputs], axis=-1)


def alone(model, name, arguments):
    """Every state by a call of its own."""
    states = zip(*given(arguments, name), strict=True)
    return np.array([evaluated(model, name, state) for state in states])
