"""Tendons: their lengths, and how these change with the coordinates of one segment.

A link has one guide for each tendon, so that a free run crosses one joint: from the guide of the
link before, or of the torso, to that of the link behind. Along an arc a tendon is parallel to the
centre line. A tension T pulls with the torques -T dl/dq.
"""

from sympy import Matrix, sqrt

from .link import joint_turns
from .shapes import V1, V2, V3, V4


def piece_length(let, tail_length: V1, share: V1) -> dict:
    """Length of one of equal links or arcs."""
    return {"piece": tail_length * share[0]}


def first_guide(let, tendon_offsets: V2, tendon_roots: V1) -> dict:
    """Guide on the torso, from the tail's root, in the axes at the root."""
    return {"inner": Matrix([tendon_offsets[0], tendon_roots[0], tendon_offsets[1]])}


def next_guide(
    let, tendon_offsets: V2, tendon_ends: V2, tendon_guides: V1, along: V1, piece: V1
) -> dict:
    """Guide on a link, from its joint; ``along``: 0 at the first guide, 1 at the last."""
    x, z = tendon_offsets + along[0] * (tendon_ends - tendon_offsets)
    return {"outer": Matrix([x, -tendon_guides[0] * piece[0], z])}


def run_of_all(let, tendon_offsets: V2, tendon_guides: V1, piece: V1) -> dict:
    """Guides on both sides of a joint between links that are alike, from the joint."""
    x, z = tendon_offsets
    behind = tendon_guides[0] * piece[0]
    return {"inner": Matrix([x, piece[0] - behind, z]), "outer": Matrix([x, -behind, z])}


def next_run(let, outer: V3, piece: V1) -> dict:
    """Guide on a link, from the joint at its end: where the next run begins."""
    return {"inner": outer + Matrix([0, piece[0], 0])}


def free_run(let, joint: V4, inner: V3, outer: V3, times: V1) -> dict:
    """Length of a run across a joint, and its derivatives by alpha and beta, all so many times."""
    # r = inner - end, end = R_x R_z outer; it turns by e_x x end with alpha
    turn_x, turn_z = joint_turns(joint)
    turned = let("turned", turn_z * outer)
    end = let("end", turn_x * turned)
    r = let("r", inner - end)
    length = let("length", sqrt(r.dot(r)))
    factor = let("factor", times[0] / length)
    by_beta = turn_x * Matrix([-turned[1], turned[0], 0])
    slope = [factor * (r[1] * end[2] - r[2] * end[1]), -factor * r.dot(by_beta)]
    return {"length": [times[0] * length], "slope": Matrix(slope)}


def conduit(let, tendon_offsets: V2, piece: V1, angles: V2) -> dict:
    """L - b x + a z: length along an arc, and its derivatives by a and b."""
    x, z = tendon_offsets
    return {"length": [piece[0] - angles[1] * x + angles[0] * z], "slope": Matrix([z, -x])}


def pull(let, tension: V1, slope: V2) -> dict:
    """Torques of a tendon on a segment."""
    return {"tau": -tension[0] * slope}
