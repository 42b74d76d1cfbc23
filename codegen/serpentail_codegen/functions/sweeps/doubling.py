"""Long segments by doubling: chains of equal links are joined, so that work grows with log n.

A lane of a vector is a segment and one of its coordinates. Lane i is segment i with tangents by
pitch; lane m + i is segment i again with tangents by yaw. The terms that velocities cause follow
from these derivatives.
"""

from ...autodiff.step import tangent
from ...ir.program import Index, Ref
from ...mechanics import link_chain
from ...mechanics.lower import derive
from ..draft import Draft
from ..scope import State, Vectors
from ..tail import Tail

CHAIN = {"E": 9, "P": 3, "S": 12, "h": 3, "I": 6, "pitch": 6, "yaw": 6, "H": 3}
BY = ("pitch", "yaw")


def is_doubled(tail: Tail) -> bool:
    """Tell if doubling is faster: joining takes as long as a few links, and longer for more
    segments.
    """
    joins = tail.links.bit_length() - 1 + tail.links.bit_count() - 1
    return tail.links >= (8 + tail.segments) * (2 + joins)


def joined_links(draft: Draft, state: State, link: Ref) -> Vectors:
    """Return the chains of all segments, their tangents as ``d_<vector>``."""
    lanes, links = len(BY) * draft.tail.segments, draft.tail.links
    angles, turning = (draft.wide(f"{name}_chain", 2, lanes)[0] for name in ("angles", "d_angles"))
    one = draft.fixed("one", [1])
    for vector in (angles, turning):
        draft.fill(vector, 0)
    with draft.loop("i", draft.tail.segments) as i:
        for c in range(len(BY)):
            lane = i + c * draft.tail.segments
            draft.copy(angles.array.down(0, lane, 2), state.angles(i))
            draft.copy(turning.array.lane(c, lane), one)

    # one link, and the step that joins two chains
    single, chain = _declared(draft, "link", lanes), _declared(draft, "chain", lanes)
    step = tangent(derive(link_chain.one_link), frozenset({"angles"}))
    draft.step(step, {"angles": angles, "d_angles": turning, "link": link}, **single.named)
    mass = draft.vector("mass_beyond", 1)

    def join(beyond: Vectors, count: int) -> None:
        draft.step(link_chain.mass_of_links, {"link": link}, links_of(draft, count), mass=mass)
        behind = {_beyond(name): ref for name, ref in beyond.named.items()}
        reads = {**chain.named, **behind, "mass_beyond": mass}
        draft.step(_joining(), reads, **chain.named)

    # the binary digits of n: twice as many links, and one more where the digit is 1
    for name, ref in chain.named.items():
        draft.copy(ref, single[name])
    count = 1
    for digit in f"{links:b}"[1:]:
        join(chain, count)
        count *= 2
        if digit == "1":
            join(single, 1)
            count += 1
    return chain


def _declared(draft: Draft, name: str, lanes: int) -> Vectors:
    """Declare a chain and its tangents."""
    sizes = CHAIN | {f"d_{vector}": size for vector, size in CHAIN.items()}
    return Vectors({v: draft.wide(f"{v}_{name}", n, lanes)[0] for v, n in sizes.items()})


def links_of(draft: Draft, count: int) -> dict[str, Ref]:
    """Return a number of links as a step reads it."""
    return {"count": draft.fixed(f"links_{count}", [count])}


def _beyond(name: str) -> str:
    """Return the name of a vector in the outer chain."""
    return f"{name}_beyond"


def _joining():
    """Return the step that joins two chains, with its tangents."""
    moving = {*CHAIN, *(_beyond(name) for name in CHAIN)}
    return tangent(derive(link_chain.joined), frozenset(moving))


def lanes_of_chain(chain: Vectors, i: Index, segments: int) -> dict[str, Ref]:
    """Return the chain of one segment, and its derivatives: ``S_pitch`` is that of S by pitch."""
    found = {name: chain[name].array.down(0, i, size) for name, size in CHAIN.items()}
    for c, by in enumerate(BY):
        for name in ("S", "I", *BY, "H"):
            tangents = chain[f"d_{name}"]
            found[f"{name}_{by}"] = tangents.array.down(0, i + c * segments, tangents.size)
    return found
