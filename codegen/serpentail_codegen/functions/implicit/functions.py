"""Implicit integrators' linear systems: a draft goes in, factoring and solving with 1 - w J are
added to it.

J is the Jacobian of the rates of (q in its tangent space, v, bristles), of contact, joint damping
and tracking gains alone.  With k_q = r_q + w k_v and the bristles eliminated, S (k_v - r_v) =
forces is left, S = H + stiffness, symmetric and positive definite but for points that slide: there
friction follows the load, and S takes two triangles. Eliminating translation is what the first
three pivots of S do.
"""

from ..arguments import Q, V
from ..contact import BRISTLES, LEGS
from ..function import Argument, Function
from .factor import assemble_factor
from .layout import factors_size
from .solve import assemble_solve

DAMPING = Argument(
    "damping", lambda t: (t.nt,), "of the tail's joints (N m s): tau = -damping q_t_dot"
)
GAINS = Argument(
    "gains", lambda t: (2,), "K_p (1/s^2), K_d (1/s) of tracking, through H_tt; zeros without"
)
WEIGHT = Argument(
    "weight",
    lambda t: (1 + (t.points > 0),),
    "w, weight of J: a method's coefficient times its step (s); with contacts then 1, or 0: "
    "friction's bound stays",
)
FACTORS = Argument("factors", lambda t: (factors_size(t),), "what implicit_solve needs")


def part(name: str, meaning: str) -> Argument:
    """Return an argument in the tangent space of q or in v."""
    return Argument(name, lambda t: (t.nv,), meaning)


def bristle_part(name: str, meaning: str) -> Argument:
    """Return an argument of the bristles."""
    return Argument(name, lambda t: (2 * t.points,), meaning)


_TABLE = (
    Function(
        "implicit_factor",
        "factors of 1 - w J, J of contact, joint damping and gains alone",
        (Q, V, DAMPING, GAINS, WEIGHT, BRISTLES, LEGS),
        (FACTORS,),
        assemble_factor,
    ),
    Function(
        "implicit_solve",
        "(1 - w J) k = r",
        (
            FACTORS,
            part("r_q", "right-hand side for q, in its tangent space"),
            part("r_v", "for v"),
            bristle_part("r_u", "for the bristles"),
        ),
        (
            part("k_q", "solution, in the tangent space"),
            part("k_v", "for v"),
            bristle_part("k_u", "for the bristles"),
        ),
        assemble_solve,
    ),
)
IMPLICIT = {function.name: function for function in _TABLE}
