"""Recovery: blocks of a planned motion go in; the model's q and v come out, with what a formulation
left out.
"""

import numpy as np

from ...attitude import rotation_matrix
from ..nlp.coordinates import Attitude


def full_state(model, start, coordinates: Attitude, times, blocks) -> tuple[np.ndarray, np.ndarray]:
    """Return q (K, nq), v (K, nv) at times (K,) s from the start (q0, v0); without f_ext the COM
    falls freely.
    """
    quaternion, tail, tail_rate = (
        coordinates.as_quaternion(blocks["attitude"]),
        blocks["tail"],
        blocks["tail_rate"],
    )
    R = rotation_matrix(quaternion)
    H = model.mass_matrix(_at_identity(tail))
    omega = blocks["torso_rate"]
    if "drift" in blocks:
        h = model.momentum(*start)[1]
        omega = _carrying(H, np.einsum("kji,j->ki", R, h), tail_rate)
    if "position" in blocks:
        position, velocity = blocks["position"], blocks["velocity"]
    else:
        position, velocity = _falling(
            model, start, times, (R, H), np.column_stack([omega, tail_rate])
        )
    return np.column_stack([position, quaternion, tail]), np.column_stack(
        [velocity, omega, tail_rate]
    )


def _at_identity(tail: np.ndarray) -> np.ndarray:
    q = np.zeros((len(tail), 7 + tail.shape[1]))
    q[:, 3], q[:, 7:] = 1.0, tail
    return q


def _carrying(H: np.ndarray, h: np.ndarray, tail_rate: np.ndarray) -> np.ndarray:
    """Angular velocity (K, 3) at which the momentum about the COM is h (K, 3), body axes, at no
    linear momentum.
    """
    momentum = np.column_stack([np.zeros_like(h), h]) - np.einsum(
        "kij,kj->ki", H[:, :6, 6:], tail_rate
    )
    return np.linalg.solve(H[:, :6, :6], momentum[..., None])[:, 3:, 0]


def _falling(model, start, times, turned, rates) -> tuple[np.ndarray, np.ndarray]:
    """Position and velocity (K, 3) of B: the COM's, less those of the COM from B; rates (omega,
    q_t_dot).
    """
    (R, H), (q0, v0) = turned, start
    mass = H[:, 0, 0][:, None]
    offset = np.einsum("kij,kj->ki", R, _com(H))
    drift = -np.einsum("kij,kjl,kl->ki", R, H[:, :3, 3:], rates)
    first = rotation_matrix(q0[3:7]) @ _com(model.mass_matrix(_at_identity(q0[None, 7:])))[0]
    v_com = model.momentum(q0, v0)[0] / mass[0]
    fall = np.array([0, 0, -model.parameters["gravity"]])
    t = np.asarray(times)[:, None]
    return q0[:3] + first + v_com * t + fall * t**2 / 2 - offset, v_com + fall * t + drift / mass


def _com(H: np.ndarray) -> np.ndarray:
    """COM (K, 3) from B in body axes: the block of H (K, nv, nv) for (p_ddot, omega_dot) is -mass
    skew(COM).
    """
    return np.column_stack([H[:, 1, 5], H[:, 2, 3], H[:, 0, 4]]) / H[:, 0, 0][:, None]
