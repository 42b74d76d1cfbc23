"""Nanoseconds a node of a plan, on one core: rates, then with Jacobian, then with Hessian.

Emitted: in C, one by one and side by side. CasADi: values, Jacobians and Hessians of the node of
the airborne formulation, whose dynamics is our C, 64 nodes in a map; drift and omega are among its
unknowns, and the cost is in it.
"""

from itertools import chain
from pathlib import Path

import numpy as np

import serpentail as st
from benchmarks.batches import STATES, ns_a_state, random_inputs
from benchmarks.models import built, label
from benchmarks.timing import best
from serpentail.planning.nlp.coordinates import attitude
from serpentail.planning.nlp.equations import equations_of_motion
from serpentail.planning.nlp.node import PARAMETERS, node_function, variables_of
from serpentail.planning.nlp.node_calls import MappedNode
from serpentail.planning.problem import SMOOTHING, PlanningProblem
from serpentail_scene.signatures.table import AIRBORNE, EXACT_DERIVATIVES

PER_PROCESSOR = True
SIZES = ((1, 3), (3, 2), (6, 2), (2, None))
NODES, ROUNDS = 64, 20


def measured(folder: Path) -> list[dict]:
    """Return a row for each tail and function."""
    rows, exact = (
        [],
        {n for name, orders in EXACT_DERIVATIVES.items() for n in (name, *chain(*orders))},
    )
    for size in SIZES:
        model = built(*size, functions=[*AIRBORNE, *sorted(exact)])
        beside = casadi_times(model)
        for name in AIRBORNE:
            single, batch = ns_a_state(model, name, random_inputs(model, name, STATES))
            row = {"function": name, "model": label(*size), "one by one, ns": single}
            row |= {"side by side, ns": batch, "CasADi, ns": beside[name]}
            rows.append(row | {"ratio": beside[name] / batch})
    return rows


def casadi_times(model: st.Model) -> dict[str, float]:
    """Return nanoseconds a node of CasADi's functions, by the names of ours."""
    import casadi as ca

    kind, tail = attitude("quaternion"), model.nv - 6
    start = np.zeros(model.nq), np.zeros(model.nv)
    task = st.Goal(), (0.5, 0.5), st.Bounds(), "effort", SMOOTHING, 0.0, (), None, None
    problem = PlanningProblem(*start, *task, "airborne", "quaternion")
    variables = variables_of("airborne", kind, tail, np.full(tail, 1e-3))
    node = node_function(model, problem, kind, variables, equations_of_motion(model, "compiled"))
    mapped = MappedNode(node.derivatives, np.linspace(0, 1, NODES))
    shapes = ((node.function.size1_in(0), NODES), (PARAMETERS, 1), (node.size, NODES))
    Z, p, mu = (ca.MX.sym("argument", *shape) for shape in shapes)
    values, jacobians = mapped.values(Z, p), mapped.jacobians(Z, p)
    results = [[values], [values, jacobians], [values, jacobians, mapped.hessians(Z, p, mu)]]
    rng = np.random.default_rng(3)
    given = [ca.DM(rng.normal(size=shape)) for shape in shapes]
    functions = (ca.Function("nodes", [Z, p, mu], outputs) for outputs in results)
    times = [best(lambda f=f: f(*given), ROUNDS) / NODES for f in functions]
    return dict(zip(AIRBORNE, times, strict=True))
