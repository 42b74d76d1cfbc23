"""Jacobians of the dynamics (``jac_f``), and their products with weights (``adj1_f``)."""

from functools import partial

from .dynamics import DynamicsDerivatives
from .ports import External, Port, pattern, zero


def first_derivatives(e: External, f: DynamicsDerivatives) -> dict[str, str]:
    """Compute Jacobians; return the array of each, by input."""
    nv, nq = e.tail.nv, e.tail.nq
    if f.name == "inverse_dynamics":
        e.call("inverse_dynamics_derivatives", "q", "v", "v_dot", "dq", "dv")
        e.call("mass_matrix", "q", "H")
    else:
        e.call("forward_dynamics_derivatives", "q", "v", "tau", "dq", "dv", "dtau")
    e.use("quaternion_columns", "q", nv, "dq", by_q=nv * nq)
    return {"q": "by_q", "v": "dv", f.last: "H" if f.last == "v_dot" else "dtau"}


def by_parameters(e: External, f: DynamicsDerivatives) -> dict[str, str]:
    """Compute the Jacobian with respect to the parameters, if the model can."""
    if not f.by_parameters(e.works):
        return {}
    e.call(f"{f.name}_parameter_derivatives", "q", "v", f.last, "dparameters")
    return {"parameters": "dparameters"}


def ports_in(f: DynamicsDerivatives, sizes: dict[str, int], known: bool, order: int) -> list[Port]:
    """Return the inputs of the Jacobian (order 1), the adjoint (2), and its Jacobian (3)."""
    names = (*f.inputs, "parameters")
    ports = [
        Port(
            n,
            pattern(sizes[n], 1),
            n if n in f.inputs else "",
            differentiable=n != "parameters" or known,
        )
        for n in names
    ]
    ports.append(Port(f"out_{f.gives}", pattern(sizes[f.gives], 1)))
    if order > 1:
        ports.append(Port(f"adj_{f.gives}", pattern(sizes[f.gives], 1), f"adj_{f.gives}"))
    if order > 2:
        ports += [Port(f"out_adj_{n}", pattern(sizes[n], 1)) for n in names]
    return ports


def jacobian(e: External, f: DynamicsDerivatives, sizes: dict[str, int]) -> None:
    """Make ``jac_f``."""
    arrays = first_derivatives(e, f) | by_parameters(e, f)
    e.inputs = ports_in(f, sizes, "parameters" in arrays, 1)
    for n in (*f.inputs, "parameters"):
        blocks = pattern(sizes[f.gives], sizes[n], partial(f.depends, n) if n in arrays else zero)
        e.outputs.append(Port(f"jac_{f.gives}_{n}", blocks, arrays.get(n, ""), sizes[n]))


def adjoint(e: External, f: DynamicsDerivatives, sizes: dict[str, int]) -> None:
    """Make ``adj1_f``."""
    weights = f"adj_{f.gives}"
    e.call(
        f"{f.name}_vjp",
        "q",
        "v",
        f.last,
        weights,
        "turn_gradient",
        "v_gradient",
        f"{f.last}_gradient",
    )
    e.use("quaternion_rows", "q", 1, "turn_gradient", q_gradient=e.tail.nq)
    known = bool(by_parameters(e, f))
    count = sizes["parameters"]
    if known:
        e.use("weighted_rows", count, "dparameters", weights, parameters_gradient=count)
    else:
        e.use("take", "NULL", count, parameters_gradient=count)
    e.inputs = ports_in(f, sizes, known, 2)
    for n in (*f.inputs, "parameters"):
        e.outputs.append(
            Port(
                f"adj_{n}",
                pattern(sizes[n], 1),
                f"{n}_gradient",
                differentiable=n in f.inputs or known,
            )
        )
