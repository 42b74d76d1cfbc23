"""Films on paper: moments of a motion side by side, seen from the side and from above."""

import dataclasses
import math
import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from ..attitude import rotation_matrix
from ..model.layout import POSITION
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
)
from .page import LEFT, Page, drawn_points, page_of, path_window, window_around
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


def filmstrip(
    trajectory: Trajectory,
    points: ArrayLike,
    path: str | os.PathLike[str],
    frames: int | Sequence[float] = 8,
    com: ArrayLike | None = None,
    **look: Any,
) -> Path:
    """Draw moments of a motion, side (y, z) over top (y, -x) view at one scale, and the COM's path.

    points (K, P, 3): the tail in the world at every sample, m.  frames: how many, or their times
    (s).  com (K, 3): m, by default the torso's.  look: legs (K, L, J, 3), their joints in the
    world, m (see ``leg_joints``); semi_axes and tail_mount, m (see Body).
    On the ground, arrows are its forces.  The path has no panel when the COM stays within half a
    torso's length.  Returns the path of the file; ValueError where an array has another shape.
    """
    path, legs = writable(path), look.pop("legs", None)
    body, count = Body(**look), len(trajectory.t)

    # the motion, sample by sample
    points = _checked("points", points, (count, -1, 3))
    com = trajectory.q[:, POSITION] if com is None else _checked("com", com, (count, 3))
    if legs is None:
        legs = np.zeros((count, 0, 2, 3))
    else:
        legs = _checked("legs", legs, (count, -1, -1, 3))

    # the samples to draw
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
    grounded = [
        dataclasses.replace(f, arrows=a, grounded=True) for f, a in zip(film, shown, strict=True)
    ]
    return grounded, largest


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
    if np.ndim(wanted) == 1 and np.size(wanted) and np.isfinite(wanted).all():
        times = np.asarray(wanted, float)
    elif isinstance(wanted, bool) or not isinstance(wanted, int | np.integer) or wanted < 1:
        raise ValueError(f"frames is {wanted!r}: give a whole number of at least 1, or times in s")
    else:
        times = np.linspace(t[0], t[-1], wanted)
    return sorted({int(np.abs(t - time).argmin()) for time in times})


def _frame(trajectory: Trajectory, points: Array, com: Array, body: Body, k: int) -> Frame:
    """Sample k of the film."""
    torso, rotation = trajectory.q[k, POSITION], rotation_matrix(trajectory.attitude[k])
    tail = np.vstack([torso + rotation @ body.tail_mount, points[k]])
    return Frame(float(trajectory.t[k]), torso, rotation, tail, com[k], body)


def _draw_film(film: list[Frame], com: Array, largest: float = 0.0) -> "Figure":
    """The film's page."""
    from matplotlib.figure import Figure

    windows = [
        window_around([drawn_points(f, view) - view.of(f.com)[:2] for f in film])
        for view in (SIDE, TOP)
    ]
    page = page_of(film, windows, com)
    figure = Figure(figsize=page.size)
    for row in range(2):
        _draw_row(figure, page, row, film, windows[row], com)
    _draw_key(figure, page, windows[0], _key(film, largest))
    if page.path is not None:
        _draw_path(page.add(figure, page.path_panel()), film, com)
    return figure


def _draw_row(
    figure: "Figure", page: Page, row: int, film: list[Frame], window: Array, com: Array
) -> None:
    """One view of every frame, each about its own COM; its name and directions at the left."""
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
    low, high = path_window(film, com)
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
