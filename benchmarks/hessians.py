"""Nanoseconds of the Hessian of lambda^T (H v_dot + C) from C, rounds interleaved.

Ours writes four square blocks, with zeros and both triangles of symmetric ones. CasADi: SX,
Jacobian of the gradient, cse, -O2, written as the same four blocks. Difference: largest relative
one.
"""

from pathlib import Path

import numpy as np

from benchmarks.jacobians import difference
from benchmarks.models import HESSIAN, built, by_clang, label, timed_function
from benchmarks.peers import casadi
from benchmarks.timing import States, compared, random_states

PER_PROCESSOR = True
PROCESSES = 3
SIZES = ((1, 3), (3, 4))
ROUNDS, CALLS = 200, 64


def measured(folder: Path) -> list[dict]:
    """Return a row for each tail."""
    rows = []
    for size in SIZES:
        model = built(*size, functions=[*casadi.IN_SX, HESSIAN])
        ours, states = timed_function(model, folder, HESSIAN), multiplied(random_states(size[0]))
        alike = casadi.in_casadi("hessian", casadi.hessian(model), model, folder)
        peers = {"CasADi": alike, "serpentail by clang": by_clang(model, folder, HESSIAN)}
        found = compared(ours, peers, states, ROUNDS, CALLS)
        errors = []
        for q, v, both in zip(*states, strict=True):
            blocks = np.hstack(model.inverse_dynamics_hessian(q, v, *np.split(both, 2)))
            errors += [difference(blocks, peer(q, v, both)[0]) for peer in alike.values()]
        rows.append({"model": label(*size)} | found | {"difference": max(errors)})
    return rows


def multiplied(states: States) -> States:
    """Return the states with an acceleration and multipliers instead of torques."""
    rng, shape = np.random.default_rng(0), states.v.shape
    return states._replace(rest=np.hstack([rng.uniform(-100, 100, shape), rng.normal(size=shape)]))
