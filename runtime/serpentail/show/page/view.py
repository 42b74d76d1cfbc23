"""``view``: writes motions to a page that needs only a browser."""

import json
import os
import re
from collections.abc import Sequence
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any, overload

from ...basics.checks import real_array
from ...basics.errors import ViewError
from ...basics.files import replacing
from ...model.model import Model
from ...motion.trajectory import Trajectory
from .data import page_data
from .packing import packed
from .samples import thinned_rows

if TYPE_CHECKING:
    from .notebook import Page

MOST = 2400  # samples of a run in a page
PAGE = Path(__file__).with_name("page.html")  # made of the sources in viewer/ when this is built


@overload
def view(
    motions: Trajectory | Sequence[Trajectory],
    path: str | os.PathLike[str] = "run.html",
    *,
    names: Sequence[str] | None = None,
    model: Model | None = None,
    markers: Sequence[Any] | None = None,
) -> Path:
    """Write a page that shows motions over each other; return its path."""


@overload
def view(
    motions: Trajectory | Sequence[Trajectory],
    path: None,
    *,
    names: Sequence[str] | None = None,
    model: Model | None = None,
    markers: Sequence[Any] | None = None,
) -> "Page":
    """Return a page that shows motions over each other, for a notebook."""


def view(
    motions: Trajectory | Sequence[Trajectory],
    path: str | os.PathLike[str] | None = "run.html",
    *,
    names: Sequence[str] | None = None,
    model: Model | None = None,
    markers: Sequence[Any] | None = None,
) -> "Path | Page":
    """Write a page that shows motions over each other in a browser.

    Parameters
    ----------
    motions : Trajectory or sequence of Trajectory
        The motions. More than 2400 samples are thinned, which the page says.
    path : str, path or None, default "run.html"
        The .html file. It contains all that it needs, and loads nothing from elsewhere. It
        replaces an older file when it is complete. With None no file is written: the result is
        the page itself, which a notebook shows (at most 601 samples of each motion).
    names : sequence of str, optional
        Names of the motions.
    model : Model, optional
        The model of motions that were read from files.
    markers : sequence of array_like, shape (K, M, 3), optional
        For each motion, positions of seen markers at its samples (m, world), nan in gaps.

    Returns
    -------
    Path or page
        The path of the file, or the page for a notebook.

    Raises
    ------
    ViewError
        An argument is wrong, or the file cannot be written.
    ModelError
        The model lacks "tail_points".

    Examples
    --------
    >>> st.view([planned, true], "compare.html", names=["planned", "true"])  # doctest: +SKIP
    """
    if path is None:
        from .notebook import MOST_SHOWN, Page

        return Page(page_text(motions, names, model, MOST_SHOWN, markers))
    target = checked_path(path)
    text = page_text(motions, names, model, markers=markers)
    try:
        with replacing(target) as part:
            part.write_text(text, encoding="utf-8")
    except OSError as error:
        raise ViewError(f"path: value {str(path)!r}: cannot be written ({error})") from error
    return target


def page_text(
    motions: Trajectory | Sequence[Trajectory],
    names: Sequence[str] | None = None,
    model: Model | None = None,
    most: int = MOST,
    markers: Sequence[Any] | None = None,
) -> str:
    """Return the page of motions as text, with at most ``most`` samples of each; see ``view``."""
    motions = checked_motions(motions)
    names = checked_names(names, motions)
    models = [model_of(k, motion, model) for k, motion in enumerate(motions)]
    page, data = template(), page_data(motions, names, models, most)
    if markers is not None and len(markers) != len(motions):
        needs = f"needs one of each of {len(motions)} motions"
        raise ViewError(f"markers: {len(markers)} entries: {needs}")
    for run, motion, seen in zip(data["runs"], motions, markers or (), strict=False):
        run["arrays"]["markers"], run["markers"] = packed_markers(motion, seen, most)

    parts = {
        "<!--TITLE-->": escape(", ".join(dict.fromkeys(each.name for each in models))),
        "/*DATA*/": json.dumps(data, allow_nan=False).replace("<", "\\u003c"),
    }
    marks = re.compile("|".join(map(re.escape, parts)))
    return marks.sub(lambda mark: parts[mark[0]], page)


def packed_markers(motion: Trajectory, seen: Any, most: int) -> tuple[str, int]:
    """Return the seen markers at the samples of the page, as text, and their number."""
    places = real_array("markers", seen, ViewError)
    if places.ndim != 3 or places.shape[::2] != (len(motion.t), 3):
        raise ViewError(f"markers: shape {places.shape}: needs ({len(motion.t)}, M, 3)")
    return packed(places[thinned_rows(len(motion.t), most)[0]]), places.shape[1]


def checked_motions(motions: Any) -> list[Trajectory]:
    """Return the motions as a list; ViewError if it is empty or holds something else."""
    listed = list(motions) if isinstance(motions, list | tuple) else [motions]
    for k, motion in enumerate(listed):
        if not isinstance(motion, Trajectory):
            raise ViewError(f"motions[{k}]: type {type(motion).__name__}: needs a Trajectory")
    if not listed:
        raise ViewError("motions: none: needs one Trajectory or more")
    return listed


def checked_path(path: Any) -> Path:
    """Return the path of a page; ViewError if it is not the name of an .html file."""
    try:
        target = Path(path)
    except TypeError:
        raise ViewError(f"path: value {path!r:.60}: needs the name of an .html file") from None
    if target.suffix.lower() != ".html" or target.is_dir():
        raise ViewError(f"path: value {str(path)!r}: needs a file whose name ends in .html")
    return target


def checked_names(names: Any, motions: list[Trajectory]) -> list[str]:
    """Return a name for each motion; ViewError unless they are as many, and different."""
    if names is None:
        kinds = ["planned" if m.info.get("kind") == "plan" else "run" for m in motions]
        return [
            kind if kinds.count(kind) == 1 else f"{kind} {k + 1}" for k, kind in enumerate(kinds)
        ]
    listed = list(names) if isinstance(names, list | tuple) else []
    whole = all(isinstance(name, str) and name.strip() for name in listed)
    if not whole or len(listed) != len(motions) or len(set(listed)) != len(listed):
        raise ViewError(f"names: value {names!r:.200}: needs {len(motions)} names that differ")
    return listed


def model_of(k: int, motion: Trajectory, model: Any) -> Model:
    """Return the model of motion k; ViewError if none fits."""
    found = motion.model if motion.model is not None else model
    if found is None:
        raise ViewError(
            f"motions[{k}]: was loaded from a file, which has no model: give model=st.load(folder)"
        )
    if found is model and not isinstance(model, Model):
        raise ViewError(f"model: type {type(model).__name__}: needs a Model, as st.load returns")
    if motion.q.shape[1] != found.nq:
        raise ViewError(
            f"motions[{k}]: q has {motion.q.shape[1]} numbers, {found.name} has {found.nq}: give "
            "its own model"
        )
    return found


def template() -> str:
    """Return the page without motions; ViewError if it was not built."""
    try:
        return PAGE.read_text(encoding="utf-8")
    except OSError:
        raise ViewError(
            "the page was not built, since node or npm's packages were missing: install Node.js 18 "
            "or newer and set serpentail up again, `make setup`"
        ) from None
