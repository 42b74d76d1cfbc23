"""Filmstrips: a trajectory and its tail points in, SVG, PDF or PNG files of the moving animal
out.
"""

import dataclasses
import math
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from ..attitude import rotation_matrix
from ..motion.trajectory import Trajectory
from .animal import (
    FORCE,
    LEG,
    LONGEST,
    SIDE,
    TOP,
    Body,
    Frame,
    Pen,
    View,
    arrows,
    draw_animal,
    draw_marks,
    tick,
)
from .style import HEAD, INK, QUIET, TAIL, Array, writable, write

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


@dataclass(frozen=True)
class Page:
    """A film's page, inches: frames, panel width, heights of two rows, path panel (width, height)
    if any.
    """

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
        top = (
            self.base
            + self.film[1]
            - line * (TITLES + GAP + sum(self.rows))
            - TITLES
            - self.rows[0]
        )
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
    frames: int | Sequence[float] = 8,
    com: ArrayLike | None = None,
    **look: Any,
) -> Path:
    """Draw moments of a motion, side (y, z) over top (y, -x) view at one scale, and the COM path;
    return path.

    points (K, P, 3): the tail in the world at every sample, m; frames: how many, or their times
    (s); com (K, 3), m, by default the torso's.  look: legs (K, L, J, 3), their joints in the world,
    m (see ``leg_joints``); semi_axes and tail_mount, m (see Body).  On the ground, arrows are its
    forces.  No path panel when the COM stays within half a torso's length.
    """
    path, legs = writable(path), look.pop("legs", None)
    body = Body(**look)
    count = len(trajectory.t)
    points = _checked("points", points, (count, -1, 3))
    com = trajectory.q[:, :3] if com is None else _checked("com", com, (count, 3))
    legs = (
        np.zeros((count, 0, 2, 3)) if legs is None else _checked("legs", legs, (count, -1, -1, 3))
    )
    moments = _moments(trajectory.t, frames)
    film = [_frame(trajectory, points, com, body, k) for k in moments]
    film = [
        dataclasses.replace(frame, legs=legs[k]) for frame, k in zip(film, moments, strict=True)
    ]
    film, largest = _with_forces(film, trajectory, moments)
    return write(path, lambda: _draw_film(film, com, largest))


def _with_forces(
    film: list[Frame], trajectory: Trajectory, moments: list[int]
) -> tuple[list[Frame], float]:
    """Frames with arrows of the ground's forces, and the largest of these, N; 0 in flight."""
    if trajectory.contact is None:
        return film, 0.0
    points, forces = trajectory.contact.points[moments], trajectory.contact.forces[moments]
    largest = float(np.linalg.norm(forces, axis=-1).max())
    shown = [arrows(x, f, largest) for x, f in zip(points, forces, strict=True)]
    return [
        dataclasses.replace(f, arrows=a, grounded=True) for f, a in zip(film, shown, strict=True)
    ], largest


def _checked(name: str, value: ArrayLike, shape: tuple[int, ...]) -> Array:
    """A finite array of the shape, where -1 is any size but 0."""
    array = np.asarray(value, dtype=float)
    fits = array.ndim == len(shape) and all(
        k in (n, -1) for n, k in zip(array.shape, shape, strict=True)
    )
    if not fits or not array.size:
        wanted = str(shape).replace("-1", "P")
        raise ValueError(f"{name} has shape {array.shape}: give {wanted}, one row per sample")
    if not np.isfinite(array).all():
        raise ValueError(
            f"{name} {array.shape} has values that are not finite: give finite positions in m"
        )
    return array


def _moments(t: Array, wanted: int | Sequence[float]) -> list[int]:
    """The samples nearest to the wanted times, or to so many evenly spaced ones."""
    if np.ndim(wanted) == 1 and len(wanted) and np.isfinite(wanted).all():
        times = np.asarray(wanted, float)
    elif isinstance(wanted, bool) or not isinstance(wanted, int | np.integer) or wanted < 1:
        raise ValueError(f"frames is {wanted!r}: give a whole number of at least 1, or times in s")
    else:
        times = np.linspace(t[0], t[-1], wanted)
    return sorted({int(np.abs(t - time).argmin()) for time in times})


def _frame(trajectory: Trajectory, points: Array, com: Array, body: Body, k: int) -> Frame:
    """Sample k of the film."""
    torso, rotation = trajectory.q[k, :3], rotation_matrix(trajectory.attitude[k])
    root = torso + rotation @ body.tail_mount
    return Frame(
        float(trajectory.t[k]), torso, rotation, np.vstack([root, points[k]]), com[k], body
    )


def _draw_film(film: list[Frame], com: Array, largest: float = 0.0) -> "Figure":
    """The film's page."""
    from matplotlib.figure import Figure

    windows = [
        _window([_drawn(f, view) - view.of(f.com)[:2] for f in film]) for view in (SIDE, TOP)
    ]
    page = _page(film, windows, com)
    figure = Figure(figsize=page.size)
    for row in range(2):
        _draw_row(figure, page, row, film, windows[row], com)
    _draw_key(figure, page, windows[0], _key(film, largest))
    if page.path is not None:
        _draw_path(page.add(figure, page.path_panel()), film, com)
    return figure


def _drawn(frame: Frame, view: View) -> Array:
    """Everything a frame shows, as points (n, 2) in a view."""
    lines = np.vstack([frame.tail, frame.world(tick(frame.body)), *frame.legs])
    return np.vstack([frame.outline(view), view.of(lines)[:, :2]])


def _window(shapes: list[Array], margin: float = 0.012) -> Array:
    """Lower and upper corner (2, 2) of a box around all shapes."""
    every = np.vstack(shapes)
    return np.array([every.min(axis=0) - margin, every.max(axis=0) + margin])


def _page(film: list[Frame], windows: list[Array], com: Array) -> Page:
    """Sizes from the windows; the path panel beside the film where it fits, else below it, or
    nowhere.
    """
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


def _draw_row(
    figure: "Figure", page: Page, row: int, film: list[Frame], window: Array, com: Array
) -> None:
    """One view of every frame, each about its own COM, with the view's name and directions at the
    left.
    """
    view = (SIDE, TOP)[row]
    for k, frame in enumerate(film):
        x, y, width, height = page.panel(k, row)
        axes = page.add(figure, (x, y, width, height))
        axes.set(xlim=window[:, 0], ylim=window[:, 1], xticks=[], yticks=[])
        axes.spines[:].set_visible(True)
        pen = Pen(axes, frame, view, frame.com)
        pen.plot(com, ":", 0, color=QUIET, linewidth=1.0)
        pen.ground()
        draw_animal(pen)
        draw_marks(pen)
        if row == 0:
            axes.set_title(_label(k, film), pad=3)
        if x == LEFT:
            _draw_directions(page.add(figure, (0, y + height / 2 - 0.4, x, 0.8)), view)


def _label(k: int, film: list[Frame]) -> str:
    """Number and time of frame k, with the decimals that tell the frames apart."""
    step = min(np.diff([frame.time for frame in film]), default=1.0)
    decimals = max(0, math.ceil(-math.log10(1e3 * step)))
    return rf"$\mathbf{{{k + 1}}}$   {1e3 * film[k].time:.{decimals}f} ms"


def _draw_directions(axes: "Axes", view: View) -> None:
    """The view's name and its two directions, in a margin."""
    axes.set(xlim=(0, 1), ylim=(0, 1), xticks=[], yticks=[])
    axes.set_axis_off()
    head = "-|>,head_width=0.15,head_length=0.3"
    arrow = {"arrowstyle": head, "color": INK, "linewidth": 0.8, "shrinkA": 0, "shrinkB": 0}
    axes.text(0.45, 0.88, view.name, ha="center", va="center", weight="bold")
    for end, name, where in (
        ((0.7, 0.2), view.right, (0.8, 0.2)),
        ((0.3, 0.6), view.up, (0.3, 0.7)),
    ):
        axes.annotate("", end, (0.3, 0.2), arrowprops=arrow)
        axes.text(*where, name, ha="center", va="center", style="italic")


def _key(film: list[Frame], largest: float) -> dict[str, dict[str, Any]]:
    """What the marks of a film mean: on the ground also legs and forces."""
    legs = {"leg": {"color": LEG, "linewidth": 1.4}} if len(film[0].legs) else {}
    words = f"ground's force, {1e3 * LONGEST:.0f} mm: {largest:.3g} N"
    return KEY | legs | ({words: {"color": FORCE, "linewidth": 1.0}} if largest else {})


def _draw_key(figure: "Figure", page: Page, window: Array, key: dict[str, dict[str, Any]]) -> None:
    """The scale bar and what the marks mean, under the film."""
    from matplotlib.lines import Line2D

    length = 0.05 * page.column / float(window[1, 0] - window[0, 0])
    axes = page.add(figure, (LEFT, page.base - 0.25, 1.0, 0.16))
    axes.set(xlim=(0, 1), ylim=(0, 1))
    axes.set_axis_off()
    axes.plot([0, length], [0.5, 0.5], color=INK, linewidth=2, solid_capstyle="butt", clip_on=False)
    axes.text(length + 0.06, 0.5, "50 mm", va="center_baseline")
    handles = [Line2D([], [], label=name, **look) for name, look in key.items()]
    corner = ((LEFT + length + 0.6) / page.size[0], (page.base - 0.17) / page.size[1])
    figure.legend(
        handles=handles,
        loc="center left",
        bbox_to_anchor=corner,
        ncols=5 if len(key) < 6 else 4,
        columnspacing=1.4,
    )


def _draw_path(axes: "Axes", film: list[Frame], com: Array) -> None:
    """The flight from the side in true scale, every frame in its place, numbered at its COM."""
    low, high = _path_window(film, com)
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), xlabel="$y$ [m]", ylabel="$z$ [m]")
    pens = [Pen(axes, frame, SIDE, np.zeros(3), k) for k, frame in enumerate(film)]
    pens[0].ground()
    for pen in pens:
        draw_animal(pen)
    pens[-1].plot(com, ":", 1, color=INK, linewidth=1.0)
    for k, frame in enumerate(film):
        disc = {"color": "white", "markersize": 8, "markeredgecolor": INK, "markeredgewidth": 0.5}
        pens[-1].plot(frame.com[None], "o", 2, **disc)
        y, z, _ = SIDE.of(frame.com)
        axes.text(
            y, z, str(k + 1), ha="center", va="center_baseline", fontsize=6, zorder=len(film) + 2
        )
