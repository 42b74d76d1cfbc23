"""Positions of the animal's parts at moments of a motion; all pictures are drawn from them."""

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from serpentail_scene.layout import POSITION

from ...basics.attitude import rotation_matrix
from ...model.model import Model
from ...motion.body import centre_of_mass, leg_points
from ...motion.trajectory import Trajectory
from ..page.shape import shape, tail_radii
from .style import Array
from .views import View

LONGEST = 0.06  # m, the arrow of the largest force of a picture
MOVING = 6.0  # times as much as the time that passed counts the way that was gone


@dataclass(frozen=True)
class Body:
    """The drawn torso: its ellipsoid's semi-axes and the tail's root, in the torso frame, m.

    thickness: of the tail from each point to the next, over its mean; empty where all are equal.
    marked: whether it has a head and a back; a fixed base has not.
    """

    semi_axes: tuple[float, float, float]
    tail_mount: tuple[float, float, float]
    thickness: tuple[float, ...] = ()
    marked: bool = True


@dataclass(frozen=True, eq=False)
class Frame:
    """One moment, world, SI: time, torso, rotation, tail from its root (P + 1, 3), COM, legs (L, J,
    3) and arrows (n, 2, 3) of the ground's forces, from the point that is pushed to the tip.
    """

    time: float
    torso: Array
    rotation: Array
    tail: Array
    com: Array
    body: Body
    legs: Array = field(default_factory=lambda: np.zeros((0, 2, 3)))
    arrows: Array = field(default_factory=lambda: np.zeros((0, 2, 3)))

    def world(self, local: ArrayLike) -> Array:
        """Torso points (n, 3) in the world."""
        return self.torso + np.asarray(local, dtype=float) @ self.rotation.T

    def outline(self, view: View) -> Array:
        """The torso's silhouette (n, 2) in a view."""
        return view.of(self.torso)[:2] + silhouette(self.rotation, self.body.semi_axes, view)

    def in_front(self, world: Array, view: View) -> NDArray[np.bool_]:
        """Which world points x (n, 3) the torso cannot hide: |u| >= 1 on the near side.

        u = diag(a)^-1 R^T (x - p).
        """
        u = (world - self.torso) @ self.rotation / self.body.semi_axes
        towards = view.matrix[2] @ self.rotation / self.body.semi_axes
        return np.asarray((np.linalg.norm(u, axis=1) > 1 - 1e-9) & (u @ towards > -1e-6))

    @property
    def lowest(self) -> float:
        """Height (m) of the lowest point of torso, tail and legs."""
        depth = np.linalg.norm(self.rotation[2] * self.body.semi_axes)
        heights = np.concatenate([self.tail[:, 2], self.legs[..., 2].ravel()])
        return float(min(self.torso[2] - depth, heights.min()))


def silhouette(rotation: Array, semi_axes: ArrayLike, view: View, count: int = 121) -> Array:
    """Outline (count, 2), m, about the centre, of an ellipsoid rotated by R.

    It is the ellipse P R diag(a^2) R^T P^T.
    """
    spread = view.matrix[:2] @ rotation * np.asarray(semi_axes, dtype=float)
    angle = np.linspace(0, 2 * np.pi, count)
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    return circle @ np.linalg.cholesky(spread @ spread.T).T


def tick(body: Body) -> Array:
    """The mark on the back, (2, 3), in the torso frame."""
    height = body.semi_axes[2]
    return np.array([[0, 0, height], [0, 0, 1.5 * height]])


def body_of(model: Model) -> Body:
    """Return the torso as in the page of a run, and the tail's root."""
    a, b, c = shape(model)["semi_axes"]
    x, y, z = (float(length) for length in model.parameters["tail_mount"])
    own = {"link_masses", "arc_masses"} & model.parameters.keys()
    radii = tail_radii(model) if own else np.zeros(0)
    thickness = tuple((radii / (radii.mean() if own else 1)).tolist())
    return Body((a, b, c), (x, y, z), thickness, not model.fixed)


def frames(model: Model, motion: Trajectory, rows: Iterable[int], largest: float) -> list[Frame]:
    """The frames of samples; `largest` (N) is the force whose arrow is LONGEST, 0 draws none."""
    rows, body = list(rows), body_of(model)
    q, poses = motion.q[rows], motion.pose[rows]
    points, com = model.tail_points(q), centre_of_mass(model, q, motion.v[rows])
    rotations, legs = rotation_matrix(motion.attitude[rows]), _legs(model, motion, rows)
    found = []
    for k, row in enumerate(rows):
        torso = poses[k, POSITION]
        tail = np.vstack([torso + rotations[k] @ body.tail_mount, points[k]])
        arrows = _arrows(motion, row, largest)
        time = float(motion.t[row])
        found.append(Frame(time, torso, rotations[k], tail, com[k], body, legs[k], arrows))
    return found


def _legs(model: Model, motion: Trajectory, rows: list[int]) -> Array:
    """Return joints (n, L, J, 3) of the legs; none if the motion or its model has none."""
    angles = None if motion.contact is None else motion.contact.legs
    joints = leg_points(model, motion.q[rows], None if angles is None else angles[rows])
    return np.zeros((len(rows), 0, 2, 3)) if joints is None else joints


def _arrows(motion: Trajectory, row: int, largest: float) -> Array:
    """Arrows (n, 2, 3) of the ground's forces, as long as the roots of the forces."""
    if motion.contact is None or not largest:
        return np.zeros((0, 2, 3))
    points, forces = motion.contact.points[row], motion.contact.forces[row]
    sizes = np.linalg.norm(forces, axis=1)
    acting = sizes > 1e-4 * largest
    lengths = LONGEST / np.sqrt(sizes[acting, None] * largest)
    return np.stack([points[acting], points[acting] + lengths * forces[acting]], axis=1)


def largest_force(motions: Iterable[Trajectory], rows: Iterable[Iterable[int]]) -> float:
    """The largest force (N) at a point in samples of motions; 0 in flight."""
    sizes = [
        np.linalg.norm(motion.contact.forces[list(chosen)], axis=-1).max(initial=0)
        for motion, chosen in zip(motions, rows, strict=True)
        if motion.contact is not None
    ]
    return float(max(sizes, default=0.0))


def way(model: Model, motion: Trajectory) -> Array:
    """How far (K,), m, head, back and tail have gone by each sample, on the average."""
    body, rotations = body_of(model), rotation_matrix(motion.attitude)
    marks = np.array([[0, body.semi_axes[1], 0], [0, 0, body.semi_axes[2]]])
    torso = motion.pose[:, None, POSITION] + np.einsum("kij,nj->kni", rotations, marks)
    points = np.concatenate([torso, model.tail_points(motion.q)], axis=1)
    steps = np.linalg.norm(np.diff(points, axis=0), axis=2).mean(axis=1)
    return np.concatenate([[0.0], np.cumsum(steps)])


def moments(tracks: list[tuple[Array, Array]], count: int) -> Array:
    """Return times (s), at most ``count``, between which motions change equally.

    tracks: times and paths of each motion; the moments are in the span that all have.
    """
    begin, end = max(t[0] for t, _ in tracks), min(t[-1] for t, _ in tracks)
    grid = np.linspace(begin, end, 4001)
    share = np.linspace(0, 1, len(grid))
    for t, gone in tracks:
        here = np.interp(grid, t, gone)
        here -= here[0]
        share += MOVING * here / (here[-1] or 1.0)
    return np.interp(np.linspace(0, share[-1], count), share, grid)
