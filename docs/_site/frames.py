"""Pages that move inside of pages of the site, and pictures of animals on the gallery's cards."""

import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from docutils import nodes
from matplotlib.transforms import Bbox
from sphinx import addnodes

import serpentail as st

FRONT = Path("_static") / "rat.html"  # the motion of the first page
CARDS = "images/cards"  # in the gallery


def add_front(app) -> None:
    """Write the motion that the first page plays."""
    leap = st.scenario("kick_and_land")
    path = Path(app.outdir) / FRONT
    path.parent.mkdir(parents=True, exist_ok=True)
    st.view(leap.simulate(), path, names=["a jump made for its landing"])


def draw_card(block, block_vars: dict[str, Any], gallery_conf: dict[str, Any]) -> str:
    """Draw three moments of an example's last motion, beside the figures of its page."""
    del block, gallery_conf
    motions = list(motions_in(block_vars["example_globals"].values()))
    script = Path(block_vars["target_file"])
    if motions:
        path = script.parent / CARDS / f"{script.stem}.png"
        path.parent.mkdir(parents=True, exist_ok=True)
        figure, axes = st.filmstrip(motions[-1], frames=3, views=["oblique"])
        moments = Bbox.union([each.get_window_extent() for each in axes.flat])
        inches = moments.transformed(figure.dpi_scale_trans.inverted())
        figure.savefig(path, bbox_inches=inches, dpi=200)
    return ""


def motions_in(values) -> Iterator[st.Trajectory]:
    """Yield the motions among the variables of a script."""
    for value in values:
        if isinstance(value, st.Trajectory):
            yield value
        elif isinstance(value, st.Plan):
            yield value.trajectory
        elif isinstance(value, dict):
            yield from motions_in(value.values())


def hang_cards(app) -> None:
    """Show the animals on the cards, in place of the figures."""
    gallery = Path(app.srcdir) / "gallery"
    for card in (gallery / CARDS).glob("*.png"):
        shutil.copy(card, gallery / "images" / "thumb" / f"sphx_glr_{card.stem}_thumb.png")


def arrange(app, doctree: nodes.document) -> None:
    """In an example the moving page stands above the code; a name begins with its sentence."""
    page = app.env.docname
    if page.startswith("gallery/plot_"):
        story = next(doctree.findall(nodes.section)).next_node(nodes.paragraph)
        for frame in [raw for raw in doctree.findall(nodes.raw) if "<iframe" in raw.astext()]:
            frame.parent.remove(frame)
            story.parent.insert(story.parent.index(story) + 1, frame)
    elif page.startswith("api/"):
        described = next(doctree.findall(addnodes.desc))
        sentence = described[-1].next_node(nodes.paragraph)
        sentence.parent.remove(sentence)
        described.parent.insert(described.parent.index(described), sentence)
