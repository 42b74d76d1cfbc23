"""Gradients of whole simulations: of the rates of a state, of margins, of implicit solves.

"Causes" are all that the rates of (v, bristles) at a time depend on, in one array: directions of q
in its tangent space, v, torques, bristles, legs, and the values of the parameter struct.
"""

from dataclasses import replace

from .arguments import BRISTLES, FACTORS, LEGS, TAU, Argument, Q, V, bristle_numbers, nv_numbers
from .signature import SIMULATION, Signature

# fmt: off
BRANCHES = Argument("branches", ("points", 2),
    "positive where a point in the ground presses, and where it slides: its branches")
MARGINS = Argument("margins", ("points", 3),
    "height (m), z + D_n z_dot (m), |t|^2 - (mu f_n)^2 (N^2) of each point")
SIGNATURES = (
    Signature("rates_vjp",
        "gradient of a weighted sum of v_dot and the rates of the bristles, by all causes",
        (Q, V, TAU, BRISTLES, LEGS, BRANCHES,
         Argument("weights", ("rates",), "weights of the rates")),
        (Argument("gradient", ("causes",), "gradient by q (tangent space), v, tau, bristles, legs, "
             "parameters"),),
        SIMULATION, called=True),
    Signature("rates_jvp",
        "derivative of v_dot and of the rates of the bristles along a change of all causes",
        (Q, V, TAU, BRISTLES, LEGS, BRANCHES,
         Argument("direction", ("causes",), "change, ordered as the gradient of rates_vjp")),
        (Argument("change", ("rates",), "change of v_dot, then of the bristles' rates"),),
        SIMULATION, called=True),
    Signature("margins",
        "what changes sign where the force of a point has a kink: where it touches, ceases to "
        "press, begins to slide",
        (Q, V, BRISTLES, LEGS), (MARGINS,), SIMULATION, called=True, needs="contacts"),
    Signature("margins_vjp",
        "gradient of a weighted sum of the margins, by all causes",
        (Q, V, BRISTLES, LEGS, replace(MARGINS, name="weights", meaning="weights of the margins")),
        (Argument("gradient", ("causes",), "gradient as of rates_vjp"),),
        SIMULATION, called=True, needs="contacts"),
    Signature("implicit_solve_transposed",
        "gradient of a weighted sum of implicit_solve's solution by its right-hand side",
        (FACTORS,
         nv_numbers("k_q", "weights of the solution for q"),
         nv_numbers("k_v", "weights of the solution for v"),
         bristle_numbers("k_u", "weights of the solution for the bristles")),
        (nv_numbers("r_q", "gradient by the right-hand side for q, in its tangent space"),
         nv_numbers("r_v", "gradient by the right-hand side for v"),
         bristle_numbers("r_u", "gradient by the right-hand side for the bristles")),
        SIMULATION, called=True),
    Signature("gradients",
        "gradients of whole simulations in C, which `vjp` and `jvp` of a trajectory run",
        (), (), SIMULATION),
)
