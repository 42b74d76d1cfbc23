"""Laws of airborne states: their rates are those of the whole animal, derivatives are slopes."""

import numpy as np

from serpentail_scene.layout import OMEGA, QUATERNION, TAIL_V, VELOCITY

from ..basics.attitude import quaternion_rate, rotation_matrix
from ..model.model import Model
from .derivative_laws import slopes
from .errors import relative, sensitivity
from .law import PIECEWISE, SLOPE_LIMIT, VALUE_LIMIT, Errors, law
from .states import Case

# accelerations are quotients in q_t: differences follow them in smaller steps than sines
NEARER = 8.0


@law("airborne_rates momentum forward_dynamics mass_matrix", VALUE_LIMIT)
def airborne_rates_are_those_of_the_animal(model: Model, s: Case) -> Errors:
    """With omega of an airborne state the animal has its angular momentum, but in air the omega
    that is given; its tail accelerates as q_t_ddot says, relative to cond(H).
    """
    nt = model.layout.nt
    y = model.airborne_rates(s.x, s.tau, s.angular).astype(float)
    turning, rates, accelerations, _, omega = np.split(y, (4, 4 + nt, 4 + 2 * nt, len(s.x)))
    v = np.concatenate([np.zeros(3), omega, s.v[TAIL_V]])
    condition = sensitivity(model, s.q)
    if s.drift.size:
        v[VELOCITY] = rotation_matrix(s.q[QUATERNION]) @ s.drift[:3] + model.parameters["wind"]
        error = {"omega": relative(omega, s.drift[3:])}
    else:
        tail = model.momentum(s.q, v * np.repeat([0, 1], [OMEGA.stop, nt]))[1].astype(float)
        momentum, scale = model.momentum(s.q, v)[1], abs(s.angular) + abs(tail)
        error = {"momentum": relative(momentum, s.angular, scale) / condition}
    v_dot = model.forward_dynamics(s.q, v, s.tau)[TAIL_V].astype(float)
    return error | {
        "q_t_ddot": relative(accelerations, v_dot) / condition,
        "q_t_dot": relative(rates, s.v[TAIL_V]),
        "quaternion": relative(turning, quaternion_rate(s.q[QUATERNION], omega)),
    }


def direction(s: Case) -> np.ndarray:
    """Return how (x, tau) moves along the state's directions."""
    turning = quaternion_rate(s.q[QUATERNION], s.dq[OMEGA])
    return np.concatenate([turning, s.dq[TAIL_V], s.dv[TAIL_V], 0 * s.drift, s.dtau])


def block_errors(
    model: Model, s: Case, product: np.ndarray, slope: tuple[np.ndarray, np.ndarray], last: str
) -> dict[str, float]:
    """Return the errors of a product against a slope by block, the last one of a name."""
    (change, largest), nt = slope, model.layout.nt
    edges = (0, 4, 4 + nt, 4 + 2 * nt, len(product))
    errors, size = {}, np.abs(change) + largest
    for name, a, b in zip(("c", "q_t", "q_t_dot", last), edges, edges[1:], strict=False):
        errors[name] = relative(product[a:b], change[a:b], size[a:b]) / sensitivity(model, s.q)
    return errors


@law("airborne_rates airborne_rates_derivatives mass_matrix", SLOPE_LIMIT, without=PIECEWISE)
def airborne_rates_change_by_their_jacobian(model: Model, s: Case) -> Errors:
    """The Jacobian of an airborne state's rates times a direction is their slope along it."""
    y, J = model.airborne_rates_derivatives(s.x, s.tau, s.angular)

    def rates(at: Case) -> np.ndarray:
        return model.airborne_rates(at.x, at.tau, s.angular)

    product = J.astype(float) @ direction(s)
    errors = {"values": relative(y, rates(s))}
    return errors | block_errors(model, s, product, slopes(model, s, rates, NEARER), "omega")


@law(
    "airborne_rates_derivatives airborne_rates_hessian mass_matrix", SLOPE_LIMIT, without=PIECEWISE
)
def airborne_gradient_changes_by_the_hessian(model: Model, s: Case) -> Errors:
    """The Hessian of weights^T y times a direction is the slope of weights^T J along it."""
    y, J, H = model.airborne_rates_hessian(s.x, s.tau, s.angular, s.weights)
    same = model.airborne_rates_derivatives(s.x, s.tau, s.angular)

    def gradient(at: Case) -> np.ndarray:
        return s.weights @ model.airborne_rates_derivatives(at.x, at.tau, s.angular)[1]

    values = {"values": relative(y, same[0]), "J": relative(J, same[1])}
    errors = values | {"symmetry": relative(H, H.T)}
    product = H.astype(float) @ direction(s)
    return errors | block_errors(model, s, product, slopes(model, s, gradient, NEARER), "tau")
