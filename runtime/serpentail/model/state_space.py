"""The equations of motion as x_dot = f(x, u): x = (q, v) is one state, u the joint torques.

p_dot is the velocity, q_t_dot are the rates of the tail, and the quaternion follows
q_dot = q (0, omega) / 2 + RATE (1 - |q|^2) q, whose last term brings the norm back to 1 after an
integrator's errors and is 0 there. The other accelerations depend on its direction alone.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from serpentail_scene.layout import OMEGA, POSITION, QUATERNION, TAIL_Q, TAIL_V, VELOCITY, Layout

from ..basics.attitude import quaternion_rate
from ..basics.errors import StateError

Array = NDArray[Any]
RATE = 1.0  # 1/s: an error e of the norm decays as exp(-2 RATE t)


def split(layout: Layout, x: Array) -> tuple[Array, Array]:
    """Return q (..., nq), v (..., nv) of states x (..., nq + nv); StateError for other widths."""
    if x.ndim < 1 or x.shape[-1] != layout.nq + layout.nv:
        raise StateError(
            f"x has shape {x.shape}: needs {layout.nq + layout.nv} numbers, q ({layout.nq}) and v "
            f"({layout.nv}), or rows of them"
        )
    return x[..., : layout.nq], x[..., layout.nq :]


def q_dot(q: Array, v: Array) -> Array:
    """Return dq/dt (..., nq)."""
    quaternion = q[..., QUATERNION]
    entries = (np.moveaxis(each, -1, 0) for each in (quaternion, v[..., OMEGA]))
    turning = np.stack(quaternion_rate(*entries), axis=-1)
    norm = 1 - (quaternion**2).sum(-1, keepdims=True)
    return np.concatenate(
        [v[..., VELOCITY], turning + RATE * norm * quaternion, v[..., TAIL_V]], axis=-1
    )


def product_matrix(quaternion: Array) -> Array:
    """Return M (..., 4, 3): the quaternion times (0, omega) is M omega."""
    w, x, y, z = np.moveaxis(quaternion, -1, 0)
    rows = [[-x, -y, -z], [w, -z, y], [z, w, -x], [-y, x, w]]
    return np.moveaxis(np.array(rows), (0, 1), (-2, -1))


def in_tangent(q: Array, x: Array, factor: float) -> Array:
    """Return a change of a unit q in its tangent space, factor 2, or a gradient, factor 1/2."""
    turn = factor * product_matrix(q[QUATERNION]).T @ x[QUATERNION]
    return np.concatenate([x[POSITION], turn, x[TAIL_Q]])


def in_numbers(q: Array, x: Array, factor: float) -> Array:
    """Return the reverse of ``in_tangent``: of a change with factor 1/2, or a gradient with 2."""
    numbers = factor * product_matrix(q[QUATERNION]) @ x[OMEGA]
    return np.concatenate([x[POSITION], numbers, x[TAIL_V]])


def jacobians_of_tail(nt: int, of_v_dot: tuple[Array, Array, Array]) -> tuple[Array, Array]:
    """Return the Jacobians of ``jacobians`` for a tail on a fixed base: q_dot is v."""
    by_q, by_v, by_tau = of_v_dot
    none, one = np.zeros_like(by_v), np.broadcast_to(np.eye(nt), by_v.shape)
    A = np.concatenate(
        [np.concatenate([none, one], axis=-1), np.concatenate([by_q, by_v], axis=-1)], axis=-2
    )
    return A, np.concatenate([np.zeros_like(by_tau), by_tau], axis=-2)


def jacobians(
    layout: Layout, q: Array, v: Array, of_v_dot: tuple[Array, Array, Array]
) -> tuple[Array, Array]:
    """Return d(x_dot)/dx (..., nx, nx) and d(x_dot)/du (..., nx, 2m).

    of_v_dot: the Jacobians of v_dot with respect to q in its tangent space, v and tau.
    """
    if layout.fixed:
        return jacobians_of_tail(layout.nt, of_v_dot)
    by_turns, by_v, by_tau = of_v_dot
    quaternion, shape = q[..., QUATERNION], by_v.shape[:-2]
    products, square = product_matrix(quaternion), (quaternion**2).sum(-1)[..., None, None]
    size = layout.nq + layout.nv
    A, B = np.zeros((*shape, size, size)), np.zeros((*shape, size, layout.nt))

    # kinematics: velocities move, the quaternion turns and keeps its norm
    speeds = A[..., : layout.nq, layout.nq :]
    speeds[..., POSITION, VELOCITY] = np.eye(3)
    speeds[..., QUATERNION, OMEGA] = products / 2
    speeds[..., TAIL_Q, TAIL_V] = np.eye(layout.nt)
    outer = quaternion[..., :, None] * quaternion[..., None, :]
    restoring = RATE * ((1 - square) * np.eye(4) - 2 * outer)
    A[..., QUATERNION, QUATERNION] = turning_matrix(v[..., OMEGA]) / 2 + restoring

    # dynamics: a change of the quaternion is the turn 2 vec(conj(q) dq) / |q|^2
    dynamics = A[..., layout.nq :, : layout.nq]
    dynamics[..., POSITION] = by_turns[..., VELOCITY]
    dynamics[..., QUATERNION] = by_turns[..., OMEGA] @ (2 * np.swapaxes(products, -1, -2) / square)
    dynamics[..., TAIL_Q] = by_turns[..., TAIL_V]
    A[..., layout.nq :, layout.nq :] = by_v
    B[..., layout.nq :, :] = by_tau
    return A, B


def turning_matrix(omega: Array) -> Array:
    """Return W (..., 4, 4): a quaternion q times (0, omega) is W q."""
    x, y, z = np.moveaxis(omega, -1, 0)
    o = np.zeros_like(x)
    rows = [[o, -x, -y, -z], [x, o, z, -y], [y, -z, o, x], [z, y, -x, o]]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)
