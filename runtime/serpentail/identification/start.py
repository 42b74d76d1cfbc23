"""Where the search begins: the motion that the markers show by themselves, frame by frame."""

import numpy as np

from serpentail_scene.layout import OMEGA, QUATERNION, TAIL_Q

from ..attitude import rotation_matrix, sign_continuous
from ..model.model import Model
from .placement import Placements
from .points import CROSS, body_points, body_positions, geometry_of, on_torso
from .stages import difference, moved
from .tracks import MarkerTracks
from .trial import world_points

ITERATIONS = 25
CLOSE = 1e-5  # m and rad: the last step of a fit
RIDGE = 1e-3  # weight of rotations, over the tail's length: holds undetermined directions
ENOUGH = 0.5  # part of the markers that a frame needs to be fitted by itself
WINDOW = 7  # frames of a local parabola
FAR = 4.0  # times the usual misfit: other frames do not begin from such a frame


def motion_shown(model: Model, placed: Placements, tracks: MarkerTracks) -> np.ndarray:
    """Return states (F, nx) at the frames: fitted configurations, velocities by parabolas."""
    q = configurations(model, placed, tracks)
    return np.column_stack([q, velocities(model, tracks.times, q)])


def configurations(model: Model, placed: Placements, tracks: MarkerTracks) -> np.ndarray:
    """Return configurations (F, nq) that fit the markers of each frame, between others in gaps.

    Where a tail is bent so far that two shapes fit, a frame continues its neighbour: the frames are
    fitted outward from the one whose tail is straightest.
    """
    q = _begin(model, placed, tracks)
    rows = np.flatnonzero(tracks.seen.mean(axis=1) >= min(ENOUGH, tracks.seen.mean(axis=1).max()))
    positions = tracks.positions[rows]
    first, misfit = fitted(model, placed, positions, q[rows])
    fine = misfit <= FAR * np.median(misfit)
    straightest = np.abs(first[:, TAIL_Q]).max(axis=1)
    anchor = int(np.where(fine, straightest, np.inf).argmin())
    q[rows[anchor]] = first[anchor]
    for way in (range(anchor + 1, len(rows)), range(anchor - 1, -1, -1)):
        at = rows[anchor]
        for k in way:
            begin = np.concatenate([q[rows[k], :7], q[at, TAIL_Q]])
            q[rows[k]] = fitted(model, placed, positions[k : k + 1], begin[None])[0][0]
            at = rows[k]
    return _between(tracks.times, q, rows)


def fitted(
    model: Model, placed: Placements, positions: np.ndarray, begin: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return configurations (F, nq) that fit positions (F, M, 3), and misfits (F,) m.

    They begin at given ones. Levenberg-Marquardt steps of all frames side by side; a small weight
    holds rotations where they are.
    """
    nv, reach = model.nv, float(model.parameters["tail_length"])
    weight = np.isfinite(positions).all(axis=2)
    q, ridge = begin.copy(), np.full(len(begin), RIDGE)
    shape, none = geometry_of(model), np.zeros(0, int)
    hold = np.concatenate([np.full(3, 1e-6), np.full(nv - 3, reach)]) ** 2

    def misfits(at: np.ndarray) -> np.ndarray:
        off = np.where(weight[..., None], positions - world_points(model, placed, at), 0)
        return (off**2).sum(axis=(1, 2))

    before = misfits(q)
    for _ in range(ITERATIONS):
        body = body_points(shape, q[:, TAIL_Q], placed, none)
        R = rotation_matrix(q[:, QUATERNION])[:, None]
        J = np.zeros((*body.points.shape, nv))
        J[..., :3] = np.eye(3)
        J[..., OMEGA] = -R @ np.einsum("fmk,kij->fmij", body.points, CROSS)
        J[..., 6:] = R @ body.by_tail
        J = np.where(weight[..., None, None], J, 0).reshape(len(q), -1, nv)
        world = q[:, None, :3] + (R @ body.points[..., None])[..., 0]
        off = np.where(weight[..., None], positions - world, 0).reshape(len(q), -1)
        square = np.swapaxes(J, 1, 2) @ J + ridge[:, None, None] * np.diag(hold)
        step = np.linalg.solve(square, (np.swapaxes(J, 1, 2) @ off[..., None]))[..., 0]
        new = turned(model, q, step)
        after = misfits(new)
        better = after <= before
        q[better], before[better] = new[better], after[better]
        ridge = np.where(better, np.maximum(ridge / 4, RIDGE**2), ridge * 8)
        if better.all() and np.abs(step).max() < CLOSE:
            break
    return q, np.sqrt(before / np.maximum(weight.sum(axis=1), 1))


def turned(model: Model, q: np.ndarray, step: np.ndarray) -> np.ndarray:
    """Return configurations (F, nq) after steps (F, nv)."""
    none = np.zeros_like(step)
    states = np.column_stack([q, none])
    return moved(model, states, np.column_stack([step, none]))[:, : model.nq]


def _begin(model: Model, placed: Placements, tracks: MarkerTracks) -> np.ndarray:
    """Return configurations with a straight tail, and torsos placed by the torso's markers.

    If these are too few, all markers count; a frame without any is like the one before.
    """
    frames = len(tracks.times)
    q = np.zeros((frames, model.nq))
    body = body_positions(geometry_of(model), q[:1, TAIL_Q], placed)[0]
    torso = on_torso(placed)
    use = torso if torso.sum() >= 3 else np.ones_like(torso)
    last = np.array([0.0, 0, 0, 1, 0, 0, 0])
    for frame in range(frames):
        here = tracks.seen[frame] & use
        if here.any():
            last = _laid(body[here], tracks.positions[frame, here], last)
        q[frame, :7] = last
    return q


def _laid(body: np.ndarray, world: np.ndarray, last: np.ndarray) -> np.ndarray:
    """Return position and quaternion that lay points in B over those in the world (Kabsch)."""
    middle, centre = body.mean(axis=0), world.mean(axis=0)
    quaternion = last[3:]
    if len(body) >= 3:
        U, _, Vt = np.linalg.svd((world - centre).T @ (body - middle))
        R = U @ np.diag([1, 1, np.sign(np.linalg.det(U @ Vt))]) @ Vt
        quaternion = quaternion_of(R)
    R = rotation_matrix(quaternion)
    return np.concatenate([centre - R @ middle, quaternion])


def quaternion_of(R: np.ndarray) -> np.ndarray:
    """Return the unit quaternion of a rotation matrix: the largest eigenvector of Bar-Itzhack's."""
    xx, yy, zz = np.diag(R)
    K = np.array(
        [
            [xx + yy + zz, R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]],
            [R[2, 1] - R[1, 2], xx - yy - zz, R[1, 0] + R[0, 1], R[0, 2] + R[2, 0]],
            [R[0, 2] - R[2, 0], R[1, 0] + R[0, 1], yy - xx - zz, R[2, 1] + R[1, 2]],
            [R[1, 0] - R[0, 1], R[0, 2] + R[2, 0], R[2, 1] + R[1, 2], zz - xx - yy],
        ]
    )
    return np.linalg.eigh(K)[1][:, -1]


def _between(times: np.ndarray, q: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Return configurations in which frames with too few markers are interpolated."""
    q = q.copy()
    kept = q[rows]
    kept[:, QUATERNION] = sign_continuous(kept[:, QUATERNION])
    for k in range(q.shape[1]):
        q[:, k] = np.interp(times, times[rows], kept[:, k])
    q[:, QUATERNION] /= np.linalg.norm(q[:, QUATERNION], axis=1, keepdims=True)
    return q


def velocities(model: Model, times: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Return velocities (F, nv) of configurations (F, nq): slopes of local parabolas."""
    count, none = len(times), np.zeros((1, model.nv))
    v, width = np.zeros((count, model.nv)), min(WINDOW, count)
    for k in range(count):
        first = int(np.clip(k - width // 2, 0, count - width))
        near = slice(first, first + width)
        here = np.column_stack([q[k : k + 1], none])
        there = np.column_stack([q[near], np.repeat(none, width, axis=0)])
        steps = difference(model, there, np.repeat(here, width, axis=0))[:, : model.nv]
        t = times[near] - times[k]
        v[k] = np.linalg.lstsq(np.vander(t, 3), steps, rcond=None)[0][1]
    return v


def on_mesh(model: Model, frames: np.ndarray, times: np.ndarray, mesh: np.ndarray) -> np.ndarray:
    """Return states (K+1, nx) at a mesh, interpolated from those of frames at times."""
    states = frames.copy()
    states[:, QUATERNION] = sign_continuous(states[:, QUATERNION])
    found = np.stack([np.interp(mesh, times, column) for column in states.T], axis=1)
    found[:, QUATERNION] /= np.linalg.norm(found[:, QUATERNION], axis=1, keepdims=True)
    return found
