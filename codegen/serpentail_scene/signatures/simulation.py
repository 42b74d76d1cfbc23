"""Functions for simulations: contact, tracking, implicit methods, and whole runs."""

from .arguments import (
    ACCELERATIONS,
    ANGLES,
    BRISTLE_RATES,
    BRISTLES,
    DAMPING,
    FACTORS,
    FORCES,
    GAINS,
    HEIGHTS,
    JOINTS,
    LEGS,
    POSITIONS,
    POWERS,
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
        "points that can touch the ground, and their velocities: A, M, T of the right foot, then "
        "of the left; the tail's points; the lowest point of the torso",
        (Q, V, LEGS),
        (POSITIONS, VELOCITIES),
        CONTACT,
        GROUND,
        needs="contacts",
    ),
    Signature(
        "leg_points",
        "positions of the joints of both legs, from the hips to the toes, Eqs. 5 to 9",
        (Q, ANGLES),
        (JOINTS,),
        CONTACT,
        GROUND,
        needs="feet",
    ),
    Signature(
        "contact_dynamics",
        "acceleration v_dot, Eq. 1, with the contact forces of the ground, Eqs. 35 to 37",
        (Q, V, TAU, BRISTLES, LEGS),
        (V_DOT, BRISTLE_RATES, FORCES),
        CONTACT,
        GROUND,
        needs="contacts",
    ),
    Signature(
        "contact_rates",
        "contact_dynamics, and the heights and powers that a simulation on the ground needs",
        (Q, V, TAU, BRISTLES, LEGS),
        (V_DOT, BRISTLE_RATES, FORCES, HEIGHTS, POWERS),
        SIMULATION,
        CALLED,
        needs="contacts",
    ),
    Signature(
        "pfl",
        "partial feedback linearisation: torques that give the tail desired accelerations in "
        "flight, Eq. 46",
        (Q, V, ACCELERATIONS),
        (TAU,),
        CONTROL,
        GROUND,
    ),
    Signature(
        "tracked_dynamics",
        "the torques of pfl, Eq. 46, and v_dot under them",
        (Q, V, ACCELERATIONS),
        (TAU, V_DOT),
        CONTROL,
        CALLED,
    ),
    Signature(
        "implicit_factor",
        "factors of 1 - w J, where J contains only contact, damping, passive tail and gains",
        (Q, V, DAMPING, GAINS, WEIGHT, BRISTLES, LEGS),
        (FACTORS,),
        IMPLICIT,
        CALLED,
    ),
    Signature(
        "implicit_solve",
        "solution k of (1 - w J) k = r",
        (
            FACTORS,
            nv_numbers("r_q", "right-hand side for q, in its tangent space"),
            nv_numbers("r_v", "right-hand side for v"),
            bristle_numbers("r_u", "right-hand side for the bristle deflections"),
        ),
        (
            nv_numbers("k_q", "solution for q, in its tangent space"),
            nv_numbers("k_v", "solution for v"),
            bristle_numbers("k_u", "solution for the bristle deflections"),
        ),
        IMPLICIT,
        CALLED,
    ),
    Signature(
        "implicit",
        "implicit_factor and implicit_solve, which solve the linear systems of implicit methods",
        (),
        (),
        IMPLICIT,
        GROUND,
    ),
    Signature(
        "rollout", "whole simulations in C, which st.simulate runs", (), (), SIMULATION, ALWAYS
    ),
)
