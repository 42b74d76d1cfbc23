"""Factoring 1 - w J for implicit integrators.

J is the Jacobian of the rates of (q in its tangent space, v, bristles). It contains only contact,
joint damping, the passive tail and tracking gains. With k_q = r_q + w k_v and the bristles
eliminated, S (k_v - r_v) = forces is left, where S = H + stiffness. S is symmetric and positive
definite, except for points that slide: their friction follows the load, and S takes two triangles.
The first three pivots of S eliminate translation.
"""

from dataclasses import dataclass

from serpentail_scene.layout import TORSO_NV

from ...ir.program import Array, Index, Ref, padded
from ...ir.step import Step
from ...mechanics import contact, loads, passive
from ...mechanics import contact_stiffness as stiffness
from ...mechanics.lower import derive
from ..contact import Points, gather_points, touching
from ..draft import Draft
from ..dynamics import fill_mass_matrix
from ..passive import SLOPES, passive_parameters
from ..scope import State, Torso, Vectors
from ..sweeps.chains import each_chain
from ..sweeps.pieces import each_segment, points_of
from ..tails.mechanism import Segments
from .layout import Factors, Place, each_contact


def assemble_factor(draft: Draft, arrays: dict[str, Array]) -> None:
    """S = H + tail damping, stiffness and gains + J^T G J of the points in the ground, and its
    LDL^T.
    """
    f, nv = Factors(arrays["factors"], draft.tail), draft.tail.nv
    weight = {"weight": arrays["weight"].part(0, 1)}
    state = draft.state(arrays["q"], arrays["v"])
    segments, R = fill_mass_matrix(draft, state, f.array, padded(nv))

    # what fills up the rows of S
    room = padded(nv) - nv
    with draft.loop("k", nv if room else 0) as k:
        draft.fill(f.entry("S", k, nv, room), 0)
    draft.copy(f("weight"), weight["weight"])

    # joints
    add_gains(draft, f, weight | {"gains": arrays["gains"][0]})
    for chain in each_chain(draft):
        with draft.loop("k", chain.nt) as own:
            k = own + chain.coordinates_before
            damping = {"damping": arrays["damping"].part(k, 1)}
            draft.step(stiffness.damped, weight, damping, damped=f("damped", k))
            add_passive_stiffness(draft, f, state, (k, own))
            draft.copy(f.tail_entry(k, k), f("damped", k), adds=True)

    # the ground
    if draft.tail.contacts:
        add_contacts(draft, f, state, R, segments, arrays)
        add_sliding(draft, f, R)
        draft.factor(f.array, nv, pair=True)
    else:
        draft.factor(f.array, nv)


def add_passive_stiffness(
    draft: Draft, f: Factors, state: State, numbers: tuple[Index, Index]
) -> None:
    """Add springs, damping and stops of a coordinate, except those that tracking cancels;
    ``numbers``: its number among all, and in its chain.
    """
    k, of_chain = numbers
    weights = {"weight": f("weight"), "gain_v": f("gain_v")}

    def own(array: Array) -> Ref:
        return array.part(of_chain, 1)

    if "damping" in draft.tail.passive:
        parameters = passive_parameters(draft, passive.damped_coordinate, own)
        draft.step(passive.damped_coordinate, weights, parameters, damped_=f("damped", k))
    if "stop damping" in draft.tail.passive:
        parameters = passive_parameters(draft, passive.damped_in_stops, own)
        angle = {"angle": state.q.part(draft.tail.torso_nq + k, 1)}
        draft.step(passive.damped_in_stops, weights, angle, parameters, damped_=f("damped", k))
    if draft.tail.elastic:
        slope = draft.vector("slope", 1)
        draft.fill(slope, 0)
        for step in (SLOPES[name] for name in draft.tail.passive if name in SLOPES):
            reads = Vectors({"angle": state.q.part(draft.tail.torso_nq + k, 1)})
            draft.step(step, reads, passive_parameters(draft, step, own), slope_=slope)
        writes = {"damped_": f("damped", k), "sprung": f("sprung", k)}
        draft.step(passive.sprung_coordinate, weights, {"slope": slope}, **writes)
    elif f.tail.elastic:
        draft.fill(f("sprung", k), 0)


def add_gains(draft: Draft, f: Factors, weights: dict[str, Ref]) -> None:
    """Add tracking gains, which act through H_tt; solving needs H_tt, too."""
    gains = {name: f(name) for name in ("gain_q", "gain_v")}
    draft.step(stiffness.gain_weights, weights, **gains)
    draft.fill(f.array.part(f.first("H_tail"), draft.tail.nt**2), 0)
    with (
        draft.when(f("gain_v")),
        draft.loop("k", draft.tail.nt) as k,
        draft.loop("l", k + 1) as other,
    ):
        entry = f.tail_entry(k, other)
        draft.copy(f.entry("H_tail", k, other), entry)
        draft.copy(f.entry("H_tail", other, k), entry)
        reads = {"gain": f("gain_v"), "entry": f.entry("H_tail", k, other)}
        draft.step(stiffness.gained, reads, S_entry_=entry)


# ---- points in the ground ------------------------------------------------------------------------


@dataclass(frozen=True)
class ContactLinearisation:
    """What the linearisation of a point reads: the torso, weights and bristles, and the contact
    law.
    """

    torso: Torso
    weights: Vectors
    bristles: Array
    law: Step
    points: Points


def add_contacts(
    draft: Draft,
    f: Factors,
    state: State,
    R: Ref,
    segments: list[Segments],
    arrays: dict[str, Array],
) -> None:
    """Add the points in the ground, linearised; a point outside costs one comparison."""
    draft.copy(f("R"), R)
    weight = {"weight": arrays["weight"].part(0, 1), "bound_share": arrays["weight"].part(1, 1)}
    draft.step(stiffness.relaxation, Vectors(weight), relax=f("relax"))
    drag = draft.store(contact.bristle_properties, drag=1)
    points = gather_points(draft, state, R, arrays, segments)
    law = derive(stiffness.linearised_contact, friction=draft.tail.friction)
    weights = Vectors({**weight, **drag})
    ground = ContactLinearisation(state.torso(R), weights, arrays["bristles"], law, points)
    moving = [chain.group for chain in draft.tail.chains if not chain.prescribed]
    for group in [name for name in draft.tail.contacts if name not in moving]:
        with draft.loop("k", draft.tail.groups[group]) as k:
            number = k + points.first[group]
            keep_point(draft, f, ground, number)
            with draft.when(f("depth", number)):
                stiffen(draft, f, ground, number)
    for chain in touching(draft):
        if not chain.prescribed:
            add_chain_contacts(draft, f, ground)


def keep_point(draft: Draft, f: Factors, ground: ContactLinearisation, number: Index) -> None:
    """Store arm and depth of a point, and zero stiffness."""
    arm = ground.points.arms[number]
    draft.copy(f("arm", number), arm)
    draft.step(stiffness.depth_of_point, ground.torso, {"arm": arm}, depth=f("depth", number))
    draft.fill(f("spring", number), 0)


def stiffen(draft: Draft, f: Factors, ground: ContactLinearisation, number: Index) -> None:
    """Linearise a point in the ground, and add its stiffness to the torso's block of S."""
    motion, spring = ground.points.motion(number), {"spring": f("spring", number)}
    bristle = {"bristle": ground.bristles.part(2 * number, 2)}
    draft.step(ground.law, ground.torso, ground.weights, motion, bristle, **spring)
    rows = {f"S_{r}_": f.entry("S", r, 0, r + 1) for r in range(TORSO_NV)}
    draft.step(stiffness.stiffened_torso, ground.torso, motion, spring, **rows)


def add_chain_contacts(draft: Draft, f: Factors, ground: ContactLinearisation) -> None:
    """Add points of a chain like those of the torso, with their columns of its coordinates."""
    chain, columns = draft.tail, ground.points.columns[draft.tail.group]
    S, force = (
        draft.array("S_segment", 6 * chain.width, chain.segments),
        draft.vector("force_column", 3),
    )
    jacobian = draft.of_segment(loads.point_jacobian_tail)
    for stretch, i in each_segment(draft):
        draft.fill(S[i], 0)
        with points_of(draft, stretch, i) as g:
            number, place = g + ground.points.first[chain.group], Place(chain, i, g)
            draft.copy(S[i], columns[g], adds=True)
            keep_point(draft, f, ground, number)
            draft.fill(f(f"J_{chain.group}", g), 0)
            with draft.when(f("depth", number)):
                stiffen(draft, f, ground, number)
                arm = {"arm": f("arm", number)}
                with draft.loop("l", i + 1) as segment:
                    rows = {f"J_{axis}": f.row(place, k, segment) for k, axis in enumerate("xyz")}
                    draft.step(jacobian, {"S": S[segment]}, arm, **rows)
                spring = {"R": ground.torso.R, "spring": f("spring", number)} | arm
                stiffen_chain(draft, f, place, spring, force)


def stiffen_chain(
    draft: Draft, f: Factors, place: Place, spring: dict[str, Ref], force: Ref
) -> None:
    """Add the stiffness of a chain's point to the chain's rows in S."""
    before = place.chain.coordinates_before
    with draft.loop("k", place.coordinates) as k:
        reads = spring | {"J_k": f.column(place, k)}
        row = f.entry("S", TORSO_NV + before + k, 0, TORSO_NV)
        draft.step(stiffness.stiffened_column, reads, force=force, S_row_=row)
        with draft.loop("l", k + 1) as other:
            reads = {"J_k": f.column(place, other), "force": force}
            entry = f.tail_entry(k + before, other + before)
            draft.step(stiffness.coupled_columns, reads, S_entry_=entry)


# ---- points that slide ---------------------------------------------------------------------------


@dataclass(frozen=True)
class Shear:
    """Columns of a point whose friction follows the load: along its friction, and upward."""

    push: Array
    lift: Array

    def entries(self, first: Index | int, size: int) -> dict[str, Ref]:
        """Entries of both."""
        return {"push": self.push.part(first, size), "lift": self.lift.part(first, size)}


def add_sliding(draft: Draft, f: Factors, R: Ref) -> None:
    """Compute the transpose of S, and the terms by which the two differ: points that slide, whose
    friction follows the load.
    """
    nv, row = draft.tail.nv, padded(draft.tail.nv)
    draft.copy(f.array.part(f.first("S_turned"), nv * row), f.array.part(f.first("S"), nv * row))
    slip = draft.vector("slip", 1)
    shear = Shear(draft.array("push", nv), draft.array("lift", nv))

    def respond(number: Index, place: Place | None) -> None:
        spring = {"spring": f("spring", number)}
        with draft.when(f("depth", number)):
            draft.step(stiffness.sliding, spring, slip=slip)
            with draft.when(slip):
                at = {"R": R, "arm": f("arm", number)}
                draft.step(stiffness.sheared_torso, at, spring, **shear.entries(0, TORSO_NV))
                count: Index | int = TORSO_NV
                if place is not None:
                    shear_chain(draft, f, place, spring, shear)
                    count = place.coordinates + (TORSO_NV + place.chain.coordinates_before)
                shear_triangles(draft, f, count, shear)

    each_contact(draft, respond)


def shear_chain(
    draft: Draft, f: Factors, place: Place, spring: dict[str, Ref], shear: Shear
) -> None:
    """Compute the chain's part of both columns of its point; those of chains before are zero."""
    before = place.chain.coordinates_before
    for zeros in shear.entries(TORSO_NV, before).values() if before else ():
        draft.copy(zeros, draft.zero(before))
    with draft.loop("k", place.coordinates) as k:
        reads = spring | {"J_k": f.column(place, k)}
        draft.step(stiffness.sheared_column, reads, **shear.entries(TORSO_NV + before + k, 1))


def shear_triangles(draft: Draft, f: Factors, count: Index | int, shear: Shear) -> None:
    """Add the product of both columns to S, and to its transpose."""
    push, lift = shear.push, shear.lift
    with draft.loop("k", count) as k, draft.loop("l", k + 1) as other:
        reads = {"push_k": push.part(k, 1), "push_l": push.part(other, 1)}
        reads |= {"lift_k": lift.part(k, 1), "lift_l": lift.part(other, 1)}
        writes = {"entry_": f.entry("S", k, other), "turned_": f.entry("S_turned", k, other)}
        draft.step(stiffness.sheared_entries, reads, **writes)
