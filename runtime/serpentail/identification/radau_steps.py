"""Integrates all intervals of a mesh side by side, with exact derivatives.

Each interval is a step of the three-stage Radau IIA method (order 5), the collocation that plans
use. Newton's method solves its equations, and the implicit function theorem differentiates them, so
the derivatives are exact for the numerical results.
"""

from dataclasses import dataclass

import numpy as np

from serpentail_scene.layout import OMEGA, QUATERNION, TAIL_Q

from ..model.model import Model
from ..model.state_space import product_matrix
from ..optimal.rules import collocation_rule

NODES = collocation_rule(3).nodes  # of an interval
WEIGHTS = collocation_rule(3).integrals(NODES)  # Butcher's A
ITERATIONS = 12
TOLERANCE = 1e-11  # of the last Newton step, over the sizes of the states


@dataclass(frozen=True, eq=False)
class Intervals:
    """K intervals: spans (K,) s, states at the beginning (K, nx), torques at stages (K, 3, 2m)."""

    spans: np.ndarray
    begin: np.ndarray
    torques: np.ndarray


@dataclass(frozen=True, eq=False)
class EndDerivatives:
    """Derivatives of the ends of K intervals, in tangent numbers.

    They are with respect to the states at the beginning (K, 2nv, 2nv), the torques at both ends
    (K, 2, 2nv, 2m) and the parameters (K, 2nv, P).
    """

    by_state: np.ndarray
    by_torque: np.ndarray
    by_parameters: np.ndarray


def solved(model: Model, intervals: Intervals, guess: np.ndarray) -> np.ndarray | None:
    """Return the stages (K, 3, nx) of intervals from a guess; None if Newton's method fails."""
    begin, spans = intervals.begin, intervals.spans
    nx = begin.shape[1]
    X, scale = guess.copy(), 1 + np.abs(begin).max(axis=0)
    left = np.arange(len(begin))  # intervals that are not solved yet
    for _ in range(ITERATIONS):
        stages, h = X[left], spans[left, None, None]
        flat, u = stages.reshape(-1, nx), intervals.torques[left].reshape(len(left) * 3, -1)
        f = model.x_dot(flat, u).reshape(stages.shape)
        if not np.isfinite(f).all():
            return None
        residual = stages - begin[left, None] - h * (WEIGHTS @ f)
        J = model.x_dot_derivatives(flat, u)[0].reshape(*stages.shape, nx)
        step = np.linalg.solve(_matrix(J, spans[left]), residual.reshape(len(left), -1, 1))
        X[left] = stages - step.reshape(stages.shape)
        size = np.abs(step.reshape(stages.shape) / scale).max(axis=(1, 2))
        if not np.isfinite(size).all():
            return None
        left = left[size > TOLERANCE]
        if not len(left):
            return X
    return None


def _matrix(J: np.ndarray, spans: np.ndarray) -> np.ndarray:
    """Return the Newton matrix I - h A x J (K, 3nx, 3nx)."""
    count, stages, nx = J.shape[:3]
    blocks = (
        -spans[:, None, None, None, None]
        * WEIGHTS[:, None, :, None]
        * (J.transpose(0, 2, 1, 3)[:, None])
    )
    return blocks.reshape(count, stages * nx, stages * nx) + np.eye(stages * nx)


def differentiated(
    model: Model,
    intervals: Intervals,
    stages: np.ndarray,
    by_unknowns: np.ndarray,
    unknown_torques: bool,
) -> EndDerivatives:
    """Return the derivatives of solved intervals.

    by_unknowns: d(parameter struct) / d(unknowns); unknown_torques: whether to differentiate by the
    torques, too.
    """
    count, nx = intervals.begin.shape
    nq, nt, tangent = model.nq, model.layout.nt, 2 * model.nv
    flat, u = stages.reshape(-1, nx), intervals.torques.reshape(count * 3, -1)
    J, B = model.x_dot_derivatives(flat, u)
    J, B = J.reshape(count, 3, nx, nx), B.reshape(count, 3, nx, nt)

    # right-hand sides: a state at the beginning, torques at both ends, parameters
    sides = [np.broadcast_to(tangents(model, intervals.begin)[:, None], (count, 3, nx, tangent))]
    weighted = intervals.spans[:, None, None, None] * WEIGHTS
    if unknown_torques:
        for share in (1 - NODES, NODES):
            sides.append(np.einsum("kij,j,kjab->kiab", weighted[:, 0], share, B))
    if by_unknowns.any():
        by_struct = model.forward_dynamics_parameter_derivatives(flat[:, :nq], flat[:, nq:], u)
        C = (by_struct @ by_unknowns).reshape(count, 3, model.nv, -1)
        side = np.zeros((count, 3, nx, by_unknowns.shape[1]))
        side[:, :, nq:] = np.einsum("kij,kjab->kiab", weighted[:, 0], C)
        sides.append(side)
    right = np.concatenate(sides, axis=-1).reshape(count, 3 * nx, -1)
    by_side = np.linalg.solve(_matrix(J, intervals.spans), right)
    last = cotangents(model, stages[:, -1]) @ by_side[:, -nx:]

    # split by argument
    torques = 2 * nt if unknown_torques else 0
    by_torque = np.zeros((count, 2, tangent, nt))
    by_parameters = np.zeros((count, tangent, by_unknowns.shape[1]))
    if unknown_torques:
        by_torque[:, 0] = last[..., tangent : tangent + nt]
        by_torque[:, 1] = last[..., tangent + nt : tangent + torques]
    if by_unknowns.any():
        by_parameters = last[..., tangent + torques :]
    return EndDerivatives(last[..., :tangent], by_torque, by_parameters)


def tangents(model: Model, x: np.ndarray) -> np.ndarray:
    """Return dx / d(tangent) (..., nx, 2nv): shifts, turns in the body frame, tail, rates."""
    nq, nv = model.nq, model.nv
    T = np.zeros((*x.shape[:-1], nq + nv, 2 * nv))
    T[..., :3, :3] = np.eye(3)
    T[..., QUATERNION, OMEGA] = product_matrix(x[..., QUATERNION]) / 2
    T[..., TAIL_Q.start : nq, 6:nv] = np.eye(nv - 6)
    T[..., nq:, nv:] = np.eye(nv)
    return T


def cotangents(model: Model, x: np.ndarray) -> np.ndarray:
    """Return d(tangent) / dx (..., 2nv, nx), which undoes ``tangents``."""
    T = np.swapaxes(tangents(model, x), -1, -2).copy()
    square = (x[..., QUATERNION] ** 2).sum(-1)[..., None, None]
    T[..., OMEGA, QUATERNION] *= 4 / square
    return T


def moved(model: Model, x: np.ndarray, step: np.ndarray) -> np.ndarray:
    """Return states (..., nx) after steps (..., 2nv) in their tangent spaces, quaternions unit."""
    q = model.integrate(x[..., : model.nq], step[..., : model.nv], 1.0)
    return np.concatenate([q, x[..., model.nq :] + step[..., model.nv :]], axis=-1)


def difference(model: Model, to: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Return the steps (..., 2nv) from states x to others; turns as rotation vectors."""
    nq = model.nq
    moves = model.difference(x[..., :nq], to[..., :nq])
    return np.concatenate([moves, to[..., nq:] - x[..., nq:]], axis=-1)
