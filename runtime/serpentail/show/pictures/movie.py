"""The pictures of a moving film: one after another on one figure, whose background is kept."""

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from .animal import Pen, draw_animal, draw_ground, draw_marks, draw_shadow
from .encode import Picture
from .page import drawn_points, window_around
from .strip import Strip
from .style import INK, QUIET, STYLE, Array
from .views import View

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

WIDEST, TALLEST = 9.6, 5.0  # inches, of all panels
TOP, FOOT, GAP = 0.45, 0.35, 0.08  # inches
DPI = 100


def pictures(strip: Strip, slowness: float) -> Iterator[Picture]:
    """Yield a strip's frames, one by one, in panels that show all of the motion."""
    from matplotlib import style
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    with style.context(STYLE, after_reset=True):
        figure, panels = _stage(strip)
        figure.text(0.99, 0.03, speed_words(slowness), ha="right", fontsize=9)
        canvas = FigureCanvasAgg(figure)
        canvas.draw()
    empty = canvas.copy_from_bbox(figure.bbox)
    for k in range(len(strip.films[0])):
        with style.context(STYLE, after_reset=True):
            canvas.restore_region(empty)
            _draw_frame(figure, panels, strip, k)
        yield np.asarray(canvas.buffer_rgba())[..., :3].copy()


def speed_words(slowness: float) -> str:
    """Say how fast a film runs."""
    if slowness == 1:
        return "real time"
    if slowness > 1:
        return f"1/{slowness:.3g} of real time"
    return f"{1 / slowness:.3g} times real time"


def even(length: float) -> float:
    """Inches of an even number of pixels, which encoders ask for; a bit more, against rounding."""
    return (2 * round(DPI * length / 2) + 0.01) / DPI


def _stage(strip: Strip) -> tuple["Figure", list[tuple["Axes", View, int]]]:
    """The figure with empty panels: a view of a motion each, all at one scale."""
    from matplotlib.figure import Figure

    places = [(view, film) for film in range(len(strip.films)) for view in strip.views]
    shapes = {view.name: _window(strip, view) for view in strip.views}
    sizes = np.array([shapes[view.name][1] - shapes[view.name][0] for view, _ in places])
    room = WIDEST - GAP * (len(places) - 1)
    scale = min(room / sizes[:, 0].sum(), TALLEST / sizes[:, 1].max())
    width = max(scale * sizes[:, 0].sum() + GAP * (len(places) + 1), 4.0)
    height = scale * sizes[:, 1].max() + TOP + FOOT
    width, height = even(width), even(height)
    figure = Figure(figsize=(width, height), dpi=DPI)
    x, panels = (width - scale * sizes[:, 0].sum() - GAP * (len(places) - 1)) / 2, []
    for (view, film), (wide, high) in zip(places, scale * sizes, strict=True):
        place = (x / width, FOOT / height, wide / width, high / height)
        axes = figure.add_axes(place, xticks=[], yticks=[])
        (left, low), (right, up) = shapes[view.name]
        axes.set(xlim=(left, right), ylim=(low, up))
        axes.set_title(f"{strip.names[film]}  {view.name}".strip(), fontsize=9, pad=4)
        axes.spines[:].set_visible(True)
        if strip.grounded:
            draw_ground(axes, view, np.zeros(3))
        panels.append((axes, view, film))
        x += wide + GAP
    return figure, panels


def _window(strip: Strip, view: View) -> Array:
    """Return the part of the world that a panel shows: all motions, and a strip of the ground."""
    shown = [drawn_points(frame, view) for frame in strip.every]
    if strip.anchored:
        shown.append(view.of(np.array([[*strip.every[0].com[:2], -0.01]]))[:, :2])
    return window_around(shown)


def _draw_frame(
    figure: "Figure", panels: list[tuple["Axes", View, int]], strip: Strip, k: int
) -> None:
    """Draw frame k over the empty panels, and remove its artists again."""
    renderer = figure.canvas.get_renderer()  # type: ignore[attr-defined]
    time = figure.text(0.01, 0.03, f"{strip.films[0][k].time:.3f} s", fontsize=9, color=INK)
    time.draw(renderer)
    time.remove()
    for axes, view, film in panels:
        before = set(axes.get_children())
        pen = Pen(axes, strip.films[film][k], view, np.zeros(3), strip.grounded)
        draw_shadow(pen)
        pen.plot(strip.coms[film][: k + 1], ":", 0.1, color=QUIET, linewidth=1.0)
        draw_animal(pen)
        draw_marks(pen)
        added = [artist for artist in axes.get_children() if artist not in before]
        for artist in sorted(added, key=lambda artist: artist.get_zorder()):
            axes.draw_artist(artist)
            artist.remove()
