"""``film``: writes motions as a moving film, a filmstrip or a page, by the file's suffix.

The pictures of a moving film are drawn one after another on one figure, whose background is kept.
"""

import os
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from ...basics.checks import number
from ...basics.errors import ViewError
from ...basics.extras import needed
from ...model.model import Model
from ..motions import Motions, checked_motions
from ..page.view import template
from ..page.view import view as write_page
from .encode import RATE, Picture, encoder, write_gif, write_mp4
from .filmstrip import VIEWS, filmstrip
from .frames import drawn_points, window_around
from .pen import Pen, draw_ground, draw_moment
from .strip import Strip, strip_of
from .style import INK, METADATA, STYLE, Array, Axes, Figure
from .views import View, views_of

MOVING = {".gif": write_gif, ".mp4": write_mp4}
MOST = 10_000  # frames
WIDEST, TALLEST = 9.6, 5.0  # inches, of all panels
TOP, FOOT, GAP = 0.45, 0.35, 0.08  # inches
DPI = 100
LASTS = 4.0  # s, of a film without given speed: slow motion, never faster than real time


def film(
    motions: Motions,
    path: str | os.PathLike[str],
    *,
    speed: float | None = None,
    views: Sequence[str | tuple[float, float]] = VIEWS,
    names: Sequence[str] | None = None,
    model: Model | None = None,
) -> Path:
    """Write one motion, or several beside each other, as a film, a filmstrip or a page.

    Parameters
    ----------
    motions : Trajectory, str, path, sequence or dict of these
        The motions or their .npz files; a dict has names as keys.
    path : str or path
        The file. .mp4 and .gif are moving films with 25 frames per second; .png, .pdf and .svg
        are filmstrips as of ``filmstrip``; .html is the page of ``view``.
    speed : float, optional
        Speed of a moving film relative to real time. Default: slow motion that lasts about 4 s,
        or real time if that lasts longer.
    views, names, model
        As of ``filmstrip``; a page has its own views.

    Returns
    -------
    Path
        The path of the file, which is written whole or not at all.

    Raises
    ------
    ViewError
        An argument is wrong.
    ModelError
        The model lacks "tail_points".
    ExtraMissing
        A library is not installed; it comes with the extra "plot".

    Examples
    --------
    >>> st.film(motion, "tumble.gif", speed=0.1)  # doctest: +SKIP
    """
    target = film_path(path)
    kind = target.suffix.lower()
    if kind == ".html":
        return write_page(motions, target, names=names, model=model)
    if kind in METADATA:
        filmstrip(motions, target, views=views, names=names, model=model)
        return target
    every, names = checked_motions(motions, names, model)
    begin, end = max(m.t[0] for m in every), min(m.t[-1] for m in every)
    if begin >= end:
        raise ViewError("motions: they have no time in common, which a moving film needs")
    slowness = _slowness(speed, end - begin)
    times = _times(begin, end, RATE * slowness)
    moved = [motion.resample(times) for motion in every]
    strip = strip_of(moved, times, views_of(views), names, model)
    MOVING[kind](target, pictures(strip, slowness))
    return target


def film_path(path: str | os.PathLike[str]) -> Path:
    """Return the path of a film.

    ViewError if its suffix is unknown, or if the encoder or the page that it needs is missing;
    ExtraMissing for a picture without the extra "plot".
    """
    target = Path(path)
    kind = target.suffix.lower()
    known = sorted((*MOVING, *METADATA, ".html"))
    if kind not in known:
        raise ViewError(f"film {str(path)!r} has suffix {kind!r}: use one of {', '.join(known)}")
    if kind == ".mp4":
        encoder()
    if kind == ".html":
        template()
    else:
        needed("matplotlib", "plot")
    return target


def _slowness(speed: float | None, lasts: float) -> float:
    """Return how many times slower than real time a film of a motion of ``lasts`` s is."""
    if speed is None:
        return float(max(1, round(LASTS / lasts)))
    return 1 / number("speed", speed, ViewError, above=0)


def _times(begin: float, end: float, rate: float) -> Array:
    """Return the times of the frames; ViewError if there are too many."""
    count = (end - begin) * rate + 1e-9
    if count >= MOST:
        raise ViewError(
            f"speed: {count:.3g} frames for {end - begin:.4g} s of motion: a film has at most "
            f"{MOST}; give a greater speed"
        )
    return np.minimum(begin + np.arange(int(count) + 1) / rate, end)


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


def _stage(strip: Strip) -> tuple[Figure, list[tuple[Axes, View, int]]]:
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
    for (view, k), (wide, high) in zip(places, scale * sizes, strict=True):
        place = (x / width, FOOT / height, wide / width, high / height)
        axes = figure.add_axes(place, xticks=[], yticks=[])
        (left, low), (right, up) = shapes[view.name]
        axes.set(xlim=(left, right), ylim=(low, up))
        axes.set_title(f"{strip.names[k]}  {view.name}".strip(), fontsize=9, pad=4)
        axes.spines[:].set_visible(True)
        if strip.grounded:
            draw_ground(axes, view, np.zeros(3))
        panels.append((axes, view, k))
        x += wide + GAP
    return figure, panels


def _window(strip: Strip, view: View) -> Array:
    """Return the part of the world that a panel shows: all motions, and a strip of the ground."""
    shown = [drawn_points(frame, view) for frame in strip.every]
    if strip.anchored:
        shown.append(view.of(np.array([[*strip.every[0].com[:2], -0.01]]))[:, :2])
    return window_around(shown)


def _draw_frame(figure: Figure, panels: list[tuple[Axes, View, int]], strip: Strip, k: int) -> None:
    """Draw frame k over the empty panels, and remove its artists again."""
    renderer = figure.canvas.get_renderer()  # type: ignore[attr-defined]
    time = figure.text(0.01, 0.03, f"{strip.films[0][k].time:.3f} s", fontsize=9, color=INK)
    time.draw(renderer)
    time.remove()
    for axes, view, motion in panels:
        before = set(axes.get_children())
        pen = Pen(axes, strip.films[motion][k], view, np.zeros(3), strip.grounded)
        draw_moment(pen, strip.coms[motion][: k + 1])
        added = [artist for artist in axes.get_children() if artist not in before]
        for artist in sorted(added, key=lambda artist: artist.get_zorder()):
            axes.draw_artist(artist)
            artist.remove()
