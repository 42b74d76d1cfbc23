"""``film``: writes motions as a moving film, a filmstrip or a page, as the file's suffix says."""

import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ..checks import number
from ..errors import ViewError
from ..extras import needed
from ..model.model import Model
from ..motion.trajectory import Trajectory
from ..viewer.view import checked_motions, template, view
from .encode import RATE, encoder, write_gif, write_mp4
from .filmstrip import VIEWS, filmstrip, strip_of
from .movie import pictures
from .style import METADATA, Array
from .views import views_of

MOVING = {".gif": write_gif, ".mp4": write_mp4}
MOST = 10_000  # frames
LASTS = 4.0  # s, a film whose speed is not told: slow motion, never faster than life


def film(
    motions: Trajectory | Sequence[Trajectory],
    path: str | os.PathLike[str],
    *,
    speed: float | None = None,
    views: Sequence[str | tuple[float, float]] = VIEWS,
    names: Sequence[str] | None = None,
    model: Model | None = None,
) -> Path:
    """Write a motion, or several beside each other, to a file by its suffix; return its path.

    .mp4, .gif: a moving film of 25 frames a second; .png, .pdf, .svg: moments side by side, as
    ``st.filmstrip``; .html: the page of ``st.view``.  speed: of a moving film, over that of life;
    by default slow motion that lasts about 4 s, or life's speed where that lasts longer.  views,
    names, model: as ``st.filmstrip``; the page has its own views.  The file is written whole or not
    at all.  Raises ViewError with argument, value and remedy, ModelError where the model lacks
    ``tail_points``, ExtraMissing without the extra "plot".
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
        raise ViewError("motions: no time that all of them have: a moving film needs some")
    slowness = _slowness(speed, end - begin)
    times = _times(begin, end, RATE * slowness)
    moved = [motion.resample(times) for motion in every]
    strip = strip_of(moved, times, views_of(views), names, model)
    MOVING[kind](target, pictures(strip, slowness))
    return target


def film_path(path: str | os.PathLike[str]) -> Path:
    """Return the path of a film; ViewError where its suffix is unknown, or an encoder or the page
    that it needs is missing, ExtraMissing for a picture without the extra "plot".
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
    """How many times slower than life a film of so many seconds is."""
    if speed is None:
        return float(max(1, round(LASTS / lasts)))
    return 1 / number("speed", speed, ViewError, above=0)


def _times(begin: float, end: float, rate: float) -> Array:
    """The times of the frames, so many a second of life; ViewError where that is too many."""
    count = (end - begin) * rate + 1e-9
    if count >= MOST:
        raise ViewError(
            f"speed: {count:.3g} frames for {end - begin:.4g} s of motion: a film has at most "
            f"{MOST}; give a greater speed"
        )
    return np.minimum(begin + np.arange(int(count) + 1) / rate, end)
