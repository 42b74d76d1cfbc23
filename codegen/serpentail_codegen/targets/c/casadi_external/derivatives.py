"""Derivatives of the dynamics for CasADi: Jacobians (``jac_f``), their products with weights
(``adj1_f``), and the Jacobians of these (``jac_adj1_f``).
"""

from collections.abc import Collection
from dataclasses import dataclass
from functools import partial

from serpentail_scene.signatures.table import SIGNATURES

from .ports import External, Port, pattern, zero

# first number with an effect: neither the position of B nor its velocity
# matters
MOVING = {"q": 3, "v": 3}


def moves(name: str, k: int) -> bool:
    """Tell if some output depends on number k of an input."""
    return k >= MOVING.get(name, 0)


@dataclass(frozen=True)
class DynamicsDerivatives:
    """Inverse or forward dynamics, and the C functions that compute its derivatives."""

    name: str
    last: str
    gives: str
    jacobian: tuple[str, ...]
    adjoint: tuple[str, ...]
    hessian: tuple[str, ...]

    @property
    def inputs(self) -> tuple[str, ...]:
        """Inputs with derivatives."""
        return ("q", "v", self.last)

    def has(self, works: Collection[str], kind: str) -> bool:
        """Tell if the scene has the functions that a derivative needs."""
        parts = {
            "jac_": self.jacobian,
            "adj1_": self.adjoint,
            "jac_adj1_": self.adjoint + self.jacobian + self.hessian,
        }
        return {self.name, *parts[kind]} <= set(works)

    def by_parameters(self, works: Collection[str]) -> bool:
        """Tell if there are derivatives with respect to the parameters."""
        return f"{self.name}_parameter_derivatives" in works

    def depends(self, on: str, row: int, column: int) -> bool:
        """Tell if output ``row`` depends on input ``column``."""
        if on == "v_dot":  # H: the mass in its first corner
            return row == column or max(row, column) >= 3
        if on == "q" and self.name == "forward_dynamics" and column < 7:
            return row < 3 <= column  # the acceleration of B turns with the torso
        return moves(on, column)

    def curved(self, a: str, b: str, row: int, column: int) -> bool:
        """Tell if the weighted outputs have a second derivative by a[row] and b[column]."""
        if b == f"adj_{self.gives}":
            return self.depends(a, column, row)
        return moves(a, row) and moves(b, column)


DYNAMICS = (
    DynamicsDerivatives(
        "inverse_dynamics", "v_dot", "force", *SIGNATURES["inverse_dynamics"].exact
    ),
    DynamicsDerivatives("forward_dynamics", "tau", "v_dot", *SIGNATURES["forward_dynamics"].exact),
)


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
