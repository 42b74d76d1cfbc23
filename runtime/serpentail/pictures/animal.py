"""How the animal looks at one moment in a view: torso, tail, legs and forces of the ground."""

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .style import HEAD, INK, TAIL, TORSO, Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MOST_DOTS = 20  # more tail points than this are drawn without dots
LEG, FORCE = "#009e73", "#cc79a7"  # Okabe and Ito
LONGEST = 0.06  # m, the arrow of the largest force of a film


@dataclass(frozen=True)
class Body:
    """The drawn torso: its ellipsoid's semi-axes and the tail's root, in the torso frame, m."""

    semi_axes: tuple[float, float, float] = (0.0315, 0.0495, 0.027)
    tail_mount: tuple[float, float, float] = (0.0, -0.0405, 0.0045)

    def __post_init__(self) -> None:
        """Semi-axes and root are three finite numbers each, the first ones positive."""
        for name, value in vars(self).items():
            if np.shape(value) != (3,) or not np.isfinite(value).all():
                raise ValueError(f"{name} is {value!r}: give three finite lengths in m")
        if min(self.semi_axes) <= 0:
            raise ValueError(f"semi_axes is {self.semi_axes!r}: give positive lengths in m")


@dataclass(frozen=True, eq=False)
class View:
    """An orthographic view.

    The rows of its matrix are the world directions right, up and towards the viewer.
    """

    name: str
    right: str
    up: str
    matrix: Array

    def of(self, world: Array) -> Array:
        """World vectors (n, 3) as (right, up, towards the viewer)."""
        return world @ self.matrix.T


SIDE = View("side", "y", "z", np.array([[0.0, 1, 0], [0, 0, 1], [1, 0, 0]]))
TOP = View("top", "y", "\u2212x", np.array([[0.0, 1, 0], [-1, 0, 0], [0, 0, 1]]))


@dataclass(frozen=True, eq=False)
class Frame:
    """One moment of a film, world, SI: time, torso, root and tail (P + 1, 3), COM.

    On the ground also legs (L, J, 3) and arrows (n, 2, 3) of its forces, from the point that is
    pushed to the tip.
    """

    time: float
    torso: Array
    rotation: Array
    tail: Array
    com: Array
    body: Body
    legs: Array = field(default_factory=lambda: np.zeros((0, 2, 3)))
    arrows: Array = field(default_factory=lambda: np.zeros((0, 2, 3)))
    grounded: bool = False

    def world(self, local: ArrayLike) -> Array:
        """Torso points (n, 3) in the world."""
        return self.torso + np.asarray(local, dtype=float) @ self.rotation.T

    def outline(self, view: View) -> Array:
        """The torso's silhouette (n, 2) in a view."""
        return view.of(self.torso)[:2] + silhouette(self.rotation, self.body.semi_axes, view)

    def in_front(self, world: Array, view: View) -> NDArray[np.bool_]:
        """Which world points x (n, 3) it cannot hide: |u| >= 1 on the near side.

        u = diag(a)^-1 R^T (x - p).
        """
        u = (world - self.torso) @ self.rotation / self.body.semi_axes
        towards = view.matrix[2] @ self.rotation / self.body.semi_axes
        return np.asarray((np.linalg.norm(u, axis=1) > 1 - 1e-9) & (u @ towards > -1e-6))


def silhouette(rotation: Array, semi_axes: ArrayLike, view: View = SIDE, count: int = 121) -> Array:
    """Outline (count, 2), m, about the centre, of an ellipsoid rotated by R.

    It is the ellipse P R diag(a^2) R^T P^T.
    """
    spread = view.matrix[:2] @ rotation * np.asarray(semi_axes, dtype=float)
    angle = np.linspace(0, 2 * np.pi, count)
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    return circle @ np.linalg.cholesky(spread @ spread.T).T


def arrows(points: Array, forces: Array, largest: float) -> Array:
    """Arrows (n, 2, 3) of forces at points (P, 3), as long as the roots of the forces.

    The largest force has an arrow of LONGEST.
    """
    sizes = np.linalg.norm(forces, axis=1)
    acting = sizes > 1e-4 * largest
    shown, sizes = forces[acting], sizes[acting, None]
    tips = points[acting] + LONGEST * shown / np.sqrt(sizes * largest)
    return np.stack([points[acting], tips], axis=1)


def tick(body: Body) -> Array:
    """The mark on the back, (2, 3), in the torso frame."""
    height = body.semi_axes[2]
    return np.array([[0, 0, height], [0, 0, 1.5 * height]])


@dataclass(frozen=True, eq=False)
class Pen:
    """Draws one frame on axes in a view, world point `origin` at zero, above all lower levels."""

    axes: "Axes"
    frame: Frame
    view: View
    origin: Array
    level: float = 0.0

    def plot(self, world: Array, mark: str, zorder: float, **look: Any) -> None:
        """World points (n, 3) as matplotlib's mark says."""
        self.axes.plot(
            *self.view.of(world - self.origin).T[:2], mark, zorder=self.level + zorder, **look
        )

    def torso(self) -> None:
        """The filled silhouette."""
        outline = self.frame.outline(self.view) - self.view.of(self.origin)[:2]
        self.axes.fill(
            *outline.T, facecolor=TORSO, edgecolor=INK, linewidth=0.7, zorder=self.level + 0.4
        )

    def line(self, corners: Array, **look: Any) -> None:
        """A line, all of it under the torso, and again over it where the torso cannot hide it."""
        fine = np.linspace(0, len(corners) - 1, 16 * (len(corners) - 1) + 1)
        world = np.stack([np.interp(fine, np.arange(len(corners)), c) for c in corners.T], axis=1)
        self.plot(world, "-", 0.2, **look)
        self.plot(self.visible(world), "-", 0.6, **look)

    def dots(self, world: Array, **look: Any) -> None:
        """Dots, under and over the torso likewise."""
        self.plot(world, "o", 0.3, **look)
        self.plot(self.visible(world), "o", 0.7, **look)

    def arrow(self, ends: Array) -> None:
        """An arrow from a world point to another, (2, 3), over all else."""
        tail, head = self.view.of(ends - self.origin)[:, :2]
        look = {
            "arrowstyle": "-|>,head_width=0.12,head_length=0.25",
            "color": FORCE,
            "linewidth": 1.0,
        }
        look |= {"shrinkA": 0, "shrinkB": 0, "zorder": self.level + 0.9}
        self.axes.annotate("", head, tail, arrowprops=look)

    def ground(self) -> None:
        """The ground, in a view from the side."""
        if self.frame.grounded and self.view is SIDE:
            self.axes.axhline(-self.origin[2], color=INK, linewidth=0.8, zorder=self.level)

    def visible(self, world: Array) -> Array:
        """World points, nan where the torso may hide them."""
        return np.where(self.frame.in_front(world, self.view)[:, None], world, np.nan)


def draw_animal(pen: Pen) -> None:
    """Torso, legs, tail with a dot at every point if they are few, and the ground's forces."""
    pen.torso()
    for leg in pen.frame.legs:
        pen.line(leg, color=LEG, linewidth=1.4)
    pen.line(pen.frame.tail, color=TAIL, linewidth=1.4)
    if len(pen.frame.tail) <= MOST_DOTS + 1:
        pen.dots(pen.frame.tail[1:], color=INK, markersize=2.4, markeredgewidth=0)
    for arrow in pen.frame.arrows:
        pen.arrow(arrow)


def draw_marks(pen: Pen) -> None:
    """The back's midline and tick, and the head: a dot on the near side, a ring on the far one."""
    _, length, height = pen.frame.body.semi_axes
    angle = np.linspace(0, np.pi, 61)
    back = pen.frame.world(
        np.stack([0 * angle, length * np.cos(angle), height * np.sin(angle)], axis=1)
    )
    pen.plot(pen.visible(back), "-", 0.5, color=INK, linewidth=0.7)
    pen.line(pen.frame.world(tick(pen.frame.body)), color=INK, linewidth=1.4)
    head = pen.frame.world([[0, length, 0]])
    fill = HEAD if pen.frame.in_front(head, pen.view)[0] else "white"
    pen.plot(head, "o", 0.8, color=HEAD, markersize=4, markerfacecolor=fill)
