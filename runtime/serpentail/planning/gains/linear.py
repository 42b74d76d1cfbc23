"""Flights near a plan: linear equations of their errors, from the model's exact derivatives."""

from dataclasses import astuple, dataclass

import numpy as np

from ...basics.attitude import product
from ...model.model import Model
from ..result.plan import Plan

TURNED = slice(0, 3)  # entries of the attitude's error, in e and in z
MOST_POINTS = 500  # of a call: for many more, a model compiles lanes, which takes seconds


@dataclass(frozen=True, eq=False)
class LinearFlight:
    """Small errors at K points of a plan: z_dot = A z + B dtau, and e = E z.

    z (n,): attitude (3; rad, as a rotation about the torso's axes), tail (rad), its rates (rad/s),
    and angular momentum (3; kg m^2/s, world), which is constant. e (n,): attitude, angular velocity
    (3; rad/s, torso axes), tail, its rates. n = 6 + 4 segments; dtau (2m,): N m.

    planned (K, 3 (2m) + 7): torques, quaternion, angular velocity, tail, its rates.
    """

    planned: np.ndarray
    A: np.ndarray
    B: np.ndarray
    E: np.ndarray


def linear_flight(model: Model, plan: Plan, k: np.ndarray, s: np.ndarray) -> LinearFlight:
    """Return the linear equations in intervals k (K,) of the plan at fractions s (K,) of them."""
    if len(k) > MOST_POINTS:
        places = range(0, len(k), MOST_POINTS)
        pairs = ((k[i : i + MOST_POINTS], s[i : i + MOST_POINTS]) for i in places)
        parts = [astuple(linear_flight(model, plan, *pair)) for pair in pairs]
        return LinearFlight(*(np.concatenate(rows) for rows in zip(*parts, strict=True)))
    blocks, nt, points = plan.curve.inside(k, s), model.layout.nt, len(k)
    norm = np.linalg.norm(blocks["attitude"], axis=1, keepdims=True)
    x = np.concatenate([blocks["attitude"] / norm, blocks["tail"], blocks["tail_rate"]], axis=1)
    tau = blocks["torque"] - plan.problem.damping * blocks["tail_rate"]
    h = np.tile(model.momentum(*plan.start)[1], (points, 1))
    y, J = model.airborne_rates_derivatives(x, tau, h)
    turning = y[:, -3:]

    # y = (rates of x, omega) by z: the quaternion turns by q (0, phi) / 2
    turned = np.zeros((points, x.shape[1], 3 + 2 * nt))
    for i, axis in enumerate(np.eye(4)[1:]):
        turned[:, :4, i] = np.stack(product(x.T[:4], axis / 2), axis=1)
    turned[:, 4:, 3:] = np.eye(2 * nt)
    by_torque = J[:, :, x.shape[1] :]
    by_z = J[:, :, : x.shape[1]] @ turned
    by_z[:, :, 3 + nt :] -= plan.problem.damping * by_torque
    by_z = np.concatenate([by_z, _by_momentum(model, x, tau, h)], axis=2)

    # phi_dot = domega - omega x phi; the momentum stays
    n, omega, rates = 6 + 2 * nt, by_z[:, -3:], slice(4 + nt, 4 + 2 * nt)
    A, B, E = np.zeros((points, n, n)), np.zeros((points, n, nt)), np.zeros((points, n, n))
    A[:, TURNED] = omega
    A[:, TURNED, TURNED] += np.cross(turning[:, None], np.eye(3))
    A[:, 3 : 3 + nt, 3 + nt : 3 + 2 * nt] = np.eye(nt)
    A[:, 3 + nt : 3 + 2 * nt], B[:, 3 + nt : 3 + 2 * nt] = by_z[:, rates], by_torque[:, rates]
    E[:, TURNED, TURNED], E[:, 3:6], E[:, 6:, 3 : 3 + 2 * nt] = np.eye(3), omega, np.eye(2 * nt)
    planned = np.concatenate([blocks["torque"], x[:, :4], turning, x[:, 4:]], axis=1)
    return LinearFlight(planned, A, B, E)


def _by_momentum(model: Model, x: np.ndarray, tau: np.ndarray, h: np.ndarray) -> np.ndarray:
    """Return d(rates, omega) / d(angular momentum) (K, 7 + 2 (2m), 3).

    They are quadratic in it, so that central differences of any width are exact.
    """
    width = np.linalg.norm(h[0]) + np.linalg.norm(model.parameters["torso_inertia"])  # 1 rad/s
    pairs = [
        (model.airborne_rates(x, tau, h + a), model.airborne_rates(x, tau, h - a))
        for a in width * np.eye(3)
    ]
    return np.stack([(more - less) / (2 * width) for more, less in pairs], axis=2)
