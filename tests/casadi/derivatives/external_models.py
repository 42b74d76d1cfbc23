"""Derivatives of compiled functions in CasADi: those of the SX functions, with exact sparsity, and
IPOPT takes them.
"""

import pytest

from serpentail_codegen.scene.signatures.table import EXACT_DERIVATIVES

from ...references.parameters import random_states
from ...support import collocation

PARTS = sorted(
    {part for name, orders in EXACT_DERIVATIVES.items() for part in (name, *orders[0], *orders[1])}
)
BY_PARAMETERS = [f"{name}_parameter_derivatives" for name in EXACT_DERIVATIVES]
TAILS = {"m1_n3": (1, 3), "m3_n4": (3, 4), "arcs1": (1, None), "arcs2": (2, None)}
LAST = {"inverse_dynamics": "v_dot", "forward_dynamics": "tau"}
KINDS = ("random", "straight", "folded")
every_function = pytest.mark.parametrize("name", EXACT_DERIVATIVES)


def inputs(model, name, state):
    """The inputs of a function at one state, parameters included."""
    q, v, v_dot, tau = state
    found = {"q": q, "v": v, "v_dot": v_dot, "tau": tau, "parameters": model.vector}
    return {key: found[key] for key in ("q", "v", LAST[name], "parameters")}


def states(model):
    """States by name: each kind of tail, one at rest, one whose quaternion has another norm."""
    rows = {
        kind: [x[0].copy() for x in random_states(model.scene.segments, 3, 1, kind)]
        for kind in KINDS
    }
    rows["still"] = [x.copy() for x in rows["random"]]
    rows["still"][1][:] = 0
    rows["long"] = [x.copy() for x in rows["random"]]
    rows["long"][0][3:7] *= 1.7
    return rows


def pair(model, name, kind):
    """A derivative of the compiled function, and of the SX function."""
    return [
        collocation.derivatives(f)[kind]
        for f in (model.external(name), model.module.function(name))
    ]
