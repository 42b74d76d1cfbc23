"""``filmstrip``: moments of motions side by side, in one or several views."""

import math
import os
from collections.abc import Sequence
from typing import Any

import numpy as np

from ...basics.extras import needed
from ...model.model import Model
from ..motions import Motions, checked_motions
from .frames import Frame, drawn_points, window_around
from .pen import Pen, draw_animal, draw_ground, draw_moment
from .sheet import LEFT, Sheet, sheet_of
from .strip import Strip, strip_of
from .style import INK, Array, Axes, Figure, drawn
from .views import SIDE, View, views_of

VIEWS = ("side", "oblique")


def filmstrip(
    motions: Motions,
    path: str | os.PathLike[str] | None = None,
    *,
    frames: int | Sequence[float] = 8,
    views: Sequence[str | tuple[float, float]] = VIEWS,
    names: Sequence[str] | None = None,
    model: Model | None = None,
) -> tuple["Figure", np.ndarray]:
    """Draw moments of a motion side by side; of several motions, at the same times.

    Where a motion touches the ground or stays above it, the ground is drawn, and parts below it
    are pale. Arrows are the ground's forces.

    Parameters
    ----------
    motions : Trajectory, str, path, sequence or dict of these
        The motions or their .npz files; a dict has names as keys.
    path : str or path, optional
        A .pdf, .png or .svg file to write the figure to, whole or not at all.
    frames : int or sequence of float, default 8
        Times of the frames (s), or their number; the motion between two frames is then about
        equal.
    views : sequence of str or of (float, float), default ("side", "oblique")
        Views: "side", "top", "oblique", or azimuth and elevation (deg).
    names : sequence of str, optional
        Names of the motions.
    model : Model, optional
        The model of motions that were read from files.

    Returns
    -------
    figure : matplotlib.figure.Figure
        The figure.
    axes : ndarray of matplotlib.axes.Axes, shape (rows, frames)
        One row for each view of each motion.

    Raises
    ------
    ViewError
        An argument is wrong.
    ModelError
        The model lacks "tail_points".
    ExtraMissing
        Matplotlib is not installed; it comes with the extra "plot".
    """
    needed("matplotlib", "plot")
    every, names = checked_motions(motions, names, model)
    strip = strip_of(every, frames, views_of(views), names, model)
    return drawn(lambda: _draw(strip), path)


def _draw(strip: Strip) -> tuple[Figure, np.ndarray]:
    """The strip's sheet."""
    from .figure import Drawing

    windows, key = strip.windows(), strip.key()
    lines = [(film, row) for film in range(len(strip.films)) for row in range(len(windows))]
    shown = None if strip.anchored else _path_aspect(strip)
    sheet = sheet_of(len(strip.films[0]), [windows[row] for _, row in lines], len(key), shown)
    figure = Drawing(figsize=sheet.size)
    axes = np.empty((len(lines), sheet.frames), dtype=object)
    for line, (film, row) in enumerate(lines):
        axes[line] = _draw_row(figure, sheet, line, strip, (film, row), windows[row])
    _draw_key(figure, sheet, windows[0], key)
    if sheet.path is not None:
        _draw_path(sheet.add(figure, sheet.path_panel()), strip)
    return figure, axes


def _path_aspect(strip: Strip) -> float | None:
    """Width over height of the path's panel; None for several motions, or one that hardly moves."""
    still = np.ptp(strip.coms[0][:, 1:], axis=0).max() < max(strip.every[0].animal.semi_axes)
    if len(strip.films) > 1 or still:
        return None
    low, high = _path_window(strip)
    return float((high - low)[0] / (high - low)[1])


def _path_window(strip: Strip) -> Array:
    """The corners (2, 2) of the path's panel."""
    shapes = [drawn_points(frame, SIDE) for frame in strip.films[0]]
    return window_around([*shapes, SIDE.of(strip.coms[0])[:, :2]])


def _draw_row(
    figure: Figure, sheet: Sheet, line: int, strip: Strip, which: tuple[int, int], window: Array
) -> list[Axes]:
    """One view of every frame of a motion; its name and directions at the left."""
    film, view = strip.films[which[0]], strip.views[which[1]]
    every = []
    for k, frame in enumerate(film):
        x, y, width, height = sheet.panel(k, line)
        axes = sheet.add(figure, (x, y, width, height))
        axes.set(xlim=window[:, 0], ylim=window[:, 1], xticks=[], yticks=[])
        axes.spines[:].set_visible(True)
        pen = Pen(axes, frame, view, strip.origin(frame), strip.grounded)
        if strip.grounded:
            draw_ground(axes, view, pen.origin)
        draw_moment(pen, strip.coms[which[0]])
        if line == 0:
            axes.set_title(_label(k, film), pad=3)
        if x == LEFT:
            place = (0, y + height / 2 - 0.45, x, 0.9)
            name = strip.names[which[0]] if which[1] == 0 else ""
            _draw_directions(sheet.add(figure, place), view, name)
        every.append(axes)
    return every


def _label(k: int, film: list[Frame]) -> str:
    """Return number and time of frame k, with enough decimals to distinguish the frames."""
    step = min(np.diff([frame.time for frame in film]), default=1.0)
    decimals = max(0, math.ceil(-math.log10(1e3 * step)))
    return rf"$\mathbf{{{k + 1}}}$  {1e3 * film[k].time:.{decimals}f} ms"


def _draw_directions(axes: Axes, view: View, motion: str) -> None:
    """The motion's and the view's name and the world's directions, in a margin."""
    axes.set(xlim=(-0.36, 0.36), ylim=(-0.35, 0.55), xticks=[], yticks=[])
    axes.set_axis_off()
    axes.text(0, 0.58, motion, ha="center", va="bottom", weight="bold")
    axes.text(0, 0.45, view.name, ha="center", va="center")
    head = "-|>,head_width=0.12,head_length=0.25"
    arrow = {"arrowstyle": head, "color": INK, "linewidth": 0.8, "shrinkA": 0, "shrinkB": 0}
    for name, direction in zip("xyz", view.matrix[:2].T, strict=True):
        if np.linalg.norm(direction) > 0.1:
            axes.annotate("", 0.22 * direction, (0, 0), arrowprops=arrow, annotation_clip=False)
            place = direction * (0.22 + 0.09 / np.linalg.norm(direction))
            axes.text(place[0], place[1], f"${name}$", ha="center", va="center", fontsize=7)


def _draw_key(figure: Figure, sheet: Sheet, window: Array, key: dict[str, dict[str, Any]]) -> None:
    """The scale bar and what the marks mean, at the foot of the sheet."""
    from matplotlib.lines import Line2D

    length = 0.05 * sheet.column / float(window[1, 0] - window[0, 0])
    axes = sheet.add(figure, (LEFT, sheet.foot - 0.2, 1.0, 0.16))
    axes.set(xlim=(0, 1), ylim=(0, 1))
    axes.set_axis_off()
    axes.plot([0, length], [0.5, 0.5], color=INK, linewidth=2, solid_capstyle="butt", clip_on=False)
    axes.text(length + 0.06, 0.5, "50 mm", va="center_baseline")
    handles = [Line2D([], [], label=name, **look) for name, look in key.items()]
    corner = ((LEFT + length + 0.55) / sheet.size[0], (sheet.foot - 0.06) / sheet.size[1])
    look = {"ncols": sheet.key_columns, "columnspacing": 1.2, "borderaxespad": 0, "borderpad": 0}
    figure.legend(handles=handles, loc="upper left", bbox_to_anchor=corner, **look)


def _draw_path(axes: Axes, strip: Strip) -> None:
    """The motion from the side in true scale, every frame in its place, numbered at its COM."""
    film, com = strip.films[0], strip.coms[0]
    low, high = _path_window(strip)
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), xlabel="$y$ [m]", ylabel="$z$ [m]")
    pens = [Pen(axes, frame, SIDE, np.zeros(3), strip.grounded, k) for k, frame in enumerate(film)]
    if strip.grounded:
        draw_ground(axes, SIDE, np.zeros(3))
    for pen in pens:
        draw_animal(pen)
    pens[-1].plot(com, ":", 1, color=INK, linewidth=1.0)
    for k, frame in enumerate(film):
        disc = {"color": "white", "markersize": 8, "markeredgecolor": INK, "markeredgewidth": 0.5}
        pens[-1].plot(frame.com[None], "o", 2, **disc)
        y, z, _ = SIDE.of(frame.com)
        look: dict[str, Any] = {"fontsize": 6, "zorder": len(film) + 2}
        axes.text(y, z, str(k + 1), ha="center", va="center_baseline", **look)
