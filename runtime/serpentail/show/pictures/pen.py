"""Draws the animal at one moment in a view: torso, tail, legs and forces of the ground."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from .frames import Frame, tick
from .style import FORCE, HEAD, INK, LEG, QUIET, SHADE, SHADOW, TAIL, TORSO, Array, Axes
from .views import TOP, View

WIDTH = 1.4  # points, of the tail
THIN, THICK = 0.4, 2.5  # of a tail of its own: least and largest width over that
MOST_DOTS = 20  # more tail points than this are drawn without dots
LARGE_DOTS = 8  # more joints than this get small marks, so that the tail's colour stays visible
PALE = 0.3  # opacity of parts below it
GRIDS = np.array([0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10])  # m, between lines on the ground
LINES = 8  # of the ground's grid that are seen, about
SLIVER = 0.05  # rad, of the torso's cap above the ground that is not drawn
EDGE_ON = 0.08  # sine of the elevation below which the ground is a line


@dataclass(frozen=True, eq=False)
class Pen:
    """Draws one frame on axes in a view, with world point `origin` at zero, above lower levels.

    If there is ground, z = 0, parts below it are pale.
    """

    axes: Axes
    frame: Frame
    view: View
    origin: Array
    grounded: bool = False
    level: float = 0.0

    def flat(self, world: Array) -> Array:
        """World points (..., 3) on the axes, (..., 2)."""
        return self.view.of(world - self.origin)[..., :2]

    # Axes.plot and Axes.fill take three times as long, because they update limits

    def plot(self, world: Array, mark: str, zorder: float, **look: Any) -> None:
        """World points (n, 3), joined by a line ("-", ":") or each a dot ("o")."""
        from matplotlib.lines import Line2D

        drawn = {"linestyle": "", "marker": mark} if mark == "o" else {"linestyle": mark}
        line = Line2D(*self.flat(world).T, zorder=self.level + zorder, **drawn | look)
        self.axes.add_artist(line)

    def fill(self, outline: Array, zorder: float, **look: Any) -> None:
        """A polygon (n, 2) on the axes."""
        from matplotlib.patches import Polygon

        self.axes.add_artist(Polygon(outline, zorder=self.level + zorder, **look))

    def torso(self) -> None:
        """Draw the filled silhouette, and again its part above the ground."""
        look = {"facecolor": TORSO, "edgecolor": INK, "linewidth": 0.7}
        outline = self.frame.outline(self.view) - self.view.of(self.origin)[:2]
        above = above_ground(self.frame) if self.grounded else None
        if above is None:
            self.fill(outline, 0.4, **look)
            return
        self.fill(outline, 0.4, alpha=PALE, **look)
        if len(above):
            from scipy.spatial import ConvexHull

            flat = self.flat(above)
            self.fill(flat[ConvexHull(flat).vertices], 0.41, **look)

    def line(self, corners: Array, **look: Any) -> None:
        """Draw a line below the torso, and, where it passes in front, above it with a white rim."""
        fine = np.linspace(0, len(corners) - 1, 16 * (len(corners) - 1) + 1)
        world = np.stack([np.interp(fine, np.arange(len(corners)), c) for c in corners.T], axis=1)
        above, below = self.parted(world)
        if below is not None:
            self.plot(below, "-", 0.2, alpha=PALE, **look)
        self.plot(above, "-", 0.2, **look)
        front = self.visible(above)
        if np.isfinite(front).any():
            rim = look | {"color": "white", "linewidth": look["linewidth"] + 1.4}
            rim |= {"solid_capstyle": "butt"}
            self.plot(front, "-", 0.59, **rim)
            self.plot(front, "-", 0.6, **look)

    def dots(self, world: Array, **look: Any) -> None:
        """Dots, under and over the torso likewise."""
        above, below = self.parted(world)
        if below is not None:
            self.plot(below, "o", 0.3, alpha=PALE, **look)
        self.plot(above, "o", 0.3, **look)
        self.plot(self.visible(above), "o", 0.7, **look)

    def arrows(self, ends: Array) -> None:
        """Arrows (n, 2, 3) from world points to others, over all else."""
        if not len(ends):
            return
        begin, end = self.flat(ends[:, 0]), self.flat(ends[:, 1])
        look = {"angles": "xy", "scale_units": "xy", "scale": 1, "units": "inches"}
        look |= {"width": 0.014, "headwidth": 4, "headlength": 4.5, "headaxislength": 4.5}
        self.axes.quiver(
            *begin.T, *(end - begin).T, color=FORCE, zorder=self.level + 0.9, minlength=0.5, **look
        )

    def parted(self, world: Array) -> tuple[Array, Array | None]:
        """World points above the ground and below it, nan elsewhere; None if none is below."""
        below = world[:, 2:] < 0
        if not self.grounded or not below.any():
            return world, None
        return np.where(below, np.nan, world), np.where(below, world, np.nan)

    def visible(self, world: Array) -> Array:
        """Return world points, nan where the torso may hide them."""
        return np.where(self.frame.in_front(world, self.view)[:, None], world, np.nan)


def above_ground(frame: Frame) -> Array | None:
    """Points (n, 3) of the torso's surface above the ground; None if all of it is.

    On the unit sphere they are a cap about n = diag(a) R^T e_z / d: z = p_z + d cos(polar).
    """
    normal = frame.rotation[2] * frame.animal.semi_axes
    depth = np.linalg.norm(normal)
    if frame.torso[2] >= depth:
        return None
    edge = np.arccos(np.clip(-frame.torso[2] / depth, -1, 1))
    if edge < SLIVER:
        return np.zeros((0, 3))
    polar, around = np.meshgrid(np.linspace(0, edge, 31), np.linspace(0, 2 * np.pi, 61))
    beside = np.linalg.svd(normal[None])[2][1:]
    ring = np.cos(around)[..., None] * beside[0] + np.sin(around)[..., None] * beside[1]
    sphere = np.cos(polar)[..., None] * normal / depth + np.sin(polar)[..., None] * ring
    return frame.world(sphere.reshape(-1, 3) * frame.animal.semi_axes)


def draw_moment(pen: Pen, path: Array) -> None:
    """The animal with its marks and shadow, and the path (K, 3) of its centre of mass."""
    _draw_shadow(pen)
    pen.plot(path, ":", 0.1, color=QUIET, linewidth=1.0)
    draw_animal(pen)
    _draw_marks(pen)


def draw_animal(pen: Pen) -> None:
    """Torso, legs, tail with a dot at every point if they are few, and the ground's forces."""
    pen.torso()
    for leg in pen.frame.legs:
        pen.line(leg, color=LEG, linewidth=1.4)
    _draw_tail(pen)
    count = len(pen.frame.tail)
    if count <= MOST_DOTS:
        size = 2.4 if count <= LARGE_DOTS else 1.2
        pen.dots(pen.frame.tail, color=INK, markersize=size, markeredgewidth=0)
    pen.arrows(pen.frame.arrows)


def _draw_tail(pen: Pen) -> None:
    """The tail, of one width or as thick as its links are."""
    tail, animal = pen.frame.tail, pen.frame.animal
    if animal.alike:
        pen.line(tail, color=TAIL, linewidth=WIDTH)
        return
    for k, thickness in enumerate(np.divide(animal.tail_radii, np.mean(animal.tail_radii))):
        if thickness:  # not between two chains
            width = WIDTH * min(max(thickness, THIN), THICK)
            pen.line(tail[k : k + 2], color=TAIL, linewidth=width)


def _draw_marks(pen: Pen) -> None:
    """The back's midline and tick, and the head: a dot on the near side, a ring on the far one."""
    if pen.frame.animal.fixed:
        return
    _, length, height = pen.frame.animal.semi_axes
    angle = np.linspace(0, np.pi, 61)
    back = pen.frame.world(
        np.stack([0 * angle, length * np.cos(angle), height * np.sin(angle)], axis=1)
    )
    pen.plot(pen.visible(back), "-", 0.5, color=INK, linewidth=0.7)
    pen.line(pen.frame.world(tick(pen.frame.animal)), color=INK, linewidth=1.4)
    head = pen.frame.world([[0, length, 0]])
    fill = HEAD if pen.frame.in_front(head, pen.view)[0] else "white"
    pen.plot(head, "o", 0.8, color=HEAD, markersize=4, markerfacecolor=fill)


def _draw_shadow(pen: Pen) -> None:
    """Draw the animal's shadow at noon, in views from above the ground."""
    if not pen.grounded or pen.view.matrix[2, 2] <= 0:
        return
    outline = pen.frame.outline(TOP) @ TOP.matrix[:2]
    pen.fill(pen.flat(outline), 0.02, facecolor=SHADOW, linewidth=0)
    pen.plot(pen.frame.tail * (1, 1, 0), "-", 0.02, color=SHADOW, linewidth=1.4)


def draw_ground(axes: Axes, view: View, origin: Array) -> None:
    """The ground z = 0: from aside a line over a shaded half, from above a grid."""
    (left, right), (low, high) = axes.get_xlim(), axes.get_ylim()
    height = -view.of(origin)[1]
    if view.matrix[2, 2] < EDGE_ON:
        axes.axhspan(min(low, height), height, color=SHADE, linewidth=0, zorder=-2)
        axes.axhline(height, color=INK, linewidth=0.8, zorder=-1)
        return
    axes.set_facecolor(SHADE)
    corners = np.array([[x, y] for x in (left, right) for y in (low, high)])
    lines = _grid(corners, view, origin)
    axes.plot(*lines.T, color="white", linewidth=0.7, zorder=-1)
    axes.set(xlim=(left, right), ylim=(low, high))


def _grid(corners: Array, view: View, origin: Array) -> Array:
    """The grid's lines (n, 2) on axes with these corners (4, 2), nan between lines."""
    across = view.matrix[:2, :2]  # from ground to axes, about the ground's zero
    ground = np.linalg.solve(across, (corners + view.of(origin)[:2]).T).T
    step = GRIDS[np.abs(np.sqrt(np.ptp(ground, axis=0).prod()) / LINES - GRIDS).argmin()]
    low, high = np.floor(ground.min(axis=0) / step), np.ceil(ground.max(axis=0) / step)
    (x0, y0), (x1, y1) = low * step, high * step
    nan = [np.nan, np.nan]
    points = []
    for x in np.arange(low[0], high[0] + 1) * step:
        points += [[x, y0], [x, y1], nan]
    for y in np.arange(low[1], high[1] + 1) * step:
        points += [[x0, y], [x1, y], nan]
    return np.array(points) @ across.T - view.of(origin)[:2]
