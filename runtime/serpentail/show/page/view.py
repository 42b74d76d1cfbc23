"""``view``: writes motions to a page that needs only a browser; notebooks show it in a frame."""

import json
import os
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from html import escape
from pathlib import Path
from typing import Any, overload

from ...basics.checks import real_array
from ...basics.errors import ViewError
from ...basics.files import replacing
from ...model.model import Model
from ...motion.plausibility import warnings_of
from ...motion.trajectory import Trajectory
from ..motions import Motions, checked_models, checked_motions, checked_names
from .data import labels, page_data
from .samples import packed, thinned_rows

MOST = 2400  # samples of a run in a page
MOST_NOTEBOOK = 601  # such as 0.6 s at 1 kHz: notebooks stay small
HEIGHT = 620  # px, of the frame in a notebook
PAGE = Path(__file__).with_name("page.html")  # made of the sources in viewer/ when this is built


@dataclass(frozen=True)
class Page:
    """The page of motions as a text, which a notebook shows in a frame."""

    html: str = field(repr=False)

    def _repr_html_(self) -> str:
        """For notebooks: a frame that lets the page run its own scripts and nothing else."""
        source = self.html.replace("&", "&amp;").replace('"', "&quot;")
        return (
            f'<iframe sandbox="allow-scripts" title="page of the run" width="100%" '
            f'height="{HEIGHT}" style="border:0" srcdoc="{source}"></iframe>'
        )


@overload
def view(
    motions: Motions,
    path: str | os.PathLike[str] = "run.html",
    *,
    names: Sequence[str] | None = None,
    model: Model | None = None,
    markers: Sequence[Any] | None = None,
    live: bool = False,
) -> Path:
    """Write a page that shows motions over each other; return its path."""


@overload
def view(
    motions: Motions,
    path: None,
    *,
    names: Sequence[str] | None = None,
    model: Model | None = None,
    markers: Sequence[Any] | None = None,
    live: bool = False,
) -> Page:
    """Return a page that shows motions over each other, for a notebook."""


def view(
    motions: Motions,
    path: str | os.PathLike[str] | None = "run.html",
    *,
    names: Sequence[str] | None = None,
    model: Model | None = None,
    markers: Sequence[Any] | None = None,
    live: bool = False,
) -> Path | Page:
    """Write a page that shows motions over each other in a browser.

    Parameters
    ----------
    motions : Trajectory, str, path, sequence or dict of these
        The motions or their .npz files; a dict has names as keys. More than 2400 samples are
        thinned, which the page says. The page's switch "Side by side" sets several motions apart.
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
    live : bool, default False
        Whether the page computes: with sliders of the start, parameters and gains it makes the
        first motion again, by the model's C compiled to WebAssembly. It must be a run of
        ``simulate`` in C, of a model whose real is double and whose parameters are not baked; of
        others the page says why it only replays them.

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
    ExtraMissing
        ``live`` without ziglang: ``pip install "serpentail[live]"``.

    Examples
    --------
    >>> st.view([planned, true], "compare.html", names=["planned", "true"])  # doctest: +SKIP
    """
    if path is None:
        return Page(page_text(motions, names, model, MOST_NOTEBOOK, markers, live))
    target = checked_path(path)
    text = page_text(motions, names, model, markers=markers, live=live)
    try:
        with replacing(target) as part:
            part.write_text(text, encoding="utf-8")
    except OSError as error:
        raise ViewError(f"path: value {str(path)!r}: cannot be written ({error})") from error
    return target


def page_text(
    motions: Motions,
    names: Sequence[str] | None = None,
    model: Model | None = None,
    most: int = MOST,
    markers: Sequence[Any] | None = None,
    live: bool = False,
) -> str:
    """Return the page of motions as text, with at most ``most`` samples of each; see ``view``."""
    motions, names = checked_motions(motions, names, model)
    names = checked_names(names, motions)
    models = checked_models(motions, model)
    page, data = template(), page_data(motions, names, models, most)
    if live:
        data |= _live(motions[0], models[0], data, most)
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


def _live(motion: Trajectory, model: Model, data: dict[str, Any], most: int) -> dict[str, Any]:
    """Return what a page needs to compute a motion again, or a note that says why it cannot."""
    from ..computing.again import computed_again

    found = computed_again(model, motion, most)
    if isinstance(found, str):
        return {"notes": [*data["notes"], f"this page only replays the run: {found}"]}
    return {"live": found | {"labels": labels(), "told": len(warnings_of(model, motion))}}


def packed_markers(motion: Trajectory, seen: Any, most: int) -> tuple[str, int]:
    """Return the seen markers at the samples of the page, as text, and their number."""
    places = real_array("markers", seen, ViewError)
    if places.ndim != 3 or places.shape[::2] != (len(motion.t), 3):
        raise ViewError(f"markers: shape {places.shape}: needs ({len(motion.t)}, M, 3)")
    return packed(places[thinned_rows(len(motion.t), most)[0]]), places.shape[1]


def checked_path(path: Any) -> Path:
    """Return the path of a page; ViewError if it is not the name of an .html file."""
    try:
        target = Path(path)
    except TypeError:
        raise ViewError(f"path: value {path!r:.60}: needs the name of an .html file") from None
    if target.suffix.lower() != ".html" or target.is_dir():
        raise ViewError(f"path: value {str(path)!r}: needs a file whose name ends in .html")
    return target


def in_notebook(
    thing: object,
    motions: Callable[[], Sequence[Trajectory]],
    names: Sequence[str] | None = None,
) -> str:
    """Return the HTML of an object: its text and the page of its motions; it never raises.

    The page is in a frame of its own, because notebooks do not run scripts of outputs. If there is
    no page (no model is known, it lacks ``tail_points``, or the page was not built), a line gives
    the reason.
    """
    text = f"<pre>{escape(repr(thing))}</pre>"
    try:
        shown = motions()
        page = Page(page_text(shown, names and names[: len(shown)], most=MOST_NOTEBOOK))
    except Exception as reason:  # whatever it is, the text above must be seen
        return f"{text}<p>Without the page of the run: {escape(str(reason))}</p>"
    return text + page._repr_html_()


def template() -> str:
    """Return the page without motions; ViewError if it was not built."""
    try:
        return PAGE.read_text(encoding="utf-8")
    except OSError:
        raise ViewError(
            "the page was not built, since node or npm's packages were missing: install Node.js 18 "
            "or newer and set serpentail up again, `make setup`"
        ) from None
