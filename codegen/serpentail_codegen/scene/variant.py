"""How a model differs from the usual one: a free torso with gravity and a tail of equal links."""

from dataclasses import dataclass
from itertools import groupby


@dataclass(frozen=True)
class Shape:
    """How segments and links differ, and whether torso and gravity are there.

    counts: links, or samples, of each segment if they are not equally many.
    kinds: of each segment, in a mixed tail; it has counts, too.
    links, arcs: how many have a mass, a length and an inertia of their own; 0: all are equal.
    ratios: joints of links, if they turn by unequal shares of their segment's angles.
    rotors: hinges of a limb, if some of them have a rotor.
    given: the angles of a limb are prescribed, so that its bodies need no mass.
    tilted: the tail begins in axes of its own, not in those of the torso.
    fixed: the torso never moves.
    weightless: there is no gravity.
    sloped: gravity has a direction of its own.
    tendons: up to which segment each one goes, counted from 1.
    guided: the guides of tendons differ from link to link.
    """

    counts: tuple[int, ...] = ()
    kinds: tuple[str, ...] = ()
    links: int = 0
    arcs: int = 0
    ratios: int = 0
    rotors: int = 0
    given: bool = False
    tilted: bool = False
    fixed: bool = False
    weightless: bool = False
    sloped: bool = False
    tendons: tuple[int, ...] = ()
    guided: bool = False

    @property
    def own(self) -> bool:
        """Tell if links or arcs have values of their own."""
        return bool(self.links or self.arcs)

    def numbers_of(self, tail: str) -> int:
        """Return how many times these tails have a parameter, by ``Parameter.tail``; 0: not
        at all.
        """
        present = {"equal": not self.own, "link": self.links, "arc": self.arcs}
        present |= {"": 1, "tilted": self.tilted, "geared": self.rotors, "ratio": self.ratios}
        present |= {"tendon": len(self.tendons), "guided": len(self.tendons) * self.guided}
        weight = not (self.weightless or self.sloped)
        present |= {"free": not self.fixed, "weight": weight, "sloped": self.sloped}
        return int(present[tail])


EQUAL = Shape()


@dataclass(frozen=True)
class Stretch:
    """Segments ``first`` to ``stop`` - 1, which all have equally many pieces and points.

    first_piece, first_point: how many pieces and points all segments before have; others: pieces of
    the other kind before.
    """

    kind: str
    first: int
    stop: int
    pieces: int
    points: int
    first_piece: int = 0
    first_point: int = 0
    others: int = 0

    def pieces_before(self, segment: int) -> int:
        """Return the number of pieces before a segment of this stretch, or before its end."""
        return self.first_piece + self.pieces * (segment - self.first)

    def points_before(self, segment: int) -> int:
        """Return the number of points before a segment of this stretch, or before its end."""
        return self.first_point + self.points * (segment - self.first)


def stretches_of(segments: int, links: int, kind: str, shape: Shape) -> tuple[Stretch, ...]:
    """Return the stretches of a tail: only one if all segments have equally many links or
    samples.
    """
    kinds, counts = shape.kinds or (kind,) * segments, shape.counts or (links,) * segments
    stretches: list[Stretch] = []
    for (its_kind, points), members in groupby(zip(kinds, counts, strict=True)):
        first = stretches[-1].stop if stretches else 0
        pieces = points if its_kind == "articulated" else 1
        before = (
            (stretches[-1].pieces_before(first), stretches[-1].points_before(first))
            if stretches
            else (0, 0)
        )
        others = sum(s.pieces * (s.stop - s.first) for s in stretches if s.kind != its_kind)
        stop = first + len(list(members))
        stretches.append(Stretch(its_kind, first, stop, pieces, points, *before, others))
    return tuple(stretches)


@dataclass(frozen=True)
class SegmentRun:
    """Segments ``first`` to ``stop`` - 1 of one kind, and their pieces.

    other_pieces, other_points, other_segments: numbers of the other kind before them.
    """

    first: int
    stop: int
    first_piece: int
    stop_piece: int
    other_pieces: int = 0
    other_points: int = 0
    other_segments: int = 0


def runs_of(stretches: tuple[Stretch, ...], kind: str) -> tuple[SegmentRun, ...]:
    """Return the runs of segments of a kind, each as long as possible."""
    runs, points, before = [], 0, 0
    for its_kind, members in groupby(stretches, lambda stretch: stretch.kind):
        stretches_of_run = list(members)
        first, last = stretches_of_run[0], stretches_of_run[-1]
        if its_kind == kind:
            pieces = first.first_piece, last.pieces_before(last.stop)
            runs.append(SegmentRun(first.first, last.stop, *pieces, first.others, points, before))
        else:
            points += last.points_before(last.stop) - first.first_point
            before += last.stop - first.first
    return tuple(runs)
