"""Functions of the points that touch the ground: a draft goes in, their places, motion and forces
are added to it.
"""

from dataclasses import dataclass

from ..ir.program import Array, Index, Ref
from ..mechanics import contact as con
from ..mechanics import leg as legs
from ..mechanics import loads, rotations
from ..mechanics.lower import derive
from .draft import Draft
from .dynamics import Loads, accelerate_by_segments, balanced
from .sweeps import sweeps
from .sweeps.sweeps import mechanism
from .tail import Tail


@dataclass(frozen=True)
class Points:
    """Arms and velocities of all points; where each group begins; columns of the tail's joints, one
    for a point.
    """

    arms: Array
    velocities: Array
    first: dict[str, int]
    S: Array | None = None

    def motion(self, k: Index | int) -> dict[str, Ref]:
        """Arm and velocity of point k."""
        return {"arm": self.arms[k], "velocity": self.velocities[k]}


def first_points(tail: Tail) -> dict[str, int]:
    """Number of the first point of each group."""
    first, out = 0, {}
    for name, count in tail.groups.items():
        out[name], first = first, first + count
    return out


def gather_points(d: Draft, arrays: dict[str, Array]) -> Points:
    """All points that can touch the ground: feet, then tail, then the torso's lowest."""
    tail = d.tail
    columns = d.array("S_point", 12, tail.total) if "tail" in tail.contacts else None
    points = Points(
        d.array("arm", 3, tail.points),
        d.array("velocity", 3, tail.points),
        first_points(tail),
        columns,
    )
    if "feet" in tail.contacts:
        place_feet(d, points, arrays["legs"])
    if "tail" in tail.contacts:
        place_tail(d, points)
    if "torso" in tail.contacts:
        d.store(con.lowest_point, place=3)
        d.step(con.point_on_torso, {"drift": d.zero(3)}, **points.motion(points.first["torso"]))
    return points


def place_feet(d: Draft, points: Points, angles: Array) -> None:
    """A, M and T of the right foot, then of the left."""
    sides = d.constant("sides", [1, -1])
    foot, rate = d.array("foot", 3, 3), d.array("foot_rate", 3, 3)
    with d.loop("l", 2) as leg:
        reads = {
            "side": sides.part(leg, 1),
            "leg": angles.part(2 * leg, 2),
            "leg_rates": angles.part(4 + 2 * leg, 2),
        }
        d.step(legs.foot_points, reads, foot=foot.part(0, 9), foot_rate=rate.part(0, 9))
        with d.loop("k", 3) as k:
            reads = {"place": foot[k], "drift": rate[k]}
            d.step(con.point_on_torso, reads, **points.motion(3 * leg + k + points.first["feet"]))


def place_tail(d: Draft, points: Points) -> None:
    """The tail's points but the first: that one is the mount, a point of the torso and inside
    it.
    """
    mechanism(d).prepare_samples(d)
    here = sweeps.torso_pose(d, True, name="point")
    twist = {name: d.vector(name, 3) for name in ("turn", "slide")}
    d.step(con.torso_twist, **twist)
    with d.loop("i", d.tail.segments) as i, d.loop("j", d.tail.links) as j:
        g = d.tail.links * i + j
        S = points.S[g]
        d.step(mechanism(d).twist, here | d.sample(i), S=S)
        d.step(mechanism(d).pose, here | d.sample(i), **here)
        d.step(
            con.carried_twist,
            {"S": S, "rates": d.rates(i)},
            turn_=twist["turn"],
            slide_=twist["slide"],
        )
        d.step(con.point_on_tail, here | twist, **points.motion(g + points.first["tail"]))


def assemble_contact_points(d: Draft, arrays: dict[str, Array]) -> None:
    """Places and velocities of all points."""
    d.store(rotations.quaternion_rotation, R=9)
    points = gather_points(d, arrays)
    with d.loop("k", d.tail.points) as k:
        d.step(con.position, points.motion(k), position=arrays["positions"].part(3 * k, 3))
        d.copy(arrays["velocities"].part(3 * k, 3), points.velocities[k])


def press(d: Draft, points: Points, arrays: dict[str, Array]) -> None:
    """Forces and bristle rates of all points."""
    d.store(con.bristle_properties, drag=1, mobility=1)
    law = derive(con.contact_force, friction=d.tail.friction)
    with d.loop("k", d.tail.points) as k:
        reads = d.known | points.motion(k) | {"bristle": arrays["bristles"].part(2 * k, 2)}
        writes = {
            "force": arrays["forces"].part(3 * k, 3),
            "rate": arrays["bristle_rates"].part(2 * k, 2),
        }
        d.apply(law, reads, **writes)


def gather_contact_loads(d: Draft, points: Points, forces: Array, torques: Array) -> None:
    """J^T f (Eq. 10): ``load_force, load_moment`` at B in torso axes; the joints' share is added to
    ``torques``.
    """
    load = d.vector("load", 6)
    d.fill(load, 0)

    def add(k: Index | int) -> None:
        reads = {"arm": points.arms[k], "force": forces.part(3 * k, 3)}
        d.step(con.load_about_torso, reads, load_=load)

    if points.S:
        with (
            d.loop("i", d.tail.segments, downward=True) as i,
            d.loop("j", d.tail.links, downward=True) as j,
        ):
            g = d.tail.links * i + j
            add(g + points.first["tail"])
            d.step(
                loads.joint_load,
                {"S": points.S[g], "F_beyond": load},
                torque_=torques.part(2 * i, 2),
            )
    for group in [name for name in d.tail.contacts if name != "tail"]:
        with d.loop("k", d.tail.groups[group]) as k:
            add(k + points.first[group])
    d.store(con.load_in_torso, load_force=3, load_moment=3)


def contact_torques(d: Draft, arrays: dict[str, Array]) -> Array:
    """Forces of all points, their load at B; returns the torques of actuators and forces
    together.
    """
    points = gather_points(d, arrays)
    press(d, points, arrays)
    torques = d.array("applied", d.tail.nt)
    with d.loop("k", d.tail.nt) as k:
        d.copy(torques.part(k, 1), arrays["tau"].part(k, 1))
    gather_contact_loads(d, points, arrays["forces"], torques)
    return torques


def assemble_contact_dynamics(d: Draft, arrays: dict[str, Array]) -> None:
    """v_dot from H v_dot + C = [0; tau] + J^T f with the ground's forces."""
    if d.dynamics == "segments":
        d.store(rotations.quaternion_rotation, R=9)
        accelerate_by_segments(d, arrays, contact_torques(d, arrays))
        return
    balance = balanced(d, arrays["q"], arrays["v"])
    torques = contact_torques(d, arrays)
    loads = Loads({}, lambda k: balance.bias.part(6 + k, 1), lambda k: torques.part(k, 1))
    balance.solve(d, loads, arrays["v_dot"])


ASSEMBLIES = {
    "contact_points": assemble_contact_points,
    "contact_dynamics": assemble_contact_dynamics,
}
