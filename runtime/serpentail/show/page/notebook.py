"""What a notebook shows of motions: their text, and below it their page in a frame."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from html import escape

from ...motion.trajectory import Trajectory
from .view import page_text

MOST_SHOWN = 601  # samples of a run, such as 0.6 s at 1 kHz: notebooks stay small
HEIGHT = 620  # px, of the frame


@dataclass(frozen=True)
class Page:
    """The page of motions as a text, which a notebook shows in a frame."""

    html: str = field(repr=False)

    def _repr_html_(self) -> str:
        """For notebooks: the frame."""
        return framed_page(self.html)


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
        page = page_text(shown, names and names[: len(shown)], most=MOST_SHOWN)
    except Exception as reason:  # whatever it is, the text above must be seen
        return f"{text}<p>Without the page of the run: {escape(str(reason))}</p>"
    return text + framed_page(page)


def framed_page(page: str) -> str:
    """Return a frame that shows a page, and lets it run its own scripts and nothing else."""
    source = page.replace("&", "&amp;").replace('"', "&quot;")
    return (
        f'<iframe sandbox="allow-scripts" title="page of the run" width="100%" '
        f'height="{HEIGHT}" style="border:0" srcdoc="{source}"></iframe>'
    )
