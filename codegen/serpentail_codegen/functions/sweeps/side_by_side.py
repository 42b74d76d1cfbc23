"""Segments side by side: those with the same steps are swept at once, each in a lane of its own."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace

from serpentail_scene.layout import PER_SEGMENT

from ...ir.program import Array, Index, Ref
from ...scene.variant import Shape, Stretch
from ..draft import Draft
from ..scope import State, Vectors
from ..tail import Tail
from ..tails.mechanism import Segments
from .bodies import lane
from .pieces import mechanism

ONE = Tail(1, 1, shape=Shape(fixed=True))  # whose q and v are the coordinates of one segment


@dataclass(frozen=True)
class SegmentGroup:
    """Segments of one kind with equally many pieces, in their order along the tail.

    segments: their data as those of a single segment, whose vectors are wide.
    """

    draft: Draft
    number: int
    stretches: tuple[Stretch, ...]
    segments: Segments

    @property
    def pieces(self) -> int:
        """Pieces of each segment."""
        return self.stretches[0].pieces

    @property
    def lanes(self) -> int:
        """Number of segments."""
        return sum(stretch.stop - stretch.first for stretch in self.stretches)

    @property
    def suffix(self) -> str:
        """What tells the names of this group's arrays from those of the first."""
        return f"_{self.number}" if self.number else ""

    @contextmanager
    def at_once(self) -> Iterator[None]:
        """Use the steps of these segments, and declare vectors with a lane for each of them."""
        self.draft.stretch = self.stretches[0]
        with self.draft.side_by_side(self.lanes, f"_lanes{self.suffix}"):
            yield
        self.draft.stretch = None

    def each(self) -> Iterator[tuple[Stretch, Index, Index]]:
        """Open loops over the segments; yields the stretch, the segment and its lane."""
        before = 0
        for stretch in self.stretches:
            with self.draft.loop("i", stretch.stop, start=stretch.first) as i:
                yield stretch, i, i + (before - stretch.first)
            before += stretch.stop - stretch.first

    def vectors(self, **values: tuple[int, ...]) -> Vectors:
        """Declare vectors that begin with the same values in all lanes."""
        found = self.draft.vectors(**{name: len(value) for name, value in values.items()})
        for name, value in values.items():
            self.draft.fill(found[name], *value)
        return found

    def mass(self) -> Vectors:
        """Declare a mass of zero: that of one segment, if all are equal."""
        if self.draft.tail.shape.own:
            return self.vectors(mass=(0,))
        mass = self.draft.array(f"mass{self.suffix}", 1)[0]
        self.draft.fill(mass, 0)
        return Vectors({"mass": mass})

    def part(self, name: str, of_all: Ref) -> Ref:
        """Return the lanes of these segments out of those of all segments."""
        if self.lanes == of_all.lanes:
            return of_all
        with self.at_once():
            own = self.vectors(**{f"{name}_here": (0,) * of_all.size})[f"{name}_here"]
            for _, i, at in self.each():
                self.draft.copy(lane(own, at), lane(of_all, i))
        return own


def groups_of(draft: Draft, state: State) -> list[SegmentGroup]:
    """Return all segments in groups, with the data of their pieces."""
    alike: dict[tuple[str, int], list[Stretch]] = {}
    for stretch in draft.tail.stretches:
        alike.setdefault((stretch.kind, stretch.pieces), []).append(stretch)
    properties: dict[str, Segments] = {}
    groups: list[SegmentGroup] = []
    for (kind, _), stretches in alike.items():
        draft.stretch = stretches[0]
        if kind not in properties:
            properties[kind] = mechanism(draft).properties(draft, state)
        group = SegmentGroup(draft, len(groups), tuple(stretches), properties[kind])
        groups.append(replace(group, segments=_prepared(group)))
    return groups


def joined(groups: Sequence[SegmentGroup], found: Sequence[Vectors]) -> Vectors:
    """Return what was found of each group as vectors with a lane for each segment of the tail."""
    if len(groups) == 1:
        return found[0]
    draft = groups[0].draft
    with draft.side_by_side(draft.tail.segments, "_of_all"):
        every = draft.vectors(**{name: ref.size for name, ref in found[0].named.items()})
    for group, own in zip(groups, found, strict=True):
        for _, i, at in group.each():
            for name, ref in own.named.items():
                draft.copy(lane(every[name], i), lane(ref, at))
    return every


def _prepared(group: SegmentGroup) -> Segments:
    """Return properties, coordinates and data of the pieces of a group, side by side."""
    draft, own = group.draft, group.segments
    with group.at_once():
        wide, each = dict(own.shared), {}
        for name, array in own.arrays.items():
            wide |= group.vectors(**{name: (0,) * array.size})
            for _, i, at in group.each():
                draft.copy(lane(wide[name], at), array[i])
        for name, array in own.each.items():
            each[name] = _of_pieces(group, name, array)
        moving = group.vectors(angles=(0,) * PER_SEGMENT, rates=(0,) * PER_SEGMENT)
        for _, i, at in group.each():
            draft.copy(lane(moving["angles"], at), own.state.angles(i))
            draft.copy(lane(moving["rates"], at), own.state.rates(i))
        wide |= draft.vectors(**mechanism(draft).data)
        mechanism(draft).describe(draft, Vectors({**wide, **moving}))
    return Segments(State(ONE, moving["angles"].array, moving["rates"].array), {}, wide, each)


def _of_pieces(group: SegmentGroup, name: str, array: Array) -> Array:
    """Return what each piece has of its own, side by side; array: of all pieces of the tail."""
    draft, n, size = group.draft, group.pieces, array.size
    own = f"{name}_lanes{group.suffix}"
    wide = draft.declare(replace(array, name=own, count=n, lanes=group.lanes))
    draft.fill(wide.whole(), 0)
    for stretch, i, at in group.each():
        with draft.loop("j", n) as j:
            g = n * i + j + (stretch.first_piece - n * stretch.first)
            draft.copy(wide.down(size * j, at, size), array[g])
    return wide
