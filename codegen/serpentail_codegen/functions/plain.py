"""The functions that are neither derivatives nor contact: what to assemble for each name."""

from functools import partial

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
    H,
    Q,
    V,
)
from .dynamics import (
    assemble_acceleration,
    assemble_energy,
    assemble_inverse_dynamics,
    assemble_mass_matrix,
    assemble_momentum,
)
from .function import Function
from .kinematics import assemble_tail_point_jacobians, assemble_tail_points

_TABLE = (
    Function("mass_matrix", "H(q) of Eq. 2", (Q,), (H,), assemble_mass_matrix),
    Function(
        "bias_force",
        "C(q, v) of Eq. 3, gravity included",
        (Q, V),
        (FORCE,),
        assemble_inverse_dynamics,
    ),
    Function("inverse_dynamics", "H v_dot + C", (Q, V, V_DOT), (FORCE,), assemble_inverse_dynamics),
    Function("forward_dynamics", "v_dot from Eq. 1", (Q, V, TAU), (V_DOT,), assemble_acceleration),
    Function(
        "forward_dynamics_external",
        "v_dot from Eq. 1, loads applied",
        (Q, V, TAU, F_EXT),
        (V_DOT,),
        assemble_acceleration,
    ),
    Function(
        "energy", "kinetic and potential energy", (Q, V), (KINETIC, POTENTIAL), assemble_energy
    ),
    Function(
        "momentum", "linear and angular momentum", (Q, V), (LINEAR, ANGULAR), assemble_momentum
    ),
    Function("tail_points", "Eqs. 13 to 15", (Q,), (POINTS,), assemble_tail_points),
    Function(
        "tail_point_jacobians", "Eqs. A5 to A8", (Q,), (JACOBIANS,), assemble_tail_point_jacobians
    ),
    Function(
        "mass_matrix_world",
        "H for (p_dot, omega in world axes, q_t_dot)",
        (Q,),
        (H,),
        partial(assemble_mass_matrix, world=True),
    ),
    Function(
        "bias_force_world",
        "C for (p_dot, omega in world axes, q_t_dot)",
        (Q, V),
        (FORCE,),
        partial(assemble_inverse_dynamics, world=True),
    ),
)
FUNCTIONS = {function.name: function for function in _TABLE}
