"""Functions that simulations are made of: contact, tracking, implicit methods, and whole runs."""

from .arguments import (
    ACCELERATIONS,
    BRISTLE_RATES,
    BRISTLES,
    DAMPING,
    FACTORS,
    FORCES,
    GAINS,
    LEGS,
    POSITIONS,
    TAU,
    V_DOT,
    VELOCITIES,
    WEIGHT,
    Q,
    V,
    bristle_numbers,
    nv_numbers,
)
from .signature import ALWAYS, CALLED, CONTACT, CONTROL, GROUND, IMPLICIT, SIMULATION, Signature

SIGNATURES = (
    Signature(
        "contact_points",
        "points that can touch the ground: A, M, T of the right foot, of the left; tail; the "
        "torso's lowest",
        (Q, V, LEGS),
        (POSITIONS, VELOCITIES),
        CONTACT,
        GROUND,
    ),
    Signature(
        "contact_dynamics",
        "v_dot from Eq. 1 with the forces of the ground, Eqs. 35 to 37",
        (Q, V, TAU, BRISTLES, LEGS),
        (V_DOT, BRISTLE_RATES, FORCES),
        CONTACT,
        GROUND,
    ),
    Signature(
        "pfl",
        "torques in flight that give the tail wanted accelerations, Eq. 46",
        (Q, V, ACCELERATIONS),
        (TAU,),
        CONTROL,
        GROUND,
    ),
    Signature(
        "tracked_dynamics",
        "torques in flight that give the tail wanted accelerations, Eq. 46, and v_dot under them",
        (Q, V, ACCELERATIONS),
        (TAU, V_DOT),
        CONTROL,
        CALLED,
    ),
    Signature(
        "implicit_factor",
        "factors of 1 - w J, J of contact, joint damping and gains alone",
        (Q, V, DAMPING, GAINS, WEIGHT, BRISTLES, LEGS),
        (FACTORS,),
        IMPLICIT,
        CALLED,
    ),
    Signature(
        "implicit_solve",
        "(1 - w J) k = r",
        (
            FACTORS,
            nv_numbers("r_q", "right-hand side for q, in its tangent space"),
            nv_numbers("r_v", "for v"),
            bristle_numbers("r_u", "for the bristles"),
        ),
        (
            nv_numbers("k_q", "solution, in the tangent space"),
            nv_numbers("k_v", "for v"),
            bristle_numbers("k_u", "for the bristles"),
        ),
        IMPLICIT,
        CALLED,
    ),
    Signature(
        "implicit",
        "linear systems of implicit methods",
        (),
        (),
        IMPLICIT,
        GROUND,
    ),
    Signature("rollout", "whole simulations", (), (), SIMULATION, ALWAYS),
)
