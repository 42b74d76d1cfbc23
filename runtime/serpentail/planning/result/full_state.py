"""q and v of a planned motion, with the parts that the program eliminated.

The angular velocity follows from the conserved angular momentum, the position from the free fall of
the COM. In air nothing is eliminated but the position, which the curve has.
"""

import numpy as np

from serpentail_scene.layout import OMEGA, POSITION, QUATERNION, TAIL_Q, TAIL_V, TORSO_NV, VELOCITY

from ...basics.attitude import rotation_matrix
from ...model.chains import bend_ranges
from ...model.model import Model
from ...model.weight import fall
from ..air import in_air, world_velocity
from ..program.coordinates import COM_ENTRIES, IDENTITY_POSE

State = tuple[np.ndarray, np.ndarray]  # q, v
ROUNDING = 1e-12  # relative, of a bend


def full_state(
    model: Model, start: State, times: np.ndarray, blocks: dict[str, np.ndarray]
) -> State:
    """Return q (K, nq), v (K, nv) at times (K,) s from the start (q0, v0)."""
    quaternion = blocks["attitude"] / np.linalg.norm(blocks["attitude"], axis=1, keepdims=True)
    tail, tail_rate = _within_range(model, blocks["tail"]), blocks["tail_rate"]
    if in_air(model):
        moving = [world_velocity(model, blocks), blocks["spin"], tail_rate]
        return np.column_stack([blocks["place"], quaternion, tail]), np.column_stack(moving)
    R, H = rotation_matrix(quaternion), model.mass_matrix(_at_identity(tail))
    h = np.einsum("kji,j->ki", R, model.momentum(*start)[1])
    omega = _carrying(H, h, tail_rate)
    rates = np.column_stack([omega, tail_rate])
    position, velocity = _falling(model, start, times, (R, H), rates)
    q = np.column_stack([position, quaternion, tail])
    return q, np.column_stack([velocity, omega, tail_rate])


def _within_range(model: Model, tail: np.ndarray) -> np.ndarray:
    """Return tails (K, 2m) whose arcs are bent as far as the model's range at most.

    A plan keeps its bounds at nodes, and may exceed them a little elsewhere.
    """
    arcs = np.flatnonzero(np.array(model.kinds) == "continuum")
    most = (1 - ROUNDING) * bend_ranges(model.manifest)[arcs]
    pairs = np.array(model.layout.firsts)[arcs, None] + [0, 1]
    bends = np.linalg.norm(tail[:, pairs], axis=2)
    scale = np.divide(most, bends, out=np.ones_like(bends), where=bends > most)
    found = tail.copy()
    found[:, pairs] *= scale[..., None]
    return found


def _at_identity(tail: np.ndarray) -> np.ndarray:
    """q (K, nq) of tails (K, 2m) on a torso at the origin that is not rotated."""
    return np.column_stack([np.tile(IDENTITY_POSE, (len(tail), 1)), tail])


def _carrying(H: np.ndarray, h: np.ndarray, tail_rate: np.ndarray) -> np.ndarray:
    """Angular velocity (K, 3) at which the momentum about the COM is h (K, 3), body axes.

    The linear momentum is zero.
    """
    torso = slice(TORSO_NV)
    momentum = np.column_stack([np.zeros_like(h), h])
    momentum -= np.einsum("kij,kj->ki", H[:, torso, TAIL_V], tail_rate)
    return np.linalg.solve(H[:, torso, torso], momentum[..., None])[:, OMEGA, 0]


def _falling(
    model: Model,
    start: State,
    times: np.ndarray,
    body: tuple[np.ndarray, np.ndarray],
    rates: np.ndarray,
) -> State:
    """Return position and velocity (K, 3) of B: the COM's minus those of the COM relative to B.

    body: rotations (K, 3, 3) and mass matrices. rates: (omega, q_t_dot).
    """
    R, H = body
    mass = H[:, 0, 0][:, None]

    # the COM from B, world: where it is, and how fast
    offset = np.einsum("kij,kj->ki", R, _com(H))
    drift = -np.einsum("kij,kjl,kl->ki", R, H[:, VELOCITY, OMEGA.start :], rates)

    # the COM in the world
    t, g = np.asarray(times)[:, None], fall(model.parameters)
    com, v_com = com_at_start(model, start)
    position = com + v_com * t + g * t**2 / 2 - offset
    return position, v_com + g * t + drift / mass


def start_carrying(
    model: Model, blocks: dict[str, np.ndarray], conserved: dict[str, np.ndarray], start: State
) -> State:
    """Return the state q, v with blocks of the start (size,) that has what is conserved.

    start: gives position and velocity where the COM's are not among the conserved quantities.
    """
    quaternion = blocks["attitude"] / np.linalg.norm(blocks["attitude"])
    R, H = rotation_matrix(quaternion), model.mass_matrix(_at_identity(blocks["tail"][None]))
    omega = _carrying(H, (R.T @ conserved["momentum"])[None], blocks["tail_rate"][None])
    position, velocity = start[0][POSITION], start[1][VELOCITY]
    if "com" in conserved:
        rates = np.append(omega[0], blocks["tail_rate"])
        position = conserved["com"] - R @ _com(H)[0]
        velocity = (
            conserved["com_velocity"] - R @ H[0, VELOCITY, OMEGA.start :] @ rates / H[0, 0, 0]
        )
    q = np.concatenate([position, quaternion, blocks["tail"]])
    return q, np.concatenate([velocity, omega[0], blocks["tail_rate"]])


def com_at_start(model: Model, start: State) -> State:
    """Position and velocity (3,) of the COM, world, at the start (q0, v0)."""
    q0, v0 = start
    H = model.mass_matrix(_at_identity(q0[None, TAIL_Q]))
    position = q0[POSITION] + rotation_matrix(q0[QUATERNION]) @ _com(H)[0]
    return position, model.momentum(q0, v0)[0] / H[0, 0, 0]


def _com(H: np.ndarray) -> np.ndarray:
    """COM (K, 3) from B in body axes.

    The block of H (K, nv, nv) for (p_ddot, omega_dot) is -mass skew(COM).
    """
    return np.column_stack([H[:, i, j] for i, j in COM_ENTRIES]) / H[:, 0, 0][:, None]
