"""Forward dynamics of a long tail by segments: it gives v_dot without H.

The pieces of all segments are swept at once, segment i in lane i. Then one sweep goes over the
segments from the tip to the mount and treats each as an articulated body with free coordinates. A
last sweep carries accelerations from the torso to the tip.
"""

from serpentail_scene.layout import OMEGA, PER_SEGMENT, VELOCITY

from ...ir.program import Array, Index, Ref, as_index
from ...mechanics import free_segment, mount, rotations, torso
from ...mechanics.link_columns import torso_bias
from ..draft import Draft
from ..layout import block, coordinates
from ..scope import Motion, State, Vectors
from .bodies import ArticulatedBody, Freed, Passes, lane
from .pieces import IDENTITY, across, mechanism
from .side_by_side import SegmentGroup, groups_of, joined

UNKNOWNS = 8  # motion of a segment's base, and two coordinates
OWN_INERTIA = {"h": 3, "I": 6, "pitch": 6, "yaw": 6, "H_pp": 1, "H_py": 1, "H_yy": 1}


def forward_dynamics(
    draft: Draft, state: State, load: Array, torques: Array, v_dot: Array, again: bool = False
) -> Freed:
    """Fill ``v_dot`` from a load (force, moment) at B in torso axes and torques.

    again: keep the quantities that further loads need.
    """
    m = draft.tail.segments
    groups = groups_of(draft, state)

    # loads of the segments' own pieces
    inertia = joined(groups, [_own_inertia(group) for group in groups])
    over = draft.array("over_pivots", 2, m) if again else None
    coasting, shares = draft.array("coasting", 6, m), draft.array("shares", 15, m)
    passes = Passes(inertia["tip_map"].array, coasting, shares, over)
    w = _base_velocities(draft, state, passes)
    bias = joined(groups, [_bias(group, group.part("w", w)) for group in groups])
    across(draft, mount.wrench_at_mount, F_next=lane(bias["F_next"], as_index(0)))

    # inward: everything beyond the mount, then the torso; outward: accelerations
    body = _inward_pass(draft, passes, inertia, bias, torques)
    freed, a_mount = _at_torso(draft, state, body, load, v_dot)
    base = draft.array("base", 6)
    draft.copy(base.part(0, 3), a_mount)
    draft.copy(base.part(3, 3), block(v_dot, OMEGA))
    with draft.loop("i", m) as i:
        reads = {"shares": passes.elimination[i], "coasting": passes.coasting[i], "base": base[0]}
        writes = {"accelerations": draft.tail.segment_v(v_dot, i), "base": base[0]}
        draft.step(free_segment.outward, passes.tip_of(i), reads, **writes)
    return Freed(passes, inertia, *freed)


def _base_velocities(draft: Draft, state: State, passes: Passes) -> Ref:
    """Angular velocities of the bases of all segments, the first in the tail's root axes."""
    w, w_base = draft.wide("w_lanes", 3, draft.tail.segments)[0], draft.vector("w_base", 3)
    draft.fill(w, 0)
    draft.copy(w_base, state.omega)
    with draft.loop("i", draft.tail.segments) as i:
        draft.copy(lane(w, i), w_base)
        reads = {"rates": state.rates(i), "w": w_base}
        draft.step(free_segment.tip_angular_velocity, passes.tip_of(i), reads, w=w_base)
    across(draft, mount.velocity_at_root, w=lane(w, as_index(0)))
    return w


def _own_inertia(group: SegmentGroup) -> Vectors:
    """Compute how each tip moves, and the composite inertia of each segment's own pieces.

    The base of the first segment has the axes of the torso.
    """
    draft, first = group.draft, as_index(0)
    with group.at_once():
        # from the base to the tip
        tail, begin = mechanism(draft), group.vectors(R=IDENTITY, P=(0,) * 3, S=(0,) * 12)
        pose = begin.only("R", "P")
        if not group.number:
            across(draft, mount.mounted_frame, R=lane(pose["R"], first))
        with draft.loop("j", group.pieces) as j:
            piece = group.segments.at(first, j)
            draft.step(tail.twist, piece, pose, S_=begin["S"])
            draft.step(tail.pose, piece, pose, **pose)
        tip = draft.vectors(tip_map=30)
        draft.step(free_segment.tip_motion, begin, **tip)

        # from the tip to the base
        inertia = group.vectors(**{name: (0,) * size for name, size in OWN_INERTIA.items()})
        carried = inertia.only("h", "I", "pitch", "yaw")
        own = {f"{name}_": inertia[name] for name in ("H_pp", "H_py", "H_yy")}
        mass = group.mass()
        with draft.loop("j", group.pieces, downward=True) as j:
            reads = group.segments.at(first, j), mass, carried
            draft.step(tail.gather, *reads, **mass, **carried, **own)
    if not group.number:
        own = {name: lane(ref, first) for name, ref in carried.named.items()}
        across(draft, mount.composite_at_mount, {name: own[name] for name in ("h", "I")})
        for name in ("pitch", "yaw"):
            across(draft, mount.wrench_at_mount, F_next=own[name])
    return Vectors({**inertia, **mass, **tip})


def _bias(group: SegmentGroup, w: Ref) -> Vectors:
    """Compute loads and tip accelerations of each segment that velocities alone cause."""
    draft, first = group.draft, as_index(0)
    with group.at_once():
        # from the base to the tip
        tail, begin = mechanism(draft), group.vectors(w_dot=(0,) * 3, a=(0,) * 3)
        motion, bending = Motion(w, **begin), draft.vectors(torque_own=2)
        wrench = draft.wide(f"wrench{group.suffix}", 6 * group.pieces, group.lanes)
        with draft.loop("j", group.pieces) as j:
            own = Vectors({"F": wrench.part(6 * j, 6), **bending})
            tail.move(draft, group.segments, (first, j), motion, None, own)

        # from the tip to the base
        total = group.vectors(F_next=(0,) * 6, torque=(0,) * 2)
        with draft.loop("j", group.pieces, downward=True) as j:
            loads = Vectors({"F": wrench.part(6 * j, 6), **bending}), total.only("F_next")
            writes = {"F_next": total["F_next"], "torque_": total["torque"]}
            draft.step(tail.gather_wrench, group.segments.at(first, j), *loads, **writes)
    return Vectors({**begin, **total})


def _inward_pass(
    draft: Draft, passes: Passes, inertia: Vectors, bias: Vectors, torques: Array
) -> ArticulatedBody:
    """Eliminate the coordinates from the tip to the mount; return all beyond the mount."""
    K, T = draft.wide("K", UNKNOWNS, UNKNOWNS), draft.wide("T", 6, UNKNOWNS)
    b, load = draft.wide("b", 1, UNKNOWNS), draft.wide("load", 1, UNKNOWNS)
    pivots = draft.vector("pivots", 2)
    body = ArticulatedBody(draft.wide("A", 6, UNKNOWNS), draft.wide("b_base", 1, UNKNOWNS))

    def begin(i: Index) -> None:
        """Start with the segment alone: its inertia, loads, and the acceleration of its tip by
        velocities.
        """
        own = {name: lane(inertia[name], i) for name in (*OWN_INERTIA, "mass")}
        rows = {f"K_{r}": K.lane(r, 0, UNKNOWNS) for r in range(UNKNOWNS)}
        draft.step(free_segment.own_inertia, own, **rows)
        draft.copy(b.lane(0, 0, 6), lane(bias["F_next"], i))
        draft.copy(b.lane(0, 6, PER_SEGMENT), lane(bias["torque"], i))
        for name, first in (("a", 0), ("w_dot", 3)):
            draft.copy(passes.coasting.part(6 * i + first, 3), lane(bias[name], i))

    def end(i: Index) -> None:
        """Eliminate the segment's coordinates, which are free."""
        reads = {
            "K": K[0],
            "b": b[0],
            "joint_load": b.lane(0, 6, PER_SEGMENT),
            "torques": coordinates(torques, i),
            "pitch_row": K.lane(6, 0, UNKNOWNS),
            "yaw_row": K.lane(7, 0, UNKNOWNS),
        }
        writes = {"A": body.A[0], "b_base": body.b[0], "shares": passes.elimination[i]}
        if passes.over:
            writes["over"] = passes.over[i]
        draft.step(free_segment.free_coordinates, reads, **writes, pivots=pivots)
        draft.guard(pivots, "NOT_POSITIVE_DEFINITE", *writes.values())

    def to_parent(i: Index) -> None:
        """Add everything beyond the segment's tip."""
        tip = passes.tip_of(i)
        rows = {f"T_{r}": T.lane(r, 0, UNKNOWNS) for r in range(6)}
        draft.step(free_segment.tip_rows, tip, **rows)
        beyond = {"A": body.A[0], "b": body.b[0], "coasting": passes.coasting[i]}
        draft.step(free_segment.load_at_tip, beyond, load=load[0])
        reads = {"T": T[0], "load": load.lane(0, 0, 6)} | tip | body.rows(6)
        draft.step(free_segment.pass_on, reads, K_=K[0], b_=b[0])

    last = as_index(draft.tail.segments - 1)
    begin(last)
    end(last)
    with draft.loop("i", draft.tail.segments - 1, downward=True) as i:
        begin(i)
        to_parent(i)
        end(i)
    return body


def _at_torso(
    draft: Draft, state: State, body: ArticulatedBody, load: Array, v_dot: Array
) -> tuple[tuple[Array, Ref], Ref]:
    """Accelerate the torso; return its inertia and attitude, and how the mount accelerates."""
    H, rhs = draft.array("H", UNKNOWNS, 6), draft.array("rhs", 6)
    zero, omega = draft.zero(3), state.omega
    F, a_mount = draft.vector("F_tail", 6), draft.vector("a_mount", 3)
    rows = {f"H_{r}": H.part(UNKNOWNS * r, r + 1) for r in range(6)}
    draft.step(free_segment.freed_inertia, body.rows(6), **rows)
    draft.factor(H, 6)

    # loads at B by velocities alone
    motion = {"w": omega, "w_dot": zero, "a": zero}
    draft.step(torso.mount_acceleration, motion, a_mount=a_mount)
    beyond = {"b_mount": body.b.lane(0, 0, 6), "a_mount": a_mount}
    draft.step(free_segment.freed_wrench, body.rows(3), beyond, F=F)
    inertial = {name: draft.vector(f"{name}_torso", 3) for name in ("force", "moment")}
    draft.step(torso_bias, {"w": omega, "a": zero, "F": F}, **inertial)
    draft.step(free_segment.net_load, inertial, {"at_torso": load[0]}, rhs=rhs[0])
    draft.solve(H, rhs[0])

    # accelerations in the axes of v_dot, and of the mount
    motion = {"w": omega, "w_dot": rhs.part(0, 3), "a": rhs.part(3, 3)}
    draft.copy(block(v_dot, OMEGA), motion["w_dot"])
    quaternion = {"quaternion": state.quaternion}
    axes = draft.store(rotations.quaternion_rotation, quaternion, R=9)
    reads = axes, {"a": motion["a"]}
    draft.step(rotations.world_acceleration, *reads, p_ddot=block(v_dot, VELOCITY))
    draft.step(torso.mount_acceleration, motion, a_mount=a_mount)
    return (H, axes["R"]), a_mount
