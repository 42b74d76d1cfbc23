"""Forward dynamics of a long articulated tail, by segments: a draft goes in, v_dot comes out
without its matrix H.

The links of all segments are swept at once, segment i in lane i.  Then one sweep takes the segments
from the tip to the mount, each as an articulated body whose coordinates are free, and one takes
accelerations from the torso to the tip.
"""

from dataclasses import dataclass

from ...ir.program import Array, Index, Ref, as_index
from ...mechanics import free_segment as art
from ...mechanics import link, rotations, torso
from ...mechanics.link_columns import torso_bias
from ..draft import Draft
from ..tails.articulated import prepare_link
from ..tails.mechanism import still
from .sweeps import IDENTITY

UNKNOWNS = 8  # motion of a segment's base, and two coordinates


@dataclass(frozen=True)
class Sweeps:
    """What is known of every segment: how its tip moves (lanes), what its coordinates' second
    derivatives follow.
    """

    tip: Array
    coasting: Array
    shares: Array

    def tip_of(self, i: Index) -> Ref:
        """What the motion of one tip is made of."""
        return self.tip.down(0, i, self.tip.size)


def accelerate(d: Draft, load: Array, torques: Array, v_dot: Array) -> None:
    """Fill ``v_dot`` from a load (force, moment) at B in torso axes and torques."""
    m = d.tail.segments
    known = Sweeps(
        _in_lanes(d, "tip_map", 30).array, d.array("coasting", 6, m), d.array("shares", 15, m)
    )
    _prepare(d)
    _shape(d, known.tip)
    _turn(d, known)
    _move(d)
    A, b = _inward(d, known, torques)
    _at_torso(d, A, b, load, v_dot)
    base = d.array("base", 6)
    d.copy(base.part(0, 3), d.known["a_mount"])
    d.copy(base.part(3, 3), v_dot.part(3, 3))
    with d.loop("i", m) as i:
        reads = {
            "tip_map": known.tip_of(i),
            "shares": known.shares[i],
            "coasting": known.coasting[i],
            "base": base[0],
        }
        d.step(art.outward, reads, accelerations=v_dot.part(6 + 2 * i, 2), base=base[0])


def _in_lanes(d: Draft, name: str, size: int, *values) -> Ref:
    """Declare a vector with one lane for each segment, found by its name; ``values`` are those it
    begins with.
    """
    d.known[name] = d.wide(f"{name}_lanes", size, d.tail.segments)[0]
    if values:
        d.fill(d.known[name], *values)
    return d.known[name]


def _prepare(d: Draft) -> None:
    """Link properties, trigonometry of all joints."""
    prepare_link(d)
    angles, rates = _in_lanes(d, "angles", 2, 0), _in_lanes(d, "rates", 2, 0)
    with d.loop("i", d.tail.segments) as i:
        d.copy(angles.array.down(0, i, 2), d.angles(i))
        d.copy(rates.array.down(0, i, 2), d.rates(i))
    d.step(link.joint_trigonometry, joint=_in_lanes(d, "joint", 4))
    d.step(link.double_angles, twice=_in_lanes(d, "twice", 10))


def _shape(d: Draft, tip: Array) -> None:
    """How each tip moves, and the composite inertia of each segment's own links."""
    here = {"R": _in_lanes(d, "R", 9, *IDENTITY), "P": _in_lanes(d, "P", 3, 0)}
    S = _in_lanes(d, "S", 12, 0)
    with d.loop("j", d.tail.links):
        d.step(link.joint_twist, S_=S)
        d.step(link.link_pose, **here)
    d.step(art.tip_motion, tip_map=tip[0])
    carried = {
        name: _in_lanes(d, name, size, 0)
        for name, size in (("h", 3), ("I", 6), ("pitch", 6), ("yaw", 6))
    }
    own = {f"{name}_": _in_lanes(d, name, 1, 0) for name in ("H_pp", "H_py", "H_yy")}
    d.fill(d.vector("mass", 1), 0)
    with d.loop("j", d.tail.links, downward=True):
        d.step(link.gather_links, mass=d.known["mass"], **carried, **own)


def _turn(d: Draft, known: Sweeps) -> None:
    """Angular velocity of each segment's base."""
    w, here = _in_lanes(d, "w", 3, 0), d.array("w_base", 3)[0]
    d.copy(here, d.known["omega"])
    with d.loop("i", d.tail.segments) as i:
        d.copy(w.array.down(0, i, 3), here)
        d.step(
            art.tip_angular_velocity,
            {"tip_map": known.tip_of(i), "rates": d.rates(i), "w": here},
            w=here,
        )


def _move(d: Draft) -> None:
    """Loads that velocities alone ask for in each segment, and what they alone accelerate its tip
    by.
    """
    here = {"w": d.known["w"], "w_dot": _in_lanes(d, "w_dot", 3, 0), "a": _in_lanes(d, "a", 3, 0)}
    motion = here | {name: _in_lanes(d, name, 3) for name in ("a_joint", "swing")}
    wrench = d.wide("wrench", 6 * d.tail.links, d.tail.segments)
    with d.loop("j", d.tail.links) as j:
        d.apply(still(d, link.link_motion, moving=False), d.known, **motion)
        d.step(link.link_wrench, F=wrench.part(6 * j, 6))
    total, torque = _in_lanes(d, "F_next", 6, 0), _in_lanes(d, "torque", 2, 0)
    with d.loop("j", d.tail.links, downward=True) as j:
        d.step(link.gather_wrench, {"F": wrench.part(6 * j, 6)}, F_next=total, torque_=torque)


def _inward(d: Draft, known: Sweeps, torques: Array) -> tuple[Array, Array]:
    """From the tip to the mount, coordinates eliminated; return A and b of all that hangs on the
    mount.
    """
    K, T = d.wide("K", UNKNOWNS, UNKNOWNS), d.wide("T", 6, UNKNOWNS)
    b, load, pivots = d.wide("b", 1, UNKNOWNS), d.wide("load", 1, UNKNOWNS), d.array("pivots", 2)[0]
    A, b_base = d.wide("A", 6, UNKNOWNS), d.wide("b_base", 1, UNKNOWNS)

    def begin(i: Index) -> None:
        names = ("h", "I", "pitch", "yaw", "H_pp", "H_py", "H_yy")
        own = {name: d.known[name].array.down(0, i, d.known[name].size) for name in names}
        d.step(art.own_inertia, own, **{f"K_{r}": K.lane(r, 0, UNKNOWNS) for r in range(UNKNOWNS)})
        d.copy(b.lane(0, 0, 6), d.known["F_next"].array.down(0, i, 6))
        d.copy(b.lane(0, 6, 2), d.known["torque"].array.down(0, i, 2))
        for name, first in (("a", 0), ("w_dot", 3)):
            d.copy(known.coasting.part(6 * i + first, 3), d.known[name].array.down(0, i, 3))

    def end(i: Index) -> None:
        reads = {
            "K": K[0],
            "b": b[0],
            "joint_load": b.lane(0, 6, 2),
            "torques": torques.part(2 * i, 2),
        }
        reads |= {"pitch_row": K.lane(6, 0, UNKNOWNS), "yaw_row": K.lane(7, 0, UNKNOWNS)}
        writes = {"A": A[0], "b_base": b_base[0], "shares": known.shares[i]}
        d.step(art.free_coordinates, reads, **writes, pivots=pivots)
        d.guard(pivots, "NOT_POSITIVE_DEFINITE", *writes.values())

    last = as_index(d.tail.segments - 1)
    begin(last)
    end(last)
    with d.loop("i", d.tail.segments - 1, downward=True) as i:
        begin(i)
        d.step(
            art.tip_rows,
            {"tip_map": known.tip_of(i)},
            **{f"T_{r}": T.lane(r, 0, UNKNOWNS) for r in range(6)},
        )
        d.step(
            art.load_at_tip,
            {"A": A[0], "b": b_base[0], "coasting": known.coasting[i]},
            load=load[0],
        )
        reads = {"T": T[0], "tip_map": known.tip_of(i), "load": load.lane(0, 0, 6)} | _rows(A, 6)
        d.step(art.pass_on, reads, K_=K[0], b_=b[0])
        end(i)
    return A, b_base


def _rows(A: Array, count: int) -> dict[str, Ref]:
    """The first rows of A, number by number."""
    return {f"A_{r}": A.lane(r, 0, 6) for r in range(count)}


def _at_torso(d: Draft, A: Array, b: Array, load: Array, v_dot: Array) -> None:
    """Accelerations of the torso; leaves that of the mount in ``a_mount``."""
    H, rhs, zero, omega = d.array("H", UNKNOWNS, 6), d.array("rhs", 6), d.zero(3), d.known["omega"]
    F, a_mount = d.array("F_tail", 6)[0], d.vector("a_mount", 3)
    d.step(
        art.freed_inertia, _rows(A, 6), **{f"H_{r}": H.part(UNKNOWNS * r, r + 1) for r in range(6)}
    )
    d.factor(H, 6)
    d.step(torso.mount_acceleration, {"w": omega, "w_dot": zero, "a": zero}, a_mount=a_mount)
    d.step(art.freed_wrench, _rows(A, 3) | {"b_mount": b.lane(0, 0, 6)}, F=F)
    inertial = {name: d.array(f"{name}_torso", 3)[0] for name in ("force", "moment")}
    d.step(torso_bias, {"w": omega, "a": zero, "F": F}, **inertial)
    d.step(art.net_load, inertial | {"at_torso": load[0]}, rhs=rhs[0])
    d.solve(H, rhs[0])
    w_dot, a = rhs.part(0, 3), rhs.part(3, 3)
    d.copy(v_dot.part(3, 3), w_dot)
    d.store(rotations.quaternion_rotation, R=9)
    d.step(rotations.world_acceleration, {"a": a}, p_ddot=v_dot.part(0, 3))
    d.step(torso.mount_acceleration, {"w": omega, "w_dot": w_dot, "a": a}, a_mount=a_mount)
