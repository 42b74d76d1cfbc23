"""Functions of the points that can touch the ground: their positions, motion and forces."""

from collections.abc import Iterator
from dataclasses import dataclass, field

from ..ir.program import Array, Index, Ref
from ..mechanics import branch, contact, leg, loads
from ..mechanics.lower import derive
from .draft import Draft
from .dynamics import accelerate_by_segments, copied_torques
from .factored import factored_dynamics
from .passive import net_torques
from .scope import State, Torso, Vectors
from .sweeps.chains import each_chain, sided
from .sweeps.pieces import attitude, each_point, mechanism, torso_pose
from .tail import Tail
from .tails.mechanism import Segments


@dataclass(frozen=True)
class Points:
    """Arms and velocities of all points, the first point of each group, columns of the joints of
    chains (one for each point) by group, and the drift rates of the feet's points in the torso.
    """

    arms: Array
    velocities: Array
    first: dict[str, int]
    columns: dict[str, Array] = field(default_factory=dict)
    drifts: Array | None = None

    def motion(self, k: Index | int) -> Vectors:
        """Arm and velocity of point k."""
        return Vectors({"arm": self.arms[k], "velocity": self.velocities[k]})

    @property
    def foot_drifts(self) -> Array:
        """Drifts of the feet's points, torso axes."""
        if self.drifts is None:
            raise ValueError("no feet touch the ground")
        return self.drifts


def first_points(tail: Tail) -> dict[str, int]:
    """Number of the first point of each group."""
    first, numbers = 0, {}
    for name, count in tail.groups.items():
        numbers[name] = first
        first += count
    return numbers


def touching(draft: Draft) -> Iterator[Tail]:
    """Stand on each chain in turn that can touch the ground; yields it."""
    contacts = draft.tail.contacts
    return (chain for chain in each_chain(draft) if chain.group in contacts)


def gather_points(
    draft: Draft,
    state: State,
    R: Ref,
    arrays: dict[str, Array],
    segments: list[Segments] | None = None,
) -> Points:
    """Compute all points that can touch the ground: feet, then chains, then the lowest of the
    torso.

    ``segments`` describes the pieces of each chain, if another function has prepared them before.
    """
    tail, torso = draft.tail, state.torso(R)
    S = {c.group: draft.array("S_point", 6 * c.width, c.total) for c in touching(draft)}
    arms, velocities = draft.array("arm", 3, tail.points), draft.array("velocity", 3, tail.points)
    drifts = draft.array("foot_rate", 3, 6) if "feet" in tail.contacts else None
    points = Points(arms, velocities, first_points(tail), S, drifts)
    if "feet" in tail.contacts:
        place_feet(draft, torso, points, arrays["legs"])
    for chain in touching(draft):
        own = segments[tail.chains.index(chain)] if segments else None
        samples = mechanism(draft).prepare_samples(draft, state.on(chain), own)
        place_chain(draft, torso, samples, points)
    if "torso" in tail.contacts:
        place = draft.store(contact.lowest_point, torso, place=3)
        drift, motion = {"drift": draft.zero(3)}, points.motion(points.first["torso"])
        draft.step(contact.point_on_torso, torso, place, drift, **motion)
    return points


def place_feet(draft: Draft, torso: Torso, points: Points, angles: Array) -> None:
    """A, M and T of the right foot, then of the left (Eqs. 5 to 9)."""
    sides = draft.constant("sides", [1, -1])
    foot, rate = draft.array("foot", 3, 3), points.foot_drifts
    with draft.loop("l", 2) as side:
        reads = {
            "side": sides.part(side, 1),
            "leg": angles.part(2 * side, 2),
            "leg_rates": angles.part(4 + 2 * side, 2),
        }
        writes = {"foot": foot.part(0, 9), "foot_rate": rate.part(9 * side, 9)}
        draft.step(leg.foot_points, reads, **writes)
        with draft.loop("k", 3) as k:
            place = {"place": foot[k], "drift": rate[3 * side + k]}
            motion = points.motion(3 * side + k + points.first["feet"])
            draft.step(contact.point_on_torso, torso, place, **motion)


def place_chain(draft: Draft, torso: Torso, samples: Segments, points: Points) -> None:
    """Compute a chain's points but the first, which is the mount: a point of the torso, inside it.

    A mirrored chain is followed in the mirror image of the world.
    """
    # fixed samples of an arc, because its lowest point (Eqs. 38, 39) jumps from end to end
    chain, R = draft.tail, torso.R
    S, first = points.columns[chain.group], points.first[chain.group]
    if chain.mirrored:
        R = draft.store(sided(draft, branch.mirrored_torso), {"R": R}, R=9)["R"]
    pose = torso_pose(draft, R, name="point")
    place = draft.vectors(P=3) if chain.mirrored else pose.vectors()
    twist = draft.store(contact.torso_twist, torso, turn=3, slide=3)
    added = {f"{name}_": ref for name, ref in twist.named.items()}
    for i, g in each_point(draft):
        draft.step(mechanism(draft).twist, pose, samples.at(i, g), S=S[g])
        draft.step(mechanism(draft).pose, pose, samples.at(i, g), **pose)
        if chain.mirrored:
            seen = {"S": S[g], "P": pose.P}
            draft.step(sided(draft, branch.mirrored_point), seen, S=S[g], P=place["P"])
        carried = draft.of_segment(contact.carried_twist)
        draft.step(carried, {"S": S[g]}, samples.motion(i), **added)
        draft.step(contact.point_on_tail, {"P": place["P"]}, twist, **points.motion(g + first))


def assemble_contact_points(draft: Draft, arrays: dict[str, Array]) -> None:
    """Places and velocities of all points."""
    state = draft.state(arrays["q"], arrays["v"])
    R = attitude(draft, state)
    points = gather_points(draft, state, R, arrays)
    with draft.loop("k", draft.tail.points) as k:
        position = arrays["positions"].part(3 * k, 3)
        draft.step(contact.position, state.torso(R), points.motion(k), position=position)
        draft.copy(arrays["velocities"].part(3 * k, 3), points.velocities[k])


def assemble_leg_points(draft: Draft, arrays: dict[str, Array]) -> None:
    """Hip, D, knee, A, M and T of the right leg, then of the left, in the world (Eqs. 5 to 9)."""
    state, angles = draft.state(arrays["q"]), arrays["angles"]
    R = attitude(draft, state)
    sides, joints = draft.constant("sides", [1, -1]), draft.array("joints_of_leg", 3, 6)
    with draft.loop("l", 2) as side:
        reads = {"side": sides.part(side, 1), "leg": angles.part(2 * side, 2)}
        draft.step(leg.leg_joints, reads, joints=joints.part(0, 18))
        with draft.loop("k", 6) as k:
            position = arrays["joints"].part(18 * side + 3 * k, 3)
            draft.step(contact.point_on_torso, {"R": R, "place": joints[k]}, arm=position)
            reads = {"p": state.position, "arm": position}
            draft.step(contact.position, reads, position=position)


def press(draft: Draft, torso: Torso, points: Points, arrays: dict[str, Array]) -> None:
    """Forces and bristle rates of all points, on given ``branches`` if they are arguments."""
    properties = draft.store(contact.bristle_properties, drag=1, mobility=1)
    sided = "branches" in arrays
    law = derive(contact.contact_force, friction=draft.tail.friction, sided=sided)
    with draft.loop("k", draft.tail.points) as k:
        bristle = {"bristle": arrays["bristles"].part(2 * k, 2)}
        writes = {
            "force": arrays["forces"].part(3 * k, 3),
            "rate": arrays["bristle_rates"].part(2 * k, 2),
        }
        if sided:
            bristle["side"] = arrays["branches"].part(2 * k, 2)
        draft.step(law, torso, properties, points.motion(k), bristle, **writes)


def gather_contact_loads(
    draft: Draft, R: Ref, points: Points, forces: Array, torques: Array, given: Array | None = None
) -> Vectors:
    """J^T f (Eq. 10): returns ``load_force, load_moment`` at B in torso axes; the joints' part is
    added to ``torques``, that of prescribed ones to ``given``.
    """
    load = draft.vector("load", 6)
    draft.fill(load, 0)

    def add(k: Index | int, load: Ref) -> None:
        reads = {"arm": points.arms[k], "force": forces.part(3 * k, 3)}
        draft.step(contact.load_about_torso, reads, load_=load)

    for chain in touching(draft):
        beyond = draft.vector("load", 6) if chain.name else load
        if chain.name:
            draft.fill(beyond, 0)
        for i, g in each_point(draft, downward=True):
            add(g + points.first[chain.group], beyond)
            reads = {"S": points.columns[chain.group][g], "F_beyond": beyond}
            on = given if chain.prescribed else torques
            if on:
                own = chain.segment_tau(on, i)
                draft.step(draft.of_segment(loads.joint_load), reads, torque_=own)
        if chain.name:
            draft.copy(load, beyond, adds=True)
    for group in [name for name in draft.tail.contacts if name not in points.columns]:
        with draft.loop("k", draft.tail.groups[group]) as k:
            add(k + points.first[group], load)
    reads = {"R": R, "load": load}
    return draft.store(contact.load_in_torso, reads, load_force=3, load_moment=3)


def contact_load(
    draft: Draft, state: State, R: Ref, arrays: dict[str, Array]
) -> tuple[Vectors, Array]:
    """Forces of all points; returns their load at B, and the torques of actuators and forces
    together.
    """
    points = gather_points(draft, state, R, arrays)
    press(draft, state.torso(R), points, arrays)
    if "powers" in arrays:
        balance_powers(draft, state.torso(R), points, arrays)
    torques = copied_torques(draft, net_torques(draft, state, arrays["tau"]))
    if not state.given or "powers" not in arrays:
        return gather_contact_loads(draft, R, points, arrays["forces"], torques), torques

    # the drives of prescribed joints resist the ground, too
    count, held = draft.tail.given, draft.array("held", draft.tail.given)
    draft.fill(held[0], 0)
    load = gather_contact_loads(draft, R, points, arrays["forces"], torques, held)
    power = derive(contact.taken_power, one_coordinate=True)
    with draft.loop("k", count) as k:
        reads = {"torque": held.part(k, 1), "rate": state.given.part(k + count, 1)}
        draft.step(power, reads, power_=arrays["powers"].part(1, 1))
    return load, torques


def balance_powers(draft: Draft, torso: Torso, points: Points, arrays: dict[str, Array]) -> None:
    """Heights of all points, the power of the ground on them, and the power of the drives of the
    legs.
    """
    powers = arrays["powers"]
    draft.fill(powers.part(0, 2), 0)
    with draft.loop("k", draft.tail.points) as k:
        force = {"force": arrays["forces"].part(3 * k, 3)}
        height = arrays["heights"].part(2 * k, 2)
        draft.step(contact.height, torso, points.motion(k), height=height)
        draft.step(contact.ground_power, points.motion(k), force, power_=powers.part(0, 1))
    if "feet" in draft.tail.contacts:
        first = points.first["feet"]
        with draft.loop("k", draft.tail.groups["feet"]) as k:
            drift = {"drift": points.foot_drifts[k]}
            force = {"force": arrays["forces"].part(3 * (k + first), 3)}
            draft.step(contact.leg_power, torso, drift, force, power_=powers.part(1, 1))


def assemble_contact_dynamics(draft: Draft, arrays: dict[str, Array]) -> None:
    """v_dot from Eq. 1, H v_dot + C = [0; tau] + J^T f, with the ground's forces."""
    state = draft.state(arrays["q"], arrays["v"])
    if draft.dynamics == "segments":
        R = attitude(draft, state)
        accelerate_by_segments(draft, arrays, *contact_load(draft, state, R, arrays))
        return
    factored = factored_dynamics(draft, arrays["q"], arrays["v"])
    applied, torques = contact_load(draft, state, factored.R, arrays)
    factored.solve(factored.loads(applied, torques), arrays["v_dot"])


ASSEMBLIES = {
    "contact_points": assemble_contact_points,
    "leg_points": assemble_leg_points,
    "contact_dynamics": assemble_contact_dynamics,
    "contact_rates": assemble_contact_dynamics,
}
