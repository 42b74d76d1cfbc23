"""A tail of both kinds, with the data of its links and of its arcs side by side.

Each stretch of segments uses the steps of its own kind. Frames, motions, wrenches and composites
pass from one stretch to the next as between two links, because both kinds hand them on at their
tips.
"""

from dataclasses import fields, replace
from typing import Any

from ..draft import Draft
from ..scope import State
from .articulated import ARTICULATED, fill_links, prepare_links
from .continuum import CONTINUUM, bending_torques, prepare_arc_samples, prepare_arcs
from .mechanism import Mechanism, Segments


def both(links: Segments, arcs: Segments) -> Segments:
    """Return the data of the links and those of the arcs; the latter win if both have a name."""
    return Segments(
        links.state,
        links.arrays | arcs.arrays,
        {**links.shared, **arcs.shared},
        {**links.each, **arcs.each},
    )


def prepare_both(draft: Draft, state: State, doubled: bool = False) -> Segments:
    """Link properties and trigonometry of joints; shape, tip and own inertia of arcs."""
    return both(prepare_links(draft, state, doubled), prepare_arcs(draft, state))


def prepare_both_samples(draft: Draft, state: State, segments: Segments | None) -> Segments:
    """Prepare links by the numbers of their points, and one n-th of each arc, whose frames replace
    those of whole arcs.
    """
    links = segments or prepare_links(draft, state)
    array = draft.array("link_point", 6, draft.tail.total)
    fill_links(draft, array, lambda run: run.other_points)
    found = both(links, prepare_arc_samples(draft, state, None))
    return replace(found, each={"link": array})


def of_no_segment(*_: Any, **__: Any) -> Any:
    """Refuse to be a step: only the stretches have steps."""
    raise ValueError("a mixed tail has steps within loops over its segments alone")


def with_both(kind: Mechanism) -> Mechanism:
    """Return the steps of segments of a kind, with the data of all segments."""
    return replace(
        kind,
        prepare=prepare_both,
        prepare_samples=prepare_both_samples,
        declare_torques=bending_torques,
    )


# outside of loops over segments only the data of all segments are there
NOTHING: dict[str, Any] = dict.fromkeys((f.name for f in fields(Mechanism)), of_no_segment)
MIXED = {
    "articulated": with_both(ARTICULATED),
    "continuum": with_both(CONTINUUM),
    "": with_both(Mechanism(**NOTHING)),
}
