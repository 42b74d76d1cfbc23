"""Filmstrips: a trajectory and its tail points in, SVG, PDF or PNG files of the moving animal out."""

import dataclasses
import math
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .plot import HEAD, INK, QUIET, TAIL, TORSO, Array, writable, write
from .trajectory import Trajectory, rotation_matrix

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

DOT: dict[str, Any] = {"color": HEAD, "linestyle": "", "marker": "o", "markersize": 4}
KEY: dict[str, dict[str, Any]] = {
    "head": DOT,
    "head, far side": DOT | {"markerfacecolor": "white"},
    "back": {"color": INK, "linewidth": 1.4},
    "tail": {"color": TAIL, "linewidth": 1.4},
    "path of the COM": {"color": QUIET, "linestyle": ":"},
}
GAP, LEFT, TITLES, FOOT, RULER = 0.06, 0.62, 0.26, 0.5, 0.62  # page margins, inches
LEAST, TALLEST = (
    6.1,
    3.2,
)  # the page's least width (for the key) and the tallest path panel below a film, inches
PER_LINE = 6  # most frames on a line
MOST_DOTS = 20  # more tail points than this are drawn without dots


@dataclass(frozen=True)
class Body:
    """The drawn torso: its ellipsoid's semi-axes and the tail's root, both in the torso frame, m."""

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
    """An orthographic view; the rows of its matrix are the world directions right, up, towards the viewer."""

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
    """One moment of a film: time, torso position and rotation, root and tail (P + 1, 3), COM; world, SI."""

    time: float
    torso: Array
    rotation: Array
    tail: Array
    com: Array
    body: Body

    def world(self, local: ArrayLike) -> Array:
        """Torso points (n, 3) in the world."""
        return self.torso + np.asarray(local, dtype=float) @ self.rotation.T

    def outline(self, view: View) -> Array:
        """The torso's silhouette (n, 2) in a view."""
        return view.of(self.torso)[:2] + silhouette(self.rotation, self.body.semi_axes, view)

    def in_front(self, world: Array, view: View) -> NDArray[np.bool_]:
        """Which world points x (n, 3) it cannot hide: |u| >= 1, near side, u = diag(a)^-1 R^T (x - p)."""
        u = (world - self.torso) @ self.rotation / self.body.semi_axes
        towards = view.matrix[2] @ self.rotation / self.body.semi_axes
        return np.asarray((np.linalg.norm(u, axis=1) > 1 - 1e-9) & (u @ towards > -1e-6))


@dataclass(frozen=True)
class Page:
    """A film's page, inches: frames, panel width, heights of two rows, path panel (width, height) if any."""

    frames: int
    column: float
    rows: tuple[float, float]
    path: tuple[float, float] | None
    beside: bool

    @property
    def per_line(self) -> int:
        """Frames on a line."""
        return math.ceil(self.frames / math.ceil(self.frames / PER_LINE))

    @property
    def film(self) -> tuple[float, float]:
        """Width and height of all lines."""
        lines = math.ceil(self.frames / self.per_line)
        return self.per_line * (self.column + GAP) - GAP, lines * (TITLES + GAP + sum(self.rows))

    @property
    def base(self) -> float:
        """Height of the film's lower edge on the page."""
        return FOOT + (0 if self.path is None or self.beside else self.path[1] + FOOT)

    @property
    def size(self) -> tuple[float, float]:
        """Width and height of the page."""
        reach = RULER + self.path[0] if self.path is not None and self.beside else 0
        width = LEFT + max(self.film[0] + reach, LEAST)
        return width + 3 * GAP, self.base + self.film[1] + GAP

    def add(self, figure: "Figure", place: Sequence[float]) -> "Axes":
        """Axes at (x, y, w, h) inches."""
        (width, height), (x, y, w, h) = self.size, place
        return figure.add_axes((x / width, y / height, w / width, h / height))

    def panel(self, k: int, row: int) -> tuple[float, float, float, float]:
        """Place of frame k's panel in the upper (0) or lower (1) row of its line."""
        line, column = divmod(k, self.per_line)
        top = self.base + self.film[1] - line * (TITLES + GAP + sum(self.rows)) - TITLES - self.rows[0]
        x, y = LEFT + column * (self.column + GAP), top - row * (GAP + self.rows[1])
        return x, y, self.column, self.rows[row]

    def path_panel(self) -> tuple[float, float, float, float]:
        """Place of the path panel."""
        width, height = self.path or (0, 0)
        return (LEFT + self.film[0] + RULER if self.beside else LEFT), FOOT, width, height


def filmstrip(
    trajectory: Trajectory,
    points: ArrayLike,
    path: str | os.PathLike[str],
    frames: int = 8,
    com: ArrayLike | None = None,
    **body: Any,
) -> Path:
    """Draw moments of flight, side (y, z) over top (y, -x) view at one scale, and the COM path; return path.

    points (K, P, 3): the tail in the world at every sample, m; com (K, 3), m, by default the torso's; body:
    semi_axes and tail_mount, m (see Body). No path panel when the COM stays within half a torso's length.
    """
    path, body_drawn = writable(path), Body(**body)
    points = _checked("points", points, (len(trajectory.t), -1, 3))
    com = trajectory.q[:, :3] if com is None else _checked("com", com, (len(trajectory.t), 3))
    film = [_frame(trajectory, points, com, body_drawn, k) for k in _moments(trajectory.t, frames)]
    return write(path, lambda: _draw_film(film, com))


def silhouette(rotation: Array, semi_axes: ArrayLike, view: View = SIDE, count: int = 121) -> Array:
    """Outline (count, 2), m, about the centre, of an ellipsoid turned by R: ellipse P R diag(a^2) R^T P^T."""
    spread = view.matrix[:2] @ rotation * np.asarray(semi_axes, dtype=float)
    angle = np.linspace(0, 2 * np.pi, count)
    return np.stack([np.cos(angle), np.sin(angle)], axis=1) @ np.linalg.cholesky(spread @ spread.T).T


def _checked(name: str, value: ArrayLike, shape: tuple[int, ...]) -> Array:
    """A finite array of the shape, where -1 is any size but 0."""
    array = np.asarray(value, dtype=float)
    fits = array.ndim == len(shape) and all(k in (n, -1) for n, k in zip(array.shape, shape, strict=True))
    if not fits or not array.size:
        wanted = str(shape).replace("-1", "P")
        raise ValueError(f"{name} has shape {array.shape}: give {wanted}, one row per sample")
    if not np.isfinite(array).all():
        raise ValueError(f"{name} {array.shape} has values that are not finite: give finite positions in m")
    return array


def _moments(t: Array, count: int) -> list[int]:
    """The samples nearest to `count` evenly spaced times."""
    if isinstance(count, bool) or not isinstance(count, int | np.integer) or count < 1:
        raise ValueError(f"frames is {count!r}: give a whole number of at least 1")
    wanted = np.linspace(t[0], t[-1], count)
    return sorted({int(np.abs(t - time).argmin()) for time in wanted})


def _frame(trajectory: Trajectory, points: Array, com: Array, body: Body, k: int) -> Frame:
    """Sample k of the film."""
    torso, rotation = trajectory.q[k, :3], rotation_matrix(trajectory.attitude[k])
    root = torso + rotation @ body.tail_mount
    return Frame(float(trajectory.t[k]), torso, rotation, np.vstack([root, points[k]]), com[k], body)


def _draw_film(film: list[Frame], com: Array) -> "Figure":
    """The film's page."""
    from matplotlib.figure import Figure

    windows = [_window([_drawn(f, view) - view.of(f.com)[:2] for f in film]) for view in (SIDE, TOP)]
    page = _page(film, windows, com)
    figure = Figure(figsize=page.size)
    for row in range(2):
        _draw_row(figure, page, row, film, windows[row], com)
    _draw_key(figure, page, windows[0])
    if page.path is not None:
        _draw_path(page.add(figure, page.path_panel()), film, com)
    return figure


def _drawn(frame: Frame, view: View) -> Array:
    """Everything a frame shows, as points (n, 2) in a view."""
    lines = np.vstack([frame.tail, frame.world(_tick(frame.body))])
    return np.vstack([frame.outline(view), view.of(lines)[:, :2]])


def _window(shapes: list[Array], margin: float = 0.012) -> Array:
    """Lower and upper corner (2, 2) of a box around all shapes."""
    every = np.vstack(shapes)
    return np.array([every.min(axis=0) - margin, every.max(axis=0) + margin])


def _tick(body: Body) -> Array:
    """The mark on the back, (2, 3), in the torso frame."""
    height = body.semi_axes[2]
    return np.array([[0, 0, height], [0, 0, 1.5 * height]])


def _page(film: list[Frame], windows: list[Array], com: Array) -> Page:
    """Sizes from the windows; the path panel beside the film where it fits, else below it, or nowhere."""
    (wide, high), (_, deep) = (window[1] - window[0] for window in windows)
    column = min(max(1.4 * math.sqrt(wide / high), 1.35), 1.9)
    alone = Page(len(film), column, (column * high / wide, column * deep / wide), None, False)
    if np.ptp(com[:, 1:], axis=0).max() < max(film[0].body.semi_axes):
        return alone
    low, up = _path_window(film, com)
    aspect = float((up - low)[0] / (up - low)[1])
    beside = aspect < 1.6 and alone.per_line >= 4
    tall = alone.film[1] - TITLES if beside else min(TALLEST, max(alone.film[0], 4.0) / aspect)
    return dataclasses.replace(alone, path=(tall * aspect, tall), beside=beside)


def _path_window(film: list[Frame], com: Array) -> Array:
    """The corners (2, 2) of the path panel."""
    return _window([*(_drawn(frame, SIDE) for frame in film), SIDE.of(com)[:, :2]])


def _draw_row(figure: "Figure", page: Page, row: int, film: list[Frame], window: Array, com: Array) -> None:
    """One view of every frame, each about its own COM, with the view's name and directions at the left."""
    view = (SIDE, TOP)[row]
    for k, frame in enumerate(film):
        x, y, width, height = page.panel(k, row)
        axes = page.add(figure, (x, y, width, height))
        axes.set(xlim=window[:, 0], ylim=window[:, 1], xticks=[], yticks=[])
        axes.spines[:].set_visible(True)
        pen = Pen(axes, frame, view, frame.com)
        pen.plot(com, ":", 0, color=QUIET, linewidth=1.0)
        _draw_animal(pen)
        _draw_marks(pen)
        if row == 0:
            axes.set_title(_label(k, film), pad=3)
        if x == LEFT:
            _draw_directions(page.add(figure, (0, y + height / 2 - 0.4, x, 0.8)), view)


def _label(k: int, film: list[Frame]) -> str:
    """Number and time of frame k, with the decimals that tell the frames apart."""
    step = min(np.diff([frame.time for frame in film]), default=1.0)
    decimals = max(0, math.ceil(-math.log10(1e3 * step)))
    return rf"$\mathbf{{{k + 1}}}$   {1e3 * film[k].time:.{decimals}f} ms"


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
        self.axes.plot(*self.view.of(world - self.origin).T[:2], mark, zorder=self.level + zorder, **look)

    def torso(self) -> None:
        """The filled silhouette."""
        outline = self.frame.outline(self.view) - self.view.of(self.origin)[:2]
        self.axes.fill(*outline.T, facecolor=TORSO, edgecolor=INK, linewidth=0.7, zorder=self.level + 0.4)

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

    def visible(self, world: Array) -> Array:
        """World points, nan where the torso may hide them."""
        return np.where(self.frame.in_front(world, self.view)[:, None], world, np.nan)


def _draw_animal(pen: Pen) -> None:
    """Torso, tail, and a dot at every tail point if they are few enough to be told apart."""
    pen.torso()
    pen.line(pen.frame.tail, color=TAIL, linewidth=1.4)
    if len(pen.frame.tail) <= MOST_DOTS + 1:
        pen.dots(pen.frame.tail[1:], color=INK, markersize=2.4, markeredgewidth=0)


def _draw_marks(pen: Pen) -> None:
    """The back's midline and tick, and the head end: a full dot on the near side, a ring on the far side."""
    _, length, height = pen.frame.body.semi_axes
    angle = np.linspace(0, np.pi, 61)
    back = pen.frame.world(np.stack([0 * angle, length * np.cos(angle), height * np.sin(angle)], axis=1))
    pen.plot(pen.visible(back), "-", 0.5, color=INK, linewidth=0.7)
    pen.line(pen.frame.world(_tick(pen.frame.body)), color=INK, linewidth=1.4)
    head = pen.frame.world([[0, length, 0]])
    fill = HEAD if pen.frame.in_front(head, pen.view)[0] else "white"
    pen.plot(head, "o", 0.8, color=HEAD, markersize=4, markerfacecolor=fill)


def _draw_directions(axes: "Axes", view: View) -> None:
    """The view's name and its two directions, in a margin."""
    axes.set(xlim=(0, 1), ylim=(0, 1), xticks=[], yticks=[])
    axes.set_axis_off()
    head = "-|>,head_width=0.15,head_length=0.3"
    arrow = {"arrowstyle": head, "color": INK, "linewidth": 0.8, "shrinkA": 0, "shrinkB": 0}
    axes.text(0.45, 0.88, view.name, ha="center", va="center", weight="bold")
    for end, name, where in (((0.7, 0.2), view.right, (0.8, 0.2)), ((0.3, 0.6), view.up, (0.3, 0.7))):
        axes.annotate("", end, (0.3, 0.2), arrowprops=arrow)
        axes.text(*where, name, ha="center", va="center", style="italic")


def _draw_key(figure: "Figure", page: Page, window: Array) -> None:
    """The scale bar and what the marks mean, under the film."""
    from matplotlib.lines import Line2D

    length = 0.05 * page.column / float(window[1, 0] - window[0, 0])
    axes = page.add(figure, (LEFT, page.base - 0.25, 1.0, 0.16))
    axes.set(xlim=(0, 1), ylim=(0, 1))
    axes.set_axis_off()
    axes.plot([0, length], [0.5, 0.5], color=INK, linewidth=2, solid_capstyle="butt", clip_on=False)
    axes.text(length + 0.06, 0.5, "50 mm", va="center_baseline")
    handles = [Line2D([], [], label=name, **look) for name, look in KEY.items()]
    corner = ((LEFT + length + 0.6) / page.size[0], (page.base - 0.17) / page.size[1])
    figure.legend(handles=handles, loc="center left", bbox_to_anchor=corner, ncols=5, columnspacing=1.4)


def _draw_path(axes: "Axes", film: list[Frame], com: Array) -> None:
    """The flight from the side in true scale, every frame in its place, numbered at its COM."""
    low, high = _path_window(film, com)
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), xlabel="$y$ [m]", ylabel="$z$ [m]")
    pens = [Pen(axes, frame, SIDE, np.zeros(3), k) for k, frame in enumerate(film)]
    for pen in pens:
        _draw_animal(pen)
    pens[-1].plot(com, ":", 1, color=INK, linewidth=1.0)
    for k, frame in enumerate(film):
        disc = {"color": "white", "markersize": 8, "markeredgecolor": INK, "markeredgewidth": 0.5}
        pens[-1].plot(frame.com[None], "o", 2, **disc)
        y, z, _ = SIDE.of(frame.com)
        axes.text(y, z, str(k + 1), ha="center", va="center_baseline", fontsize=6, zorder=len(film) + 2)
