"""Exact derivatives of functions of one state."""

from .arguments import (
    DPARAMETERS,
    MULTIPLIER,
    TAU,
    V_DOT,
    Argument,
    Q,
    V,
    nv_by_nv,
    nv_numbers,
    three_by_nv,
)
from .signature import ALWAYS, DERIVATIVE, NAMED, Signature

SIGNATURES = (
    Signature(
        "inverse_dynamics_derivatives",
        "Jacobians of H v_dot + C with respect to q and v; the Jacobian with respect to v_dot is H",
        (Q, V, V_DOT),
        (
            nv_by_nv("dq", "d(force)/d(q), q in its tangent space"),
            nv_by_nv("dv", "d(force)/d(v)"),
        ),
        DERIVATIVE,
        NAMED,
    ),
    Signature(
        "forward_dynamics_derivatives",
        "Jacobians of v_dot, Eq. 1, with respect to q, v and tau",
        (Q, V, TAU),
        (
            nv_by_nv("dq", "d(v_dot)/d(q), q in its tangent space"),
            nv_by_nv("dv", "d(v_dot)/d(v)"),
            Argument("dtau", ("nv", "nt"), "d(v_dot)/d(tau)"),
        ),
        DERIVATIVE,
        ALWAYS,
    ),
    Signature(
        "inverse_dynamics_parameter_derivatives",
        "Jacobian of H v_dot + C with respect to the parameters",
        (Q, V, V_DOT),
        (DPARAMETERS,),
        DERIVATIVE,
        NAMED,
    ),
    Signature(
        "forward_dynamics_parameter_derivatives",
        "Jacobian of v_dot, Eq. 1, with respect to the parameters",
        (Q, V, TAU),
        (DPARAMETERS,),
        DERIVATIVE,
        NAMED,
    ),
    Signature(
        "inverse_dynamics_vjp",
        "gradients of lambda^T (H v_dot + C) with respect to q, v and v_dot",
        (Q, V, V_DOT, MULTIPLIER),
        (
            nv_numbers("dq", "gradient with respect to q, in its tangent space"),
            nv_numbers("dv", "gradient with respect to v"),
            nv_numbers("dv_dot", "gradient with respect to v_dot, H lambda"),
        ),
        DERIVATIVE,
        NAMED,
    ),
    Signature(
        "forward_dynamics_jvp",
        "directional derivative of v_dot, Eq. 1",
        (
            Q,
            V,
            TAU,
            nv_numbers("dq", "direction in q, in its tangent space"),
            nv_numbers("dv", "direction in v"),
            Argument("dtau", ("nt",), "direction in tau"),
        ),
        (nv_numbers("dv_dot", "derivative of v_dot along the direction"),),
        DERIVATIVE,
        NAMED,
    ),
    Signature(
        "forward_dynamics_vjp",
        "lambda^T times the Jacobians of v_dot, Eq. 1",
        (Q, V, TAU, MULTIPLIER),
        (
            nv_numbers("dq", "lambda^T d(v_dot)/d(q), q in its tangent space"),
            nv_numbers("dv", "lambda^T d(v_dot)/d(v)"),
            Argument("dtau", ("nt",), "lambda^T d(v_dot)/d(tau)"),
        ),
        DERIVATIVE,
        NAMED,
    ),
    Signature(
        "inverse_dynamics_hessian",
        "second derivatives of lambda^T (H v_dot + C); those with respect to v_dot twice, and to "
        "v_dot and v, are zero",
        (Q, V, V_DOT, MULTIPLIER),
        (
            nv_by_nv("qq", "with respect to q twice, in its tangent space (exponential map)"),
            nv_by_nv("qv", "with respect to q (row) and v (column)"),
            nv_by_nv("vv", "with respect to v twice"),
            nv_by_nv("aq", "with respect to v_dot (row) and q (column): d(H lambda)/d(q)"),
        ),
        DERIVATIVE,
        NAMED,
    ),
    Signature(
        "energy_derivatives",
        "gradients of kinetic and potential energy",
        (Q, V),
        (
            nv_numbers(
                "kinetic_dq",
                "gradient of the kinetic energy with respect to q, in its tangent space",
            ),
            nv_numbers("kinetic_dv", "gradient of the kinetic energy with respect to v, H v"),
            nv_numbers(
                "potential_dq",
                "gradient of the potential energy with respect to q, in its tangent space",
            ),
        ),
        DERIVATIVE,
        NAMED,
    ),
    Signature(
        "momentum_derivatives",
        "Jacobians of linear and angular momentum",
        (Q, V),
        (
            three_by_nv(
                "linear_dq",
                "Jacobian of the linear momentum with respect to q, in its tangent space",
            ),
            three_by_nv("linear_dv", "Jacobian of the linear momentum with respect to v"),
            three_by_nv(
                "angular_dq",
                "Jacobian of the angular momentum with respect to q, in its tangent space",
            ),
            three_by_nv("angular_dv", "Jacobian of the angular momentum with respect to v"),
        ),
        DERIVATIVE,
        NAMED,
    ),
)
