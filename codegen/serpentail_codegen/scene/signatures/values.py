"""Functions of one state: terms of the equations of motion, energy, momentum and positions."""

from .arguments import (
    ANGULAR,
    F_EXT,
    FORCE,
    JACOBIANS,
    KINETIC,
    LINEAR,
    POINTS,
    POTENTIAL,
    TAU,
    V_DOT,
    Argument,
    H,
    Q,
    V,
    three_by_nv,
)
from .signature import ALWAYS, NAMED, VALUE, Signature

SIGNATURES = (
    Signature("mass_matrix", "H(q) of Eq. 2", (Q,), (H,), VALUE, ALWAYS),
    Signature("bias_force", "C(q, v) of Eq. 3, gravity included", (Q, V), (FORCE,), VALUE, ALWAYS),
    Signature(
        "inverse_dynamics",
        "H v_dot + C",
        (Q, V, V_DOT),
        (FORCE,),
        VALUE,
        ALWAYS,
        exact=(
            ("inverse_dynamics_derivatives", "mass_matrix"),
            ("inverse_dynamics_vjp",),
            ("inverse_dynamics_hessian",),
        ),
    ),
    Signature(
        "forward_dynamics",
        "v_dot from Eq. 1",
        (Q, V, TAU),
        (V_DOT,),
        VALUE,
        ALWAYS,
        exact=(
            ("forward_dynamics_derivatives",),
            ("forward_dynamics_vjp",),
            ("inverse_dynamics_hessian", "mass_matrix"),
        ),
    ),
    Signature(
        "forward_dynamics_external",
        "v_dot from Eq. 1, loads applied",
        (Q, V, TAU, F_EXT),
        (V_DOT,),
        VALUE,
        ALWAYS,
    ),
    Signature(
        "energy", "kinetic and potential energy", (Q, V), (KINETIC, POTENTIAL), VALUE, ALWAYS
    ),
    Signature("momentum", "linear and angular momentum", (Q, V), (LINEAR, ANGULAR), VALUE, ALWAYS),
    Signature("tail_points", "Eqs. 13 to 15", (Q,), (POINTS,), VALUE, ALWAYS),
    Signature("tail_point_jacobians", "Eqs. A5 to A8", (Q,), (JACOBIANS,), VALUE, ALWAYS),
    Signature(
        "center_of_mass",
        "centre of mass of the whole animal",
        (Q, V),
        (
            Argument("position", (3,), "its position (m, world)"),
            Argument("velocity", (3,), "its velocity (m/s, world): J v"),
            three_by_nv("J", "its Jacobian, world"),
        ),
        VALUE,
        ALWAYS,
    ),
    Signature(
        "mass_matrix_world",
        "H for (p_dot, omega in world axes, q_t_dot)",
        (Q,),
        (H,),
        VALUE,
        NAMED,
    ),
    Signature(
        "bias_force_world",
        "C for (p_dot, omega in world axes, q_t_dot)",
        (Q, V),
        (FORCE,),
        VALUE,
        NAMED,
    ),
)
