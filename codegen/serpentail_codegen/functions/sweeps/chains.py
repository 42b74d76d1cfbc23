"""The chains of a tree one after another, and the steps where they meet the torso.

Each sweep runs over every chain: the draft stands on one chain at a time, so that the sweeps of a
tail serve all. What a chain besides the tail has at its mount is added to the torso's.
"""

from collections.abc import Callable, Iterable, Iterator
from typing import TypeVar

from ...ir.program import Ref
from ...ir.step import Step, specialised
from ...mechanics import branch
from ..draft import Draft
from ..scope import Motion, State, Vectors
from ..tail import Tail
from ..tails.mechanism import Segments
from .pieces import mechanism

Item = TypeVar("Item")


def each_chain(draft: Draft) -> Iterator[Tail]:
    """Stand on each chain in turn; yields it."""
    for chain in draft.tail.chains:
        with draft.on(chain):
            yield chain


def on_each(draft: Draft, items: Iterable[Item]) -> Iterator[Item]:
    """Stand on each chain in turn; yields the item that belongs to it."""
    for _, item in zip(each_chain(draft), items, strict=True):
        yield item


def prepared(draft: Draft, state: State, doubled: bool = False) -> list[Segments]:
    """Store the data of the pieces of every chain; return the segments of each."""
    return [
        mechanism(draft).prepare(draft, state.on(chain), doubled) for chain in each_chain(draft)
    ]


def sided(draft: Draft, function: Callable[..., dict]) -> Step:
    """Return a step of `mechanics.branch` for the side of the chain that the draft stands on."""
    step, side = draft.of_segment(function), -1 if draft.tail.mirrored else 1
    name = step.name if side > 0 else f"mirrored_{step.name.removeprefix('mirrored_')}"
    return specialised(step, name, side=(side,))


def seen(draft: Draft, motion: Motion) -> Motion:
    """Return the torso's motion in the axes in which the chain is computed."""
    if not draft.tail.mirrored:
        return motion
    sizes = {"w": 3, "w_dot": 3, "a": 3}
    return Motion(**draft.store(sided(draft, branch.mirrored_motion), motion, **sizes).named)


def seen_virtually(draft: Draft, start: Vectors) -> Vectors:
    """Return the torso's motion and its virtual velocities in the axes in which the chain is
    computed.
    """
    if not draft.tail.mirrored:
        return start
    motion = seen(draft, Motion(start["w"], start["w_dot"], start["a"]))
    step, virtual = sided(draft, branch.mirrored_virtual), start.only("w_virtual", "u_virtual")
    turned = draft.store(step, virtual, w_virtual=3, u_virtual=3)
    return Vectors({**motion.vectors(), **turned})


def facing(draft: Draft, R: Ref) -> Ref:
    """Return the matrix that turns places from the axes in which the chain is computed to the
    world.
    """
    if not draft.tail.mirrored:
        return R
    return draft.store(sided(draft, branch.mirrored_attitude), {"R": R}, R=9)["R"]


def add(draft: Draft, function: Callable[..., dict], own: Vectors, sums: Vectors) -> None:
    """Add what a chain besides the tail has at its mount to the sums at the torso."""
    sided_step = sided(draft, function)
    draft.step(sided_step, own, **{f"{name}_": ref for name, ref in sums.named.items()})
