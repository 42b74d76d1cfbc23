"""Functions of a plan's nodes: airborne motion, with drift and omega eliminated."""

from .arguments import ANGULAR, TAU, Argument
from .signature import PLANNING, Signature

# fmt: off
X = Argument("x", ("airborne_state",),
    "airborne state: quaternion w x y z of any norm, tail coordinates (rad), their rates (rad/s)")
WEIGHTS = Argument("weights", ("airborne_results",), "weights, one for each row of y")
Y = Argument("y", ("airborne_results",),
    "rates of x, then omega (rad/s, body), which follows from the angular momentum")
J = Argument("J", ("airborne_results", "airborne_arguments"), "d(y)/d(x, tau)")
HESSIAN = Argument("hessian", ("airborne_arguments", "airborne_arguments"),
    "second derivatives of weights^T y with respect to (x, tau), both triangles")
SIGNATURES = (
    Signature("airborne_rates",
        "rates of an airborne state, from which translation and omega are eliminated",
        (X, TAU, ANGULAR), (Y,), PLANNING),
    Signature("airborne_rates_derivatives", "airborne_rates and its Jacobian",
        (X, TAU, ANGULAR), (Y, J), PLANNING),
    Signature("airborne_rates_hessian",
        "airborne_rates, its Jacobian, and the Hessian of weights^T y",
        (X, TAU, ANGULAR, WEIGHTS), (Y, J, HESSIAN), PLANNING),
)
