"""Jacobians of the weighted derivatives of the dynamics (``jac_adj1_f``)."""

from functools import partial

from .dynamics import DynamicsDerivatives
from .first_derivatives import first_derivatives, ports_in
from .ports import External, Port, pattern, zero


def tangent_hessian(e: External, f: DynamicsDerivatives) -> None:
    """Compute second derivatives by velocities: ``qq``, ``qv``, ``vv``, ``aq`` or ``tq``."""
    weights, blocks = f"adj_{f.gives}", ("qq", "qv", "vv", "aq")
    if f.name == "inverse_dynamics":
        e.call("inverse_dynamics_hessian", "q", "v", "v_dot", weights, *blocks)
    else:
        nv, nt = e.tail.nv, e.tail.nt
        e.call("forward_dynamics", "q", "v", "tau", "v_dot")
        e.call("mass_matrix", "q", "H")
        e.use("solve", "H", weights, mu=nv)
        e.call("inverse_dynamics_hessian", "q", "v", "v_dot", "mu", *blocks)
        e.use("eliminate", "dq", "dv", "dtau", *blocks, tq=nt * nv)


def second_derivatives(
    e: External, f: DynamicsDerivatives
) -> dict[tuple[str, str], tuple[str, int, int]]:
    """Compute second derivatives; return the array and strides of each block."""
    nq, nv, weights = e.tail.nq, e.tail.nv, f"adj_{f.gives}"
    last, rows = f.last, nv if f.last == "v_dot" else e.tail.nt
    first = first_derivatives(e, f)
    tangent_hessian(e, f)

    # from derivatives by velocities to those by the numbers of q
    e.use("quaternion_columns", "q", nv, "qq", half=nv * nq)
    e.use("quaternion_rows", "q", nq, "half", by_qq=nq * nq)
    e.use("weighted_rows", nq, "by_q", weights, q_gradient=nq)
    e.use("curvature", "q", "q_gradient", "by_qq")
    e.use("quaternion_rows", "q", nv, "qv", by_qv=nq * nv)
    e.use("quaternion_columns", "q", rows, "aq" if last == "v_dot" else "tq", by_last=rows * nq)

    # blocks are symmetric: each array serves two blocks
    sources = {
        ("q", "q"): ("by_qq", nq, 1),
        ("q", "v"): ("by_qv", nv, 1),
        ("v", "q"): ("by_qv", 1, nv),
    }
    sources |= {
        ("v", "v"): ("vv", nv, 1),
        (last, "q"): ("by_last", nq, 1),
        ("q", last): ("by_last", 1, nq),
    }
    columns = {"q": nq, "v": nv, last: rows}
    return sources | {(a, weights): (array, 1, columns[a]) for a, array in first.items()}


def hessian(e: External, f: DynamicsDerivatives, sizes: dict[str, int]) -> None:
    """Make ``jac_adj1_f``; second derivatives by parameters are NaN, because the C does not compute
    them.
    """
    sources = second_derivatives(e, f)
    known = f.by_parameters(e.works)
    e.inputs = ports_in(f, sizes, known, 3)
    if known:
        e.unknown("unknown")
    for a in (*f.inputs, "parameters"):
        for port in ports_in(f, sizes, known, 2):
            b, shape = port.name, (sizes[a], port.pattern[0])
            source: tuple[str, int, int] | tuple[()]
            if (a, b) in sources:
                blocks, source = pattern(*shape, partial(f.curved, a, b)), sources[a, b]
            elif known and "parameters" in (a, b) and not b.startswith("out_"):
                blocks, source = pattern(*shape), ("unknown", 0, 0)
            else:
                blocks, source = pattern(*shape, zero), ()
            e.outputs.append(Port(f"jac_adj_{a}_{b}", blocks, *source))
