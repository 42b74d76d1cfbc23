"""Where markers are in the torso's axes, and how they move with the tail and with its geometry.

Derivatives are complex steps: the imaginary part of f(x + i h) is h f'(x) up to h^2, with h so
small that nothing of it is lost, so they are exact to rounding.
"""

from dataclasses import dataclass

import numpy as np

from ..model.model import Model
from .placement import TORSO, Placements, piece_lengths

STEP = 1e-30  # of complex steps
SERIES = 0.5  # bend below which arcs are computed by a series
TERMS = 12
CROSS = np.array(
    [
        [[0.0, 0, 0], [0, 0, -1], [0, 1, 0]],
        [[0, 0, 1], [0, 0, 0], [-1, 0, 0]],
        [[0, -1, 0], [1, 0, 0], [0, 0, 0]],
    ]
)  # CROSS[k] is the matrix of e_k x


@dataclass(frozen=True, eq=False)
class Geometry:
    """What a tail's shape is made of: mount (3,) m in B, its angles (3,) rad, lengths (P,) m of the
    pieces, the segment (P,) of each, and whether they are arcs.
    """

    mount: np.ndarray
    angles: np.ndarray
    lengths: np.ndarray
    segment: np.ndarray
    arcs: bool

    @property
    def numbers(self) -> np.ndarray:
        """Mount, angles and lengths as one array (6 + P,)."""
        return np.concatenate([self.mount, self.angles, self.lengths])


def geometry_of(model: Model) -> Geometry:
    """Return the geometry of a model's tail."""
    p = model.parameters
    return Geometry(
        np.array(p["tail_mount"], float),
        np.array(p.get("mount_angles", (0.0, 0.0, 0.0)), float),
        piece_lengths(model),
        np.repeat(np.arange(model.segments), model.joints_each),
        model.kind != "articulated",
    )


def frames(
    shape: Geometry, numbers: np.ndarray, tail: np.ndarray, placed: Placements
) -> tuple[np.ndarray, np.ndarray]:
    """Return origins (..., M, 3) m and axes (..., M, 3, 3) of the markers' places in B.

    numbers (..., 6 + P): as ``Geometry.numbers``; tail (..., 2m): tail coordinates; both may be
    complex.
    """
    batch = np.broadcast_shapes(numbers.shape[:-1], tail.shape[:-1])
    kind = np.result_type(numbers, tail)
    markers = len(placed.names)
    origins = np.zeros((*batch, markers, 3), kind)
    axes = np.zeros((*batch, markers, 3, 3), kind)
    axes[:] = np.eye(3)
    joint = np.broadcast_to(numbers[..., :3], (*batch, 3))
    R = _mounted(numbers[..., 3:6])
    # outward, piece by piece, up to the last marker
    for k in range(max(placed.piece.max(), -1) + 1):
        i = shape.segment[k]
        first, second = tail[..., 2 * i, None, None], tail[..., 2 * i + 1, None, None]
        length = numbers[..., 6 + k, None]
        for marker in np.flatnonzero(placed.piece == k):
            way, turned = _along(shape.arcs, first, second, placed.fraction[marker])
            origins[..., marker, :] = joint + length * (R @ way)[..., 0]
            axes[..., marker, :, :] = R @ turned
        way, turned = _along(shape.arcs, first, second, 1.0)
        joint, R = joint + length * (R @ way)[..., 0], R @ turned
    return origins, axes


def _along(
    arcs: bool, first: np.ndarray, second: np.ndarray, x: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return the point at x of a piece of length 1, (..., 3, 1), and its axes (..., 3, 3).

    A link turns at its joint by R = Rx(alpha) Rz(beta) and is straight along -y (Eq. 13). Along an
    arc the axes turn by Exp(x [a, 0, b]).
    """
    if not arcs:
        R = _exponential(first, 0) @ _exponential(second, 2)
        return -x * R[..., :, 1:2], R
    z = first * first + second * second
    sine, versine = _stumpff(x * x * z)
    sigma, gamma = x * sine, x * x * versine
    zero = np.zeros_like(z)
    K = np.concatenate(
        [
            np.concatenate([zero, -second, zero], axis=-1),
            np.concatenate([second, zero, -first], axis=-1),
            np.concatenate([zero, first, zero], axis=-1),
        ],
        axis=-2,
    )
    way = np.concatenate([gamma * second, -sigma, -gamma * first], axis=-2)
    return way, np.eye(3) + sigma * K + gamma * (K @ K)


def _exponential(angle: np.ndarray, axis: int) -> np.ndarray:
    """Return rotations (..., 3, 3) by angles (..., 1, 1) about an axis."""
    K = CROSS[axis]
    return np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * (K @ K)


def _mounted(angles: np.ndarray) -> np.ndarray:
    """Return axes of the tail's root, R = Rz(yaw) Rx(pitch) Ry(roll)."""
    pitch, roll, yaw = (angles[..., k, None, None] for k in range(3))
    return _exponential(yaw, 2) @ _exponential(pitch, 0) @ _exponential(roll, 1)


def _stumpff(z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return sin(t) / t and (1 - cos(t)) / t^2 at t^2 = z, entire functions of z."""
    small = np.abs(z) < SERIES**2
    t = np.sqrt(np.where(small, 1.0, z))
    sine, versine = np.sin(t) / t, (np.sin(t / 2) / (t / 2)) ** 2 / 2
    powers_s, powers_v = np.ones_like(z), np.ones_like(z) / 2
    series_s, series_v = powers_s, powers_v
    for k in range(1, TERMS):
        powers_s = -powers_s * z / ((2 * k) * (2 * k + 1))
        powers_v = -powers_v * z / ((2 * k + 1) * (2 * k + 2))
        series_s, series_v = series_s + powers_s, series_v + powers_v
    return np.where(small, series_s, sine), np.where(small, series_v, versine)


@dataclass(frozen=True, eq=False)
class BodyPoints:
    """Markers in B: points (..., M, 3) m; axes (..., M, 3, 3) of their offsets; derivatives by the
    tail coordinates (..., M, 3, 2m), and by the geometry's numbers (..., M, 3, 6 + P).
    """

    points: np.ndarray
    axes: np.ndarray
    by_tail: np.ndarray
    by_geometry: np.ndarray


def body_points(
    shape: Geometry, tail: np.ndarray, placed: Placements, wanted: np.ndarray
) -> BodyPoints:
    """Return markers in B at tail coordinates (..., 2m), with exact derivatives.

    wanted: indices of the geometry's numbers by which derivatives are taken; others are left 0.
    """
    nt, numbers = tail.shape[-1], shape.numbers
    count = nt + len(wanted)
    steps = np.zeros((count + 1, nt + len(numbers)))
    steps[range(1, nt + 1), range(nt)] = STEP
    steps[range(nt + 1, count + 1), nt + wanted] = STEP
    moved = tail[..., None, :] + 1j * steps[:, :nt]
    origins, axes = frames(shape, numbers + 1j * steps[:, nt:], moved, placed)
    # the first of all directions is zero
    points = origins + np.einsum("...mij,mj->...mi", axes, placed.offset)
    by = np.moveaxis(points.imag[..., 1:, :, :] / STEP, -3, -1)
    by_geometry = np.zeros((*by.shape[:-1], len(numbers)))
    by_geometry[..., wanted] = by[..., nt:]
    none = points.real[..., 0, :, :]
    return BodyPoints(none, axes.real[..., 0, :, :, :], by[..., :nt], by_geometry)


def body_positions(shape: Geometry, tail: np.ndarray, placed: Placements) -> np.ndarray:
    """Return markers in B at tail coordinates (..., 2m), (..., M, 3) m."""
    origins, axes = frames(shape, shape.numbers, tail, placed)
    return origins + (axes @ placed.offset[..., None])[..., 0]


def on_torso(placed: Placements) -> np.ndarray:
    """Tell which markers are on the torso, (M,)."""
    return placed.piece == TORSO
