"""Positions of the animal's parts at moments of a motion; all pictures are drawn from them."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from serpentail_scene.layout import POSITION, QUATERNION

from ...basics.attitude import rotation_matrix
from ...model.model import Model
from ...motion.trajectory import Trajectory
from ..animal import Animal, animal_of, centre_of_mass, poses_of
from .style import Array
from .views import View

LONGEST = 0.06  # m, the arrow of the largest force of a picture


@dataclass(frozen=True, eq=False)
class Frame:
    """One moment, world, SI: time, torso, rotation, tail from its mount (P, 3), COM, legs (L, J, 3)
    and arrows (n, 2, 3) of the ground's forces, from the point that is pushed to the tip.
    """

    time: float
    torso: Array
    rotation: Array
    tail: Array
    com: Array
    animal: Animal
    legs: Array = field(default_factory=lambda: np.zeros((0, 2, 3)))
    arrows: Array = field(default_factory=lambda: np.zeros((0, 2, 3)))

    def world(self, local: ArrayLike) -> Array:
        """Torso points (n, 3) in the world."""
        return self.torso + np.asarray(local, dtype=float) @ self.rotation.T

    def outline(self, view: View) -> Array:
        """The torso's silhouette (n, 2) in a view."""
        return view.of(self.torso)[:2] + silhouette(self.rotation, self.animal.semi_axes, view)

    def in_front(self, world: Array, view: View) -> NDArray[np.bool_]:
        """Which world points x (n, 3) the torso cannot hide: |u| >= 1 on the near side.

        u = diag(a)^-1 R^T (x - p).
        """
        u = (world - self.torso) @ self.rotation / self.animal.semi_axes
        towards = view.matrix[2] @ self.rotation / self.animal.semi_axes
        return np.asarray((np.linalg.norm(u, axis=1) > 1 - 1e-9) & (u @ towards > -1e-6))

    @property
    def lowest(self) -> float:
        """Height (m) of the lowest point of torso, tail and legs."""
        depth = np.linalg.norm(self.rotation[2] * self.animal.semi_axes)
        heights = np.concatenate([self.tail[:, 2], self.legs[..., 2].ravel()])
        return float(min(self.torso[2] - depth, heights.min()))


def silhouette(rotation: Array, semi_axes: ArrayLike, view: View, count: int = 121) -> Array:
    """Outline (count, 2), m, of an ellipsoid rotated by R: the ellipse P R diag(a^2) R^T P^T."""
    spread = view.matrix[:2] @ rotation * np.asarray(semi_axes, dtype=float)
    angle = np.linspace(0, 2 * np.pi, count)
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    return circle @ np.linalg.cholesky(spread @ spread.T).T


def tick(animal: Animal) -> Array:
    """The mark on the back, (2, 3), in the torso frame."""
    height = animal.semi_axes[2]
    return np.array([[0, 0, height], [0, 0, 1.5 * height]])


def frames(model: Model, motion: Trajectory, rows: Sequence[int], largest: float) -> list[Frame]:
    """The frames of samples; `largest` (N) is the force whose arrow is LONGEST, 0 draws none."""
    rows, animal = list(rows), animal_of(model)
    angles = None if motion.contact is None else motion.contact.legs
    given = [each[rows] for each in motion.given]
    poses = poses_of(model, motion.q[rows], None if angles is None else angles[rows], *given)
    legs = np.zeros((len(rows), 0, 2, 3)) if poses.legs is None else poses.legs
    coms = centre_of_mass(model, motion.q[rows], motion.v[rows], *given)
    rotations = rotation_matrix(poses.torso[:, QUATERNION])
    return [
        Frame(
            float(motion.t[row]),
            poses.torso[k, POSITION],
            rotations[k],
            poses.tail[k],
            coms[k],
            animal,
            legs[k],
            _arrows(motion, row, largest),
        )
        for k, row in enumerate(rows)
    ]


def _arrows(motion: Trajectory, row: int, largest: float) -> Array:
    """Arrows (n, 2, 3) of the ground's forces, as long as the roots of the forces."""
    if motion.contact is None or not largest:
        return np.zeros((0, 2, 3))
    points, forces = motion.contact.points[row], motion.contact.forces[row]
    sizes = np.linalg.norm(forces, axis=1)
    acting = sizes > 1e-4 * largest
    lengths = LONGEST / np.sqrt(sizes[acting, None] * largest)
    return np.stack([points[acting], points[acting] + lengths * forces[acting]], axis=1)


def drawn_points(frame: Frame, view: View) -> Array:
    """Everything a frame shows, as points (n, 2) in a view."""
    lines = np.vstack([frame.tail, frame.world(tick(frame.animal)), *frame.legs])
    return np.vstack([frame.outline(view), view.of(lines)[:, :2]])


def window_around(shapes: Sequence[Array], margin: float = 0.012) -> Array:
    """Lower and upper corner (2, 2) of a box around all shapes."""
    every = np.vstack(shapes)
    return np.array([every.min(axis=0) - margin, every.max(axis=0) + margin])
