"""Sweeps over the tail: derived steps and a draft go in, loop nests that several functions share come out.

Forward sweeps go from the torso to the tip, backward sweeps from the tip to the torso; ``i`` counts segments, ``g``
links.  What a sweep carries from link to link is updated in place.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from fractions import Fraction

from . import dynamics as dyn
from . import kinematics as kin
from .lower import derive
from .program import Array, Builder, Index, Ref
from .tape import specialised

IDENTITY = (1, 0, 0, 0, 1, 0, 0, 0, 1)


@dataclass(frozen=True)
class Tail:
    """Sizes of an articulated tail of m segments with n links each."""

    segments: int
    links: int

    @property
    def total(self) -> int:
        """N = m n links."""
        return self.segments * self.links

    @property
    def nt(self) -> int:
        """Tail coordinates."""
        return 2 * self.segments

    @property
    def nq(self) -> int:
        """Scalars of a configuration."""
        return 7 + self.nt

    @property
    def nv(self) -> int:
        """Scalars of a velocity."""
        return 6 + self.nt


@dataclass
class Draft(Builder):
    """A function being assembled: the builder, the tail's sizes, and the vectors that steps find by name."""

    tail: Tail | None = None
    known: dict[str, Ref] = field(default_factory=dict)

    def step(self, function, reads: dict[str, Ref] | None = None, **writes: Ref) -> None:
        """Apply the step derived from a kinematics or dynamics function."""
        self.apply(derive(function), self.known | (reads or {}), **writes)

    def vector(self, name: str, size: int, count: int = 1, **known) -> Array:
        """Declare a local array; with one vector in it, steps find it by its name."""
        array = self.array(name, size, count)
        if count == 1:
            self.known[name] = array[0]
        return array

    def store(self, function, **sizes: int) -> None:
        """Apply a step, keeping its outputs in new local vectors of the same names."""
        self.step(function, **{name: self.vector(name, size)[0] for name, size in sizes.items()})

    def links(self, i: Index, downward: bool = False):
        """Open the loop over the links of segment i."""
        return self.loop("j", self.tail.links, downward)

    def link_number(self, i: Index, j: Index) -> Index:
        """g = n i + j."""
        return self.tail.links * i + j


def prepare_links(d: Draft) -> None:
    """Link properties, from the parameters."""
    d.known["share"] = d.constant("share", [Fraction(1, d.tail.total)])[0]
    d.store(dyn.link_properties, link=6)


def prepare_joints(d: Draft, q: Array, doubled: bool = False) -> None:
    """Trigonometry of every segment's joint angles."""
    joint = d.array("joint", 4, d.tail.segments)
    twice = d.array("twice", 8, d.tail.segments) if doubled else None
    with d.loop("i", d.tail.segments) as i:
        d.step(kin.joint_trigonometry, {"angles": q.part(7 + 2 * i, 2)}, joint=joint[i])
        if doubled:
            d.step(kin.double_angles, {"joint": joint[i]}, twice=twice[i])


def at_segment(d: Draft, i: Index) -> dict[str, Ref]:
    """What the steps of segment i read."""
    stored = {a.name: a for a in d.arrays}
    return {name: stored[name][i] for name in ("joint", "twice") if name in stored}


def forward_wrenches(d: Draft, v: Array, v_dot: Array | None) -> Array:
    """Velocities and accelerations to the tip, and the inertial wrench of every link (Eqs. A1 to A12, 17).

    Starts from ``w``, ``w_dot`` and ``a`` of the torso; ``v_dot`` None means that the tail does not accelerate.
    """
    still = {} if v_dot else {"accelerations": (0, 0)}
    motion = specialised(derive(kin.link_motion), "link_motion" if v_dot else "link_motion_unforced", **still)
    wrench = d.array("wrench", 6, d.tail.total)
    for name in ("w_here", "w_dot_here", "a_here"):
        d.vector(name, 3)
    d.copy(d.known["w_here"], d.known["w"])
    d.copy(d.known["w_dot_here"], d.known["w_dot"])
    d.step(kin.mount_acceleration, a_mount=d.known["a_here"])
    a_joint, swing = d.vector("a_joint", 3)[0], d.vector("swing", 3)[0]
    here = {"w": d.known["w_here"], "w_dot": d.known["w_dot_here"], "a": d.known["a_here"]}
    with d.loop("i", d.tail.segments) as i, d.links(i) as j:
        rates = {"rates": v.part(6 + 2 * i, 2)} | ({"accelerations": v_dot.part(6 + 2 * i, 2)} if v_dot else {})
        d.apply(motion, d.known | at_segment(d, i) | here | rates, a_joint=a_joint, swing=swing, **here)
        d.step(dyn.link_wrench, here, F=wrench[d.link_number(i, j)])
    return wrench


def gather_wrenches(d: Draft, wrench: Array, torque: Callable[[Index], Ref] | None) -> None:
    """Sum wrenches (or momenta) from the tip to the tail mount, in ``F_next``; torques add up per segment."""
    total = d.vector("F_next", 6)[0]
    d.fill(total, 0)
    with d.loop("i", d.tail.segments, downward=True) as i:
        writes = {"F_next": total}
        if torque:
            d.fill(torque(i), 0)
            writes["torque_"] = torque(i)
        with d.links(i, downward=True) as j:
            reads = at_segment(d, i) | {"F": wrench[d.link_number(i, j)], "F_next": total}
            d.step(dyn.gather_wrench, reads, **writes)


def gather_momentum(d: Draft, arrays: dict[str, Array], p_dot: Ref, kinetic: Ref | None = None) -> None:
    """``mass`` and first moment ``h`` of the animal, and its momentum ``force, moment``, at B, which moves with p_dot.

    With ``kinetic`` the kinetic energy is summed there, and momentum is not.
    """
    prepare_links(d)
    prepare_joints(d, arrays["q"])
    gather_moment(d)
    w, u, u_joint = (d.vector(name, 3)[0] for name in ("w", "u", "u_joint"))
    d.step(kin.torso_velocity, {"p_dot": p_dot}, u=u)
    d.copy(d.vector("u_torso", 3)[0], u)
    d.copy(w, d.known["omega"])
    d.step(kin.mount_velocity, u=u)
    momentum = None if kinetic else d.array("momenta", 6, d.tail.total)
    if kinetic:
        d.fill(kinetic, 0)
    with d.loop("i", d.tail.segments) as i, d.links(i) as j:
        reads = at_segment(d, i) | {"rates": arrays["v"].part(6 + 2 * i, 2)}
        d.step(kin.link_angular_velocity, reads, w=w)
        d.step(kin.link_linear_velocity, reads, u_joint=u_joint, u=u)
        sums = {"kinetic_": kinetic} if kinetic else {"F": momentum[d.link_number(i, j)]}
        d.step(dyn.link_momentum, **sums)
    d.known["w"] = d.known["omega"]
    if kinetic:
        d.step(dyn.torso_momentum, kinetic_=kinetic)
        return
    gather_wrenches(d, momentum, None)
    d.store(dyn.torso_momentum, force=3, moment=3)


def gather_moment(d: Draft) -> None:
    """Mass and first moment of the tail at its mount, then with the torso at B, in ``mass`` and ``h``."""
    carried = {name: d.vector(name, size)[0] for name, size in (("mass", 1), ("h", 3))}
    for ref in carried.values():
        d.fill(ref, 0)
    with d.loop("i", d.tail.segments, downward=True) as i, d.links(i, downward=True):
        d.step(dyn.gather_moment, at_segment(d, i), **carried)
    d.step(dyn.torso_moment, **carried)


def gather_inertia(d: Draft, H_tail: Callable[[Index, Index], Ref]) -> Array:
    """Composite inertia in ``mass, h, I`` at B, each segment's momentum columns at its root, its own block of H."""
    tail = d.tail
    sizes = {"mass": 1, "h": 3, "I": 6, "pitch": 6, "yaw": 6}
    carried = {name: d.vector(name, size)[0] for name, size in sizes.items()}
    columns = d.array("columns", 12, tail.segments)
    for name in ("mass", "h", "I"):
        d.fill(carried[name], 0)
    with d.loop("i", tail.segments, downward=True) as i:
        own = {"H_pp_": H_tail(2 * i, 2 * i), "H_py_": H_tail(2 * i + 1, 2 * i), "H_yy_": H_tail(2 * i + 1, 2 * i + 1)}
        for ref in (carried["pitch"], carried["yaw"], *own.values()):
            d.fill(ref, 0)
        with d.links(i, downward=True):
            d.step(dyn.gather_links, at_segment(d, i), **carried, **own)
        roots = {a.name: a[i] for a in d.arrays if a.name in ("R_root", "P_root")}
        d.step(dyn.column_at_torso, {"R": roots["R_root"], "P": roots["P_root"]}, columns=columns[i])
    composite = {name: carried[name] for name in ("mass", "h", "I")}
    d.step(dyn.torso_composite, **composite)
    return columns


def forward_roots(d: Draft) -> Array:
    """Pose of every segment's root and spatial columns of all segments but the last, from ``R`` and ``P`` on."""
    tail, R, P = d.tail, d.known["R_link"], d.known["P_link"]
    R_root, P_root = d.array("R_root", 9, tail.segments), d.array("P_root", 3, tail.segments)
    S = d.array("S", 12, max(tail.segments - 1, 1))
    here = {"R": R, "P": P}
    with d.loop("i", tail.segments - 1) as i:
        d.copy(R_root[i], R)
        d.copy(P_root[i], P)
        d.fill(S[i], 0)
        with d.links(i):
            d.step(kin.joint_twist, here | at_segment(d, i), S_=S[i])
            d.step(kin.link_pose, here | at_segment(d, i), **here)
    d.copy(R_root[tail.segments - 1], R)
    d.copy(P_root[tail.segments - 1], P)
    return S


def tail_inertia(d: Draft, q: Array, H_tail: Callable[[Index, Index], Ref], world: bool = False) -> Array:
    """Everything H is made of (Eq. 2, 16): ``mass, h, I`` at B, momentum columns, and H of the tail (lower triangle).

    In torso axes, or with ``world`` the columns in world axes.
    """
    prepare_links(d)
    prepare_joints(d, q, doubled=True)
    R, P = d.vector("R_link", 9)[0], d.vector("P_link", 3)[0]
    if world:
        d.copy(R, d.known["R"])
        d.fill(P, 0)
        d.step(kin.mount_position, {"p": d.constant("origin", [0, 0, 0])[0]}, P=P)
    else:
        d.fill(R, *IDENTITY)
        d.copy(P, d.known["tail_mount"])
    S = forward_roots(d)
    columns = gather_inertia(d, H_tail)
    with d.loop("i", d.tail.segments, start=1) as i, d.loop("l", i) as segment:
        block = {"H_pitch": H_tail(2 * i, 2 * segment, 2), "H_yaw": H_tail(2 * i + 1, 2 * segment, 2)}
        d.step(dyn.segment_coupling, {"S": S[segment], "columns": columns[i]}, **block)
    return columns


def column_of(columns: Array, k: Index) -> Ref:
    """Momentum column of tail coordinate k."""
    return columns.part(6 * k, 6)


def core_bias(d: Draft, v: Array) -> Array:
    """C without gravity and translation: ``force, moment`` at B in torso axes; returns the joints' part."""
    zero = d.constant("zero", [0, 0, 0])[0]
    d.known |= {"w": d.known["omega"], "w_dot": zero, "a": zero}
    torques = d.array("inertial", d.tail.nt)
    wrench = forward_wrenches(d, v, None)
    gather_wrenches(d, wrench, lambda i: torques.part(2 * i, 2))
    d.store(dyn.torso_wrench, force=3, moment=3)
    return torques


def forward_joints(d: Draft) -> tuple[Array, Array]:
    """Spatial columns of every joint and all tail points, in torso axes from B."""
    tail = d.tail
    S, points = d.array("S_joint", 12, tail.total), d.array("tail_point", 3, tail.total + 1)
    R, P = d.vector("R_joint", 9)[0], d.vector("P_joint", 3)[0]
    d.fill(R, *IDENTITY)
    d.copy(P, d.known["tail_mount"])
    d.copy(points[0], P)
    here = {"R": R, "P": P}
    with d.loop("i", tail.segments) as i, d.links(i) as j:
        g = d.link_number(i, j)
        d.step(kin.joint_twist, here | at_segment(d, i), S=S[g])
        d.step(kin.link_pose, here | at_segment(d, i), **here)
        d.copy(points[g + 1], P)
    return S, points


def gather_loads(d: Draft, f_ext: Array, torques: Array) -> None:
    """J^T f of the loads in ``f_ext``: ``load_force, load_moment`` at B; the joints' share is added to ``torques``."""
    S, points = forward_joints(d)
    beyond = d.vector("F_beyond", 6)[0]
    d.fill(beyond, 0)

    def add_load(point):
        reads = {"P": points[point], "f_point": f_ext.part(6 + 3 * point, 3), "F_beyond": beyond}
        d.step(dyn.load_at_point, reads, F_beyond=beyond)

    with d.loop("i", d.tail.segments, downward=True) as i, d.links(i, downward=True) as j:
        g = d.link_number(i, j)
        add_load(g + 1)
        d.step(dyn.joint_load, {"S": S[g]}, torque_=torques.part(2 * i, 2))
    add_load(Index())
    d.known["f_torso"] = f_ext.part(0, 6)
    d.store(dyn.load_at_torso, load_force=3, load_moment=3)
