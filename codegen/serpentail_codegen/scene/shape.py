"""In what a model differs from most: a free torso with gravity, a tail of equal links."""

from dataclasses import dataclass
from itertools import groupby


@dataclass(frozen=True)
class Shape:
    """In what segments and links differ, and what does not move or pull.

    counts: links, or samples, of each segment where they are not as many in all.
    links, arcs: how many have a mass, a length and an inertia of their own; 0: all are equal.
    tilted: the tail begins in axes of its own, not in those of the torso.
    fixed: the torso never moves.
    weightless: nothing has weight.
    """

    counts: tuple[int, ...] = ()
    links: int = 0
    arcs: int = 0
    tilted: bool = False
    fixed: bool = False
    weightless: bool = False

    @property
    def own(self) -> bool:
        """Tell if links or arcs have values of their own."""
        return bool(self.links or self.arcs)

    def numbers_of(self, tail: str) -> int:
        """How often a parameter of these tails is there, by ``Parameter.tail``; 0: it is not."""
        present = {"equal": not self.own, "link": self.links, "arc": self.arcs}
        present |= {"": 1, "tilted": self.tilted}
        present |= {"free": not self.fixed, "weight": not self.weightless}
        return int(present[tail])


EQUAL = Shape()


@dataclass(frozen=True)
class Stretch:
    """Segments ``first`` to ``stop`` - 1, which have as many pieces and points each.

    first_piece, first_point: how many all segments before have.
    """

    kind: str
    first: int
    stop: int
    pieces: int
    points: int
    first_piece: int = 0
    first_point: int = 0

    def pieces_before(self, segment: int) -> int:
        """Pieces of all segments before one of this stretch, or before its end."""
        return self.first_piece + self.pieces * (segment - self.first)

    def points_before(self, segment: int) -> int:
        """Points of all segments before one of this stretch, or before its end."""
        return self.first_point + self.points * (segment - self.first)


def stretches_of(segments: int, links: int, kind: str, shape: Shape) -> tuple[Stretch, ...]:
    """Return the stretches of a tail: one, where all segments have as many links or samples."""
    counts = shape.counts or (links,) * segments
    stretches: list[Stretch] = []
    for points, members in groupby(counts):
        first = stretches[-1].stop if stretches else 0
        pieces = points if kind == "articulated" else 1
        before = (
            (stretches[-1].pieces_before(first), stretches[-1].points_before(first))
            if stretches
            else (0, 0)
        )
        stretches.append(Stretch(kind, first, first + len(list(members)), pieces, points, *before))
    return tuple(stretches)
