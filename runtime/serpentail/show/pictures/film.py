"""``film``: writes motions as a moving film, a filmstrip or a page, by the file's suffix."""

import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ...basics.checks import number
from ...basics.errors import ViewError
from ...basics.extras import needed
from ...model.model import Model
from ...motion.trajectory import Trajectory
from ..page.view import checked_motions, template, view
from .encode import RATE, encoder, write_gif, write_mp4
from .filmstrip import VIEWS, filmstrip, strip_of
from .movie import pictures
from .style import METADATA, Array
from .views import views_of

MOVING = {".gif": write_gif, ".mp4": write_mp4}
MOST = 10_000  # frames
LASTS = 4.0  # s, of a film without given speed: slow motion, never faster than real time


def film(
    motions: Trajectory | Sequence[Trajectory],
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
    motions : Trajectory or sequence of Trajectory
        The motions.
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
        return view(motions, target, names=names, model=model)
    if kind in METADATA:
        filmstrip(motions, target, views=views, names=names, model=model)
        return target
    every = checked_motions(motions)
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
