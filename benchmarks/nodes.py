"""Times a plan's nodes: emitted functions beside the operations that CasADi derives."""

if __name__ == "__main__":
    from benchmarks import alone

    alone.main("nodes", __doc__)

from itertools import chain
from pathlib import Path

import numpy as np

import serpentail as st
from benchmarks.batches import best, c_times
from benchmarks.fixtures import built, label
from benchmarks.operations import needed
from serpentail.planning.nlp.coordinates import attitude
from serpentail.planning.nlp.equations import equations_of_motion
from serpentail.planning.nlp.node import PARAMETERS, node_function, variables_of
from serpentail.planning.nlp.node_calls import MappedNode
from serpentail.planning.problem import SMOOTHING, PlanningProblem
from serpentail_codegen.functions.catalogue import CATALOGUE
from serpentail_codegen.functions.tail import Tail
from serpentail_scene.signatures.table import AIRBORNE, EXACT_DERIVATIVES

SIZES = ((1, 3), (3, 2), (6, 2), (2, None))
NODES, ROUNDS = 64, 20


def node_times(folder: Path) -> list[dict]:
    """Nanoseconds a node, on one core: rates, with the Jacobian, with the Hessian of a weighted
    sum, too.

    Emitted: in C, one by one and side by side.  CasADi: values, Jacobians and Hessians of the node
    of the airborne formulation, whose dynamics is our C, 64 nodes in a map; drift and omega are
    among its unknowns, and the cost is in it.  Operations: those that a line without loops needs.
    """
    return [row for size in SIZES for row in node_rows(size)]


def node_rows(size: tuple) -> list[dict]:
    """Return the rows of one tail."""
    exact = {n for name, orders in EXACT_DERIVATIVES.items() for n in (name, *chain(*orders))}
    model = built(*size, functions=[*AIRBORNE, *sorted(exact)])
    casadi = casadi_times(model)
    return [node_row(model, size, name, casadi[name]) for name in AIRBORNE]


def node_row(model: st.Model, size: tuple, name: str, casadi: float) -> dict:
    """Return the times and operations of one function."""
    alone, together = c_times(model, name)
    row = {"function": name, "model": label(*size), "one by one, ns": alone}
    row |= {"side by side, ns": together, "CasADi, ns": casadi, "ratio": casadi / together}
    segments, links = size
    tail = Tail(segments, links or 1, "articulated" if links else "continuum")
    return row | {"operations": needed(CATALOGUE[name].of(tail), tail)}


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
