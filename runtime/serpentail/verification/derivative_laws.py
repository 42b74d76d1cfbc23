"""Laws of derivatives: exact ones are the slopes of what they are derivatives of."""

from collections.abc import Callable, Iterable
from dataclasses import replace

import numpy as np

from serpentail_scene.layout import OMEGA

from ..model.model import Model
from .errors import block_error, blocks_of, relative, worst
from .law import PIECEWISE, SLOPE_LIMIT, Errors, fastest, law, slope
from .states import Case, at_origin


def slopes(
    model: Model, s: Case, f: Callable[[Case], np.ndarray], nearer: float = 1.0
) -> tuple[np.ndarray, np.ndarray]:
    """Return how fast a function changes along the state's directions, and the size of that.

    Its rounding scales with the size. nearer: by how much to shorten the steps.
    """
    s = at_origin(s)
    rate = nearer * max(1.0, fastest(model, s.dq))

    def along(time: float) -> np.ndarray:
        q = model.integrate(s.q, s.dq, time)
        there = replace(s, q=q, v=s.v + time * s.dv, tau=s.tau + time * s.dtau)
        return np.asarray(f(there), float)

    change, largest = slope(along, rate)
    return change, rate * largest


def block_slope_error(
    model: Model, x: np.ndarray, expected: tuple[np.ndarray, np.ndarray]
) -> float:
    """Return the error of a generalised force's derivative against a slope, block by block."""
    change, largest = expected
    return block_error(x, change, np.abs(change) + largest, blocks_of(model))


@law("inverse_dynamics inverse_dynamics_derivatives", SLOPE_LIMIT, without=PIECEWISE)
def inverse_dynamics_changes_by_its_jacobians(model: Model, s: Case) -> Errors:
    """dq, dv times a direction are the slope of H v_dot + C along it."""
    dq, dv = model.inverse_dynamics_derivatives(s.q, s.v, s.v_dot)
    return block_slope_error(
        model,
        dq @ s.dq + dv @ s.dv,
        slopes(model, s, lambda at: model.inverse_dynamics(at.q, at.v, s.v_dot)),
    )


@law(
    "mass_matrix inverse_dynamics forward_dynamics forward_dynamics_derivatives",
    SLOPE_LIMIT,
    without=PIECEWISE,
)
def forward_dynamics_changes_by_its_jacobians(model: Model, s: Case) -> Errors:
    """H times the change of v_dot is that of tau less the slope of H v_dot + C at fixed v_dot.

    H dtau = [0; 1].
    """
    v_dot, H = model.forward_dynamics(s.q, s.v, s.tau), model.mass_matrix(s.q).astype(float)
    dq, dv, dtau = (x.astype(float) for x in model.forward_dynamics_derivatives(s.q, s.v, s.tau))
    change, largest = slopes(model, s, lambda at: model.inverse_dynamics(at.q, at.v, v_dot))
    unit = np.eye(model.nv)[:, model.layout.tail_v]
    # terms of H times the change
    terms = np.abs(H) @ (np.abs(dq) @ np.abs(s.dq) + np.abs(dv) @ np.abs(s.dv))
    return {
        "dq, dv": block_slope_error(model, -H @ (dq @ s.dq + dv @ s.dv), (change, largest + terms)),
        "dtau": relative(H @ dtau, unit, np.abs(H) @ np.abs(dtau)),
    }


@law("forward_dynamics_derivatives forward_dynamics_jvp forward_dynamics_vjp", SLOPE_LIMIT)
def products_are_those_with_the_jacobians(model: Model, s: Case) -> Errors:
    """jvp is J d, vjp is lambda^T J, relative to the sum of |terms|."""
    J = [x.astype(float) for x in model.forward_dynamics_derivatives(s.q, s.v, s.tau)]
    directions = (s.dq, s.dv, s.dtau)
    jvp = model.forward_dynamics_jvp(s.q, s.v, s.tau, *directions)
    vjp = model.forward_dynamics_vjp(s.q, s.v, s.tau, s.multiplier)
    products = sum(j @ d for j, d in zip(J, directions, strict=True))
    terms = sum(np.abs(j) @ np.abs(d) for j, d in zip(J, directions, strict=True))
    return {"jvp": block_error(jvp, products, terms), "vjp": product_error(vjp, s.multiplier, J)}


def product_error(vjp: Iterable, multiplier: np.ndarray, jacobians: Iterable) -> float:
    """Return the largest error of lambda^T J, relative to the sum of |terms|."""
    return worst(
        relative(x, multiplier @ j, np.abs(multiplier) @ np.abs(j))
        for x, j in zip(vjp, jacobians, strict=True)
    )


@law("mass_matrix inverse_dynamics_derivatives inverse_dynamics_vjp", SLOPE_LIMIT)
def gradient_is_the_product_with_the_jacobians(model: Model, s: Case) -> Errors:
    """The gradient of lambda^T (H v_dot + C) is lambda^T times dq, dv and H."""
    J = [*model.inverse_dynamics_derivatives(s.q, s.v, s.v_dot), model.mass_matrix(s.q)]
    vjp = model.inverse_dynamics_vjp(s.q, s.v, s.v_dot, s.multiplier)
    return product_error(vjp, s.multiplier, [j.astype(float) for j in J])


@law("inverse_dynamics_vjp inverse_dynamics_hessian", SLOPE_LIMIT, without=PIECEWISE)
def gradient_changes_by_the_hessian(model: Model, s: Case) -> Errors:
    """The Hessian times a direction is the slope of the gradient along it; turns in q commute by
    half a bracket.
    """
    qq, qv, vv, aq = model.inverse_dynamics_hessian(s.q, s.v, s.v_dot, s.multiplier)

    def gradient(at: Case) -> np.ndarray:
        return np.concatenate(model.inverse_dynamics_vjp(at.q, at.v, s.v_dot, s.multiplier))

    change, largest = slopes(model, s, gradient)
    bracket = np.zeros(model.nv)
    bracket[OMEGA] = np.cross(gradient(s)[OMEGA], s.dq[OMEGA]) / 2
    products = (qq @ s.dq + qv @ s.dv + bracket, qv.T @ s.dq + vv @ s.dv, aq @ s.dq)
    errors = {"symmetry": worst(relative(x, x.T) for x in (qq, vv))}
    for k, name in enumerate(("q", "v", "v_dot")):
        part = slice(k * model.nv, (k + 1) * model.nv)
        errors[name] = relative(products[k], change[part], largest[part])
    return errors


@law("energy energy_derivatives mass_matrix", SLOPE_LIMIT, without=PIECEWISE)
def energies_change_by_their_gradients(model: Model, s: Case) -> Errors:
    """The gradients of both energies times a direction are their slopes.

    That of the kinetic energy with respect to v is H v.
    """
    kinetic_dq, kinetic_dv, potential_dq = model.energy_derivatives(s.q, s.v)
    change, largest = slopes(model, s, lambda at: np.hstack(model.energy(at.q, at.v)))
    products = np.array([kinetic_dq @ s.dq + kinetic_dv @ s.dv, potential_dq @ s.dq])
    momentum = model.mass_matrix(s.q).astype(float) @ s.v
    return {
        "slopes": worst(map(relative, products, change, largest + np.abs(change))),
        "H v": block_error(kinetic_dv, momentum),
    }


@law("momentum momentum_derivatives", SLOPE_LIMIT)
def momentum_changes_by_its_jacobians(model: Model, s: Case) -> Errors:
    """The Jacobians of both momenta times a direction are their slopes."""
    linear_dq, linear_dv, angular_dq, angular_dv = model.momentum_derivatives(s.q, s.v)
    change, largest = slopes(model, s, lambda at: np.stack(model.momentum(at.q, at.v)))
    linear, angular = linear_dq @ s.dq + linear_dv @ s.dv, angular_dq @ s.dq + angular_dv @ s.dv
    return worst(map(relative, (linear, angular), change, largest + np.abs(change)))


@law(
    "mass_matrix forward_dynamics inverse_dynamics_parameter_derivatives "
    "forward_dynamics_parameter_derivatives",
    SLOPE_LIMIT,
)
def parameters_move_both_dynamics_alike(model: Model, s: Case) -> Errors:
    """H times a parameter's derivative of v_dot is minus that of H v_dot + C at the same v_dot."""
    v_dot, H = model.forward_dynamics(s.q, s.v, s.tau), model.mass_matrix(s.q).astype(float)
    forward = model.forward_dynamics_parameter_derivatives(s.q, s.v, s.tau).astype(float)
    inverse = model.inverse_dynamics_parameter_derivatives(s.q, s.v, v_dot).astype(float)
    sizes = np.abs(H) @ np.abs(forward) + np.abs(inverse)
    return worst(map(relative, H @ forward, -inverse, sizes))
