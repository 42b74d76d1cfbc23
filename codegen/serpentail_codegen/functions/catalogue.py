"""All functions that a scene can ask for: names go in, what to assemble comes out."""

from .arguments import TAU, V_DOT, Q, V
from .contact import CONTACT
from .derivatives import jacobians
from .derivatives.differentiated import MULTIPLIER
from .derivatives.hessian import assemble_inverse_dynamics_hessian
from .function import Argument, Function
from .implicit.functions import IMPLICIT
from .pfl import FEEDBACK
from .plain import FUNCTIONS


def square(name: str, meaning: str) -> Argument:
    """Return a matrix argument (nv, nv)."""
    return Argument(name, lambda t: (t.nv, t.nv), meaning)


def row(name: str, meaning: str) -> Argument:
    """Return a vector argument (nv,)."""
    return Argument(name, lambda t: (t.nv,), meaning)


def three(name: str, meaning: str) -> Argument:
    """Return a matrix argument (3, nv)."""
    return Argument(name, lambda t: (3, t.nv), meaning)


DTAU_IN = Argument("dtau", lambda t: (t.nt,), "direction of tau")
DTAU_OUT = Argument("dtau", lambda t: (t.nt,), "lambda^T d(v_dot)/d(tau)")
DPARAMETERS = Argument(
    "dparameters",
    lambda t: (t.nv, jacobians.parameter_count(t)),
    "derivative with respect to the parameter struct's numbers",
)
_TABLE = (
    Function(
        "inverse_dynamics_derivatives",
        "Jacobians of H v_dot + C; that with respect to v_dot is H",
        (Q, V, V_DOT),
        (square("dq", "d(force)/d(q), q in its tangent space"), square("dv", "d(force)/d(v)")),
        jacobians.assemble_inverse_dynamics_derivatives,
    ),
    Function(
        "forward_dynamics_derivatives",
        "Jacobians of v_dot from Eq. 1",
        (Q, V, TAU),
        (
            square("dq", "d(v_dot)/d(q), q in its tangent space"),
            square("dv", "d(v_dot)/d(v)"),
            Argument("dtau", lambda t: (t.nv, t.nt), "d(v_dot)/d(tau)"),
        ),
        jacobians.assemble_forward_dynamics_derivatives,
    ),
    Function(
        "inverse_dynamics_parameter_derivatives",
        "Jacobian of H v_dot + C with respect to the parameters",
        (Q, V, V_DOT),
        (DPARAMETERS,),
        jacobians.assemble_inverse_dynamics_parameter_derivatives,
    ),
    Function(
        "forward_dynamics_parameter_derivatives",
        "Jacobian of v_dot from Eq. 1 with respect to the parameters",
        (Q, V, TAU),
        (DPARAMETERS,),
        jacobians.assemble_forward_dynamics_parameter_derivatives,
    ),
    Function(
        "inverse_dynamics_vjp",
        "gradient of lambda^T (H v_dot + C)",
        (Q, V, V_DOT, MULTIPLIER),
        (
            row("dq", "with respect to q, in its tangent space"),
            row("dv", "with respect to v"),
            row("dv_dot", "with respect to v_dot: H lambda"),
        ),
        jacobians.assemble_inverse_dynamics_vjp,
    ),
    Function(
        "forward_dynamics_jvp",
        "directional derivative of v_dot from Eq. 1",
        (
            Q,
            V,
            TAU,
            row("dq", "direction of q, in its tangent space"),
            row("dv", "direction of v"),
            DTAU_IN,
        ),
        (row("dv_dot", "derivative of v_dot"),),
        jacobians.assemble_forward_dynamics_jvp,
    ),
    Function(
        "forward_dynamics_vjp",
        "lambda^T times the Jacobians of v_dot from Eq. 1",
        (Q, V, TAU, MULTIPLIER),
        (
            row("dq", "lambda^T d(v_dot)/d(q), in the tangent space"),
            row("dv", "lambda^T d(v_dot)/d(v)"),
            DTAU_OUT,
        ),
        jacobians.assemble_forward_dynamics_vjp,
    ),
    Function(
        "inverse_dynamics_hessian",
        "second derivatives of lambda^T (H v_dot + C); with respect to v_dot twice, or v_dot and "
        "v, they are zero",
        (Q, V, V_DOT, MULTIPLIER),
        (
            square("qq", "with respect to q twice, in its tangent space (by the exponential map)"),
            square("qv", "row: q, column: v"),
            square("vv", "with respect to v twice"),
            square("aq", "row: v_dot, column: q; d(H lambda)/d(q)"),
        ),
        assemble_inverse_dynamics_hessian,
    ),
    Function(
        "energy_derivatives",
        "gradients of kinetic and potential energy",
        (Q, V),
        (
            row("kinetic_dq", "of the kinetic energy with respect to q, in its tangent space"),
            row("kinetic_dv", "of the kinetic energy with respect to v: H v"),
            row("potential_dq", "of the potential energy with respect to q, in its tangent space"),
        ),
        jacobians.assemble_energy_derivatives,
    ),
    Function(
        "momentum_derivatives",
        "Jacobians of linear and angular momentum",
        (Q, V),
        (
            three("linear_dq", "of the momentum with respect to q, in its tangent space"),
            three("linear_dv", "of the momentum with respect to v"),
            three("angular_dq", "of the angular momentum with respect to q, in its tangent space"),
            three("angular_dv", "of the angular momentum with respect to v"),
        ),
        jacobians.assemble_momentum_derivatives,
    ),
)
CATALOGUE = (
    FUNCTIONS | {function.name: function for function in _TABLE} | CONTACT | FEEDBACK | IMPLICIT
)
SYMBOLIC = FUNCTIONS | CONTACT | FEEDBACK  # those that the CasADi module builds of operations
