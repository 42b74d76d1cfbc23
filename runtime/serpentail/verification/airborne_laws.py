"""Laws of airborne states: their rates are those of the whole animal, derivatives are slopes."""

from collections.abc import Callable

import numpy as np

from serpentail_scene.layout import OMEGA, QUATERNION, TAIL_V

from ..basics.attitude import quaternion_rate
from ..model.model import Model
from .derivative_laws import along
from .errors import relative, sensitivity
from .law import PIECEWISE, SLOPE_LIMIT, VALUE_LIMIT, Errors, Law, fastest, registry, slope
from .states import State

# accelerations are quotients in q_t: differences follow them in smaller steps than sines
NEARER = 8.0
LAWS: list[Law] = []
law = registry(LAWS)


@law("airborne_rates", "momentum", "forward_dynamics", "mass_matrix", units=VALUE_LIMIT)
def airborne_rates_are_those_of_the_animal(model: Model, s: State) -> Errors:
    """With omega of an airborne state the animal has its angular momentum; its tail accelerates as
    q_t_ddot says, relative to cond(H).
    """
    nt = model.layout.nt
    y = model.airborne_rates(s.x, s.tau, s.angular).astype(float)
    turning, rates, accelerations, omega = np.split(y, (4, 4 + nt, 4 + 2 * nt))
    v = np.concatenate([np.zeros(3), omega, s.v[TAIL_V]])
    v_dot = model.forward_dynamics(s.q, v, s.tau)[TAIL_V].astype(float)
    tail = model.momentum(s.q, v * np.repeat([0, 1], [OMEGA.stop, nt]))[1].astype(float)
    condition = sensitivity(model, s.q)
    momentum = model.momentum(s.q, v)[1]
    return {
        "momentum": relative(momentum, s.angular, abs(s.angular) + abs(tail)) / condition,
        "q_t_ddot": relative(accelerations, v_dot) / condition,
        "q_t_dot": relative(rates, s.v[TAIL_V]),
        "quaternion": relative(turning, quaternion_rate(s.q[QUATERNION], omega)),
    }


def direction(s: State) -> np.ndarray:
    """Return how (x, tau) moves along the state's directions."""
    turning = quaternion_rate(s.q[QUATERNION], s.dq[OMEGA])
    return np.concatenate([turning, s.dq[TAIL_V], s.dv[TAIL_V], s.dtau])


def slopes(
    model: Model, s: State, f: Callable[[State], np.ndarray]
) -> tuple[np.ndarray, np.ndarray]:
    """Return how fast a function changes along the state's directions, and the size of that."""
    rate = NEARER * max(1.0, fastest(model, s.dq))
    change, largest = slope(lambda t: np.asarray(f(along(s, t)), float), rate)
    return change, rate * largest


@law(
    "airborne_rates",
    "airborne_rates_derivatives",
    "mass_matrix",
    units=SLOPE_LIMIT,
    without=PIECEWISE,
)
def airborne_rates_change_by_their_jacobian(model: Model, s: State) -> Errors:
    """The Jacobian of an airborne state's rates times a direction is their slope along it."""
    y, J = model.airborne_rates_derivatives(s.x, s.tau, s.angular)
    change, largest = slopes(model, s, lambda at: model.airborne_rates(at.x, at.tau, s.angular))
    product, nt = J.astype(float) @ direction(s), model.layout.nt
    errors = {"values": relative(y, model.airborne_rates(s.x, s.tau, s.angular))}
    edges = (0, 4, 4 + nt, 4 + 2 * nt, len(y))
    for name, a, b in zip(("c", "q_t", "q_t_dot", "omega"), edges, edges[1:], strict=False):
        size = np.abs(change[a:b]) + largest[a:b]
        errors[name] = relative(product[a:b], change[a:b], size) / sensitivity(model, s.q)
    return errors


@law(
    "airborne_rates_derivatives",
    "airborne_rates_hessian",
    "mass_matrix",
    units=SLOPE_LIMIT,
    without=PIECEWISE,
)
def airborne_gradient_changes_by_the_hessian(model: Model, s: State) -> Errors:
    """The Hessian of weights^T y times a direction is the slope of weights^T J along it."""
    y, J, H = model.airborne_rates_hessian(s.x, s.tau, s.angular, s.weights)
    same = model.airborne_rates_derivatives(s.x, s.tau, s.angular)

    def gradient(at: State) -> np.ndarray:
        return s.weights @ model.airborne_rates_derivatives(at.x, at.tau, s.angular)[1]

    change, largest = slopes(model, s, gradient)
    product, condition = H.astype(float) @ direction(s), sensitivity(model, s.q)
    errors = {
        "values": relative(y, same[0]),
        "J": relative(J, same[1]),
        "symmetry": relative(H, H.T),
    }
    nt = model.layout.nt
    edges = (0, 4, 4 + nt, 4 + 2 * nt, len(H))
    for name, a, b in zip(("c", "q_t", "q_t_dot", "tau"), edges, edges[1:], strict=False):
        size = np.abs(change[a:b]) + largest[a:b]
        errors[name] = relative(product[a:b], change[a:b], size) / condition
    return errors
