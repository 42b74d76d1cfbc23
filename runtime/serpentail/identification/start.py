"""Where the search begins: the motion that the markers show by themselves, frame by frame."""

import numpy as np
from scipy.spatial.transform import Rotation

from serpentail_scene.layout import PER_SEGMENT, QUATERNION, TAIL_Q, TORSO_Q

from ..basics.attitude import sign_continuous
from ..model.model import Model
from .placement import Placements, marker_points, world_points
from .tracks import MarkerTracks

ITERATIONS = 25
CLOSE = 1e-5  # m and rad: the last step of a fit
RIDGE = 1e-3  # weight of rotations, over the tail's length: holds undetermined directions
ENOUGH = 0.5  # part of the markers that a frame needs to be fitted by itself
TIGHT = 0.01  # of the tail's length: smaller misfits are never far
APART = 0.5  # rad between the tails of neighbours: further apart, one is fitted again
MOST_BENT = 0.999  # of the range of bends
LINE = 0.05  # of their length that points must spread beside a line
WINDOW = 7  # frames of a local parabola
FAR = 4.0  # times the usual misfit: other frames do not begin from such a frame


def motion_shown(placed: Placements, tracks: MarkerTracks) -> np.ndarray:
    """Return states (F, nx) at the frames: fitted configurations, velocities by parabolas."""
    q = configurations(placed, tracks)
    return np.column_stack([q, velocities(placed.model, tracks.times, q)])


def configurations(placed: Placements, tracks: MarkerTracks) -> np.ndarray:
    """Return configurations (F, nq) that fit the markers of each frame, between others in gaps.

    All frames are fitted side by side. Where a tail is bent so far that two shapes fit, a frame
    continues its neighbour, outward from the frame whose tail is straightest.
    """
    begun, laid = _begin(placed, tracks)
    q = begun.copy()
    shown = tracks.seen.mean(axis=1)
    rows = np.flatnonzero(shown >= min(ENOUGH, shown.max()))
    positions = tracks.positions[rows]
    q[rows], misfit = fitted(placed, positions, q[rows])
    usual = max(FAR * np.median(misfit), TIGHT * float(placed.model.parameters["tail_length"]))
    fits = misfit <= usual
    bent = np.abs(q[rows][:, TAIL_Q]).max(axis=1)
    anchor = int(np.where(fits & laid[rows], bent, np.inf).argmin())

    # from the anchor outward, a frame that is far from its neighbour is fitted again from there
    sound = np.ones(len(rows), bool)
    for way in (range(anchor + 1, len(rows)), range(anchor - 1, -1, -1)):
        last = q[rows[anchor]]
        for k in way:
            current, torso_laid = q[rows[k]], laid[rows[k]]
            if not fits[k] or _apart(current, last, torso_laid) > APART:
                torso = (begun[rows[k]] if torso_laid else last)[TORSO_Q]
                begin = np.concatenate([torso, last[TAIL_Q]])[None]
                (current,), off = fitted(placed, positions[k : k + 1], begin)
                fits[k] = off[0] <= usual
            sound[k] = fits[k] and (torso_laid or _apart(current, last, torso_laid) <= APART)
            q[rows[k]] = current
            last = current if sound[k] else last
    frames = rows[sound]
    return interpolated(tracks.times[frames], q[frames], tracks.times)


def _apart(q: np.ndarray, other: np.ndarray, torso_laid: bool) -> float:
    """Return how far configurations (nq,) differ, rad: in the tail; unless laid, in the torso."""
    off = float(np.abs(q - other)[TAIL_Q].max())
    cosine = min(abs(float(q[QUATERNION] @ other[QUATERNION])), 1.0)
    return off if torso_laid else max(off, 2 * np.arccos(cosine))


def fitted(
    placed: Placements, positions: np.ndarray, begin: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return configurations (F, nq) that fit positions (F, M, 3), and misfits (F,) m.

    They begin at given ones. Levenberg-Marquardt steps of all frames side by side; a small weight
    holds rotations where they are.
    """
    model = placed.model
    nv, reach = model.nv, float(model.parameters["tail_length"])
    weight = np.isfinite(positions).all(axis=2)[..., None]
    q, ridge = within(model, begin), np.full(len(begin), RIDGE)
    hold = np.diag(np.concatenate([np.full(3, 1e-6), np.full(nv - 3, reach)]) ** 2)

    def off(points: np.ndarray, rows: np.ndarray) -> np.ndarray:
        return np.where(weight[rows], positions[rows] - points, 0).reshape(len(rows), -1, 1)

    # frames whose step is small drop out; a step that misses is tried again, shorter
    left = np.arange(len(q))
    misfit = (off(world_points(placed, q), left) ** 2).sum(axis=(1, 2))
    for _ in range(ITERATIONS):
        points, by_q = marker_points(placed, q[left])
        J = np.where(weight[left, ..., None], by_q, 0).reshape(len(left), -1, nv)
        back = np.swapaxes(J, 1, 2)
        square = back @ J + ridge[left, None, None] * hold
        step = np.linalg.solve(square, back @ off(points, left))[..., 0]
        new = turned(model, q[left], step)
        after = (off(world_points(placed, new), left) ** 2).sum(axis=(1, 2))
        better = after <= misfit[left]
        q[left[better]], misfit[left[better]] = new[better], after[better]
        ridge[left] = np.where(better, np.maximum(ridge[left] / 4, RIDGE**2), ridge[left] * 8)
        left = left[~better | (np.abs(step).max(axis=1) >= CLOSE)]
        if not len(left):
            break
    return q, np.sqrt(misfit / np.maximum(weight.sum(axis=(1, 2)), 1))


def turned(model: Model, q: np.ndarray, step: np.ndarray) -> np.ndarray:
    """Return configurations (F, nq) after steps (F, nv)."""
    return within(model, model.integrate(q, step, 1.0))


def within(model: Model, q: np.ndarray) -> np.ndarray:
    """Return a copy of configurations (F, nq) without bends beyond the model's range."""
    if "continuum" not in model.kinds:
        return q.copy()
    q, most = q.copy(), MOST_BENT * model.manifest["scene"]["bend_range"]
    bends = q[:, TAIL_Q].reshape(len(q), -1, PER_SEGMENT)
    size = np.linalg.norm(bends, axis=2, keepdims=True)
    arcs = np.array([kind == "continuum" for kind in model.kinds])[:, None]
    shrunk = np.where(arcs, np.minimum(1, most / np.maximum(size, 1e-9)), 1)
    q[:, TAIL_Q] = (bends * shrunk).reshape(len(q), -1)
    return q


def _begin(placed: Placements, tracks: MarkerTracks) -> tuple[np.ndarray, np.ndarray]:
    """Return configurations (F, nq) with a straight tail, and which frames' torsos are laid (F,).

    A torso is laid on three of its markers or more; if no frame shows these, on all markers. The
    frames between are interpolated, those before and after are like the nearest.
    """
    q = np.zeros((len(tracks.times), placed.model.nq))
    q[:, QUATERNION.start] = 1
    body = world_points(placed, q[:1])[0]

    # on the torso alone if any frame allows it
    for use in (tracks.seen & placed.on_torso, tracks.seen):
        laid = np.array([off_line(body[markers], LINE) for markers in use])
        if laid.any():
            break
    for frame in np.flatnonzero(laid):
        markers = use[frame]
        q[frame, TORSO_Q] = _laid(body[markers], tracks.positions[frame, markers])
    if laid.any():
        q = interpolated(tracks.times[laid], q[laid], tracks.times)
    return q, laid


def off_line(points: np.ndarray, least: float) -> bool:
    """Tell whether points (K, 3) give an attitude: three or more, and wider than ``least`` times
    the line that they are near.
    """
    if len(points) < 3:
        return False
    sizes = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    return bool(sizes[1] > least * sizes[0])


def _laid(body: np.ndarray, world: np.ndarray) -> np.ndarray:
    """Return position and quaternion that lay points in B over those in the world (Kabsch)."""
    middle, centre = body.mean(axis=0), world.mean(axis=0)
    U, _, Vt = np.linalg.svd((world - centre).T @ (body - middle))
    R = U @ np.diag([1, 1, np.sign(np.linalg.det(U @ Vt))]) @ Vt
    quaternion = np.roll(Rotation.from_matrix(R).as_quat(), 1)  # SciPy has its real part last
    return np.concatenate([centre - R @ middle, quaternion])


def interpolated(times: np.ndarray, rows: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Return states or configurations at times, between those (F, nx) of frames."""
    rows = rows.copy()
    rows[:, QUATERNION] = sign_continuous(rows[:, QUATERNION])
    between = np.stack([np.interp(at, times, column) for column in rows.T], axis=1)
    between[:, QUATERNION] /= np.linalg.norm(between[:, QUATERNION], axis=1, keepdims=True)
    return between


def velocities(model: Model, times: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Return velocities (F, nv) of configurations (F, nq): slopes of local parabolas."""
    count, width = len(times), min(WINDOW, len(times))
    v = np.zeros((count, model.nv))
    for k in range(count):
        first = int(np.clip(k - width // 2, 0, count - width))
        near = slice(first, first + width)
        steps = model.difference(q[k], q[near])
        v[k] = np.linalg.lstsq(np.vander(times[near] - times[k], 3), steps, rcond=None)[0][1]
    return v
