"""The loops over the tail that several functions share.

Forward sweeps go from the torso to the tip, backward sweeps from the tip to the torso; ``i`` counts
segments, ``g`` pieces or tail points.  What a sweep carries from piece to piece is updated in
place.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from ...ir.program import Array, Index, Ref, as_index
from ...mechanics import loads, rotations, torso
from ..draft import Draft
from ..layout import OMEGA, VELOCITY, block, coordinate, coordinates, segment_v
from ..scope import Motion, Pose, State, Vectors
from ..tails.mechanism import Mechanism, Segments, Wrenches
from ..tails.of_scene import mechanism_of

Block = Callable[..., Ref]  # entries of H, by the numbers of two tail coordinates and how many
IDENTITY = (1, 0, 0, 0, 1, 0, 0, 0, 1)


def mechanism(draft: Draft) -> Mechanism:
    """Return the steps of the draft's tail."""
    return mechanism_of(draft.tail)


def attitude(draft: Draft, state: State) -> Ref:
    """Store the rotation matrix of the torso."""
    reads = {"quaternion": state.quaternion}
    return draft.store(rotations.quaternion_rotation, reads, R=9)["R"]


@contextmanager
def each_piece(draft: Draft, downward: bool = False) -> Iterator[tuple[Index, Index]]:
    """Open the loops over segments and their pieces; yields the segment and the number of the
    piece.
    """
    pieces = mechanism(draft).pieces(draft.tail)
    with (
        draft.loop("i", draft.tail.segments, downward) as i,
        draft.loop("j", pieces, downward) as j,
    ):
        yield i, pieces * i + j


# ---- wrenches ------------------------------------------------------------------------------------


def forward_wrenches(
    draft: Draft, segments: Segments, start: Motion, v_dot: Array | None
) -> Wrenches:
    """Velocities and accelerations to the tip, and the inertial wrench of every piece (Eqs. A1 to
    A12, 17, 19).

    ``start`` is the torso's motion; ``v_dot`` None means that the tail does not accelerate.
    """
    tail = mechanism(draft)
    wrench = draft.array("wrench", 6, draft.tail.segments * tail.pieces(draft.tail))
    motion = Motion(*(draft.vector(f"{name}_here", 3) for name in ("w", "w_dot", "a")))
    draft.copy(motion.w, start.w)
    draft.copy(motion.w_dot, start.w_dot)
    draft.step(torso.mount_acceleration, start, a_mount=motion.a)
    wrenches = Wrenches(wrench, tail.declare_torques(draft))
    with each_piece(draft) as (i, g):
        tail.move(draft, segments, i, motion, v_dot, wrenches.at(i, g))
    return wrenches


def gather_wrenches(
    draft: Draft,
    segments: Segments,
    wrenches: Wrenches,
    torque: Callable[[Index], Ref] | None = None,
) -> Vectors:
    """Sum wrenches (or momenta) from the tip to the tail mount, in ``F_next``; torques add up per
    segment.

    Of inertial wrenches this is the sum of Eq. 4.
    """
    total, pieces = draft.vectors(F_next=6), mechanism(draft).pieces(draft.tail)
    draft.fill(total["F_next"], 0)
    with draft.loop("i", draft.tail.segments, downward=True) as i:
        writes = dict(total.named)
        if torque:
            draft.fill(torque(i), 0)
            writes["torque_"] = torque(i)
        with draft.loop("j", pieces, downward=True) as j:
            wrench = wrenches.at(i, pieces * i + j)
            step = mechanism(draft).gather_wrench
            draft.step(step, segments.at(i), wrench, total, **writes)
    return total


def core_bias(draft: Draft, segments: Segments, bias: Array) -> None:
    """C without gravity and translation: force and moment at B in torso axes, then the tail's
    forces.
    """
    zero = draft.zero(3)
    motion = Motion(segments.state.omega, zero, zero)
    wrenches = forward_wrenches(draft, segments, motion, None)
    total = gather_wrenches(draft, segments, wrenches, lambda i: segment_v(bias, i))
    torso_wrench(draft, motion, total, bias)


def torso_wrench(draft: Draft, motion: Motion, total: Vectors, force: Array) -> None:
    """Store the inertial force and moment of torso and tail, from the tail's at its mount."""
    draft.step(
        torso.torso_wrench,
        motion,
        total,
        force=block(force, VELOCITY),
        moment=block(force, OMEGA),
    )


def virtual_power(
    draft: Draft,
    segments: Segments,
    start: Vectors,
    multiplier: Array,
    v_dot: Array,
    power: Ref,
) -> None:
    """Sum the power of all inertial wrenches when the animal moves with the velocity
    ``multiplier``.

    ``start``: ``w``, ``w_dot``, ``a`` of the torso and ``w_virtual``, ``u_virtual``, its virtual
    velocities.
    """
    names = ("w", "w_dot", "a", "w_virtual", "u_virtual")
    carried = Vectors({name: draft.vector(f"{name}_here", 3) for name in names})
    draft.step(torso.torso_power, start, power=power)

    # from B to the tail mount
    draft.step(torso.mount_acceleration, start, a_mount=carried["a"])
    virtual = {"w": start["w_virtual"], "u": start["u_virtual"]}
    draft.step(torso.mount_velocity, virtual, u=carried["u_virtual"])
    for name in ("w", "w_dot", "w_virtual"):
        draft.copy(carried[name], start[name])

    # from the mount to the tip
    with each_piece(draft) as (i, _):
        rates = segments.motion(i, v_dot), {"virtual_rates": segment_v(multiplier, i)}
        step = mechanism(draft).power
        draft.step(step, segments.at(i), *rates, carried, power_=power, **carried)


# ---- momentum ------------------------------------------------------------------------------------


def gather_momentum(draft: Draft, state: State, R: Ref, p_dot: Ref) -> Vectors:
    """``mass`` and first moment ``h`` of the animal, and its momentum ``force, moment``, at B,
    which moves with p_dot.
    """
    segments, moment, velocity, u_torso = _begin_momentum(draft, state, R, p_dot)
    tail = mechanism(draft)
    momenta = Wrenches(draft.array("momenta", 6, draft.tail.segments * tail.pieces(draft.tail)))
    with each_piece(draft) as (i, g):
        tail.momentum(draft, segments, i, velocity, momenta.at(i, g).named)
    total = gather_wrenches(draft, segments, momenta)
    reads = u_torso, {"w": state.omega}, total
    momentum = draft.store(torso.torso_momentum, *reads, force=3, moment=3)
    return Vectors({**moment, **momentum})


def gather_kinetic(draft: Draft, state: State, R: Ref, kinetic: Ref) -> Vectors:
    """``mass`` and first moment ``h`` of the animal; sums its energy in ``kinetic``."""
    segments, moment, velocity, u_torso = _begin_momentum(draft, state, R, state.velocity)
    draft.fill(kinetic, 0)
    with each_piece(draft) as (i, _):
        mechanism(draft).momentum(draft, segments, i, velocity, {"kinetic_": kinetic})
    draft.step(torso.torso_momentum, u_torso, {"w": state.omega}, kinetic_=kinetic)
    return moment


def _begin_momentum(
    draft: Draft, state: State, R: Ref, p_dot: Ref
) -> tuple[Segments, Vectors, Vectors, Vectors]:
    """Return segments, mass and first moment, velocities of the tail mount, and of the torso."""
    segments = mechanism(draft).prepare(draft, state, False)
    moment = gather_moment(draft, segments)
    velocity = draft.vectors(w=3, u=3)
    draft.step(torso.torso_velocity, {"R": R, "p_dot": p_dot}, u=velocity["u"])
    u_torso = draft.vectors(u_torso=3)
    draft.copy(u_torso["u_torso"], velocity["u"])
    draft.copy(velocity["w"], state.omega)
    draft.step(torso.mount_velocity, velocity, u=velocity["u"])
    return segments, moment, velocity, u_torso


def gather_moment(draft: Draft, segments: Segments) -> Vectors:
    """Mass and first moment of the tail at its mount, then with the torso at B, in ``mass`` and
    ``h``.
    """
    moment = draft.vectors(mass=1, h=3)
    for ref in moment.named.values():
        draft.fill(ref, 0)
    with each_piece(draft, downward=True) as (i, _):
        draft.step(mechanism(draft).gather_moment, segments.at(i), moment, **moment)
    draft.step(torso.torso_moment, moment, **moment)
    return moment


# ---- inertia -------------------------------------------------------------------------------------


def gather_inertia(
    draft: Draft,
    segments: Segments,
    roots: dict[str, Array],
    columns: Array,
    H_tail: Block | None = None,
) -> Vectors:
    """Composite inertia in ``mass, h, I`` at B; each segment's momentum columns at B and its own
    block of H.
    """
    composite = draft.vectors(mass=1, h=3, I=6)
    momenta = draft.vectors(pitch=6, yaw=6)
    for ref in composite.named.values():
        draft.fill(ref, 0)
    with draft.loop("i", draft.tail.segments, downward=True) as i:
        # the segment's own block of H and its columns start anew, what is beyond goes on
        own = _own_block(H_tail, i) if H_tail else {}
        for ref in (*momenta.named.values(), *own.values()):
            draft.fill(ref, 0)
        with draft.loop("j", mechanism(draft).pieces(draft.tail), downward=True):
            step = mechanism(draft).gather
            draft.step(step, segments.at(i), composite, momenta, **composite, **momenta, **own)
        root = {name: array[i] for name, array in roots.items()}
        draft.step(torso.column_at_torso, root, momenta, columns=columns_of(columns, i))
    draft.step(torso.torso_composite, composite, **composite)
    return composite


def _own_block(H_tail: Block, i: Index) -> dict[str, Ref]:
    """The lower triangle of H of one segment's two coordinates, to be added to."""
    pitch, yaw = coordinate(i), coordinate(i, 1)
    return {
        "H_pp_": H_tail(pitch, pitch),
        "H_py_": H_tail(yaw, pitch),
        "H_yy_": H_tail(yaw, yaw),
    }


def segment_roots(draft: Draft) -> dict[str, Array]:
    """Declare the pose of every segment's root."""
    count = draft.tail.segments
    return {"R": draft.array("R_root", 9, count), "P": draft.array("P_root", 3, count)}


def forward_roots(
    draft: Draft,
    segments: Segments,
    pose: Pose,
    roots: dict[str, Array],
    S: Array | None = None,
) -> None:
    """Pose of every segment's root, and spatial columns of all segments but the last, from a pose
    on.
    """
    last, steps = draft.tail.segments - 1, mechanism(draft)

    def copy_pose(i: Index) -> None:
        for name, array in roots.items():
            draft.copy(array[i], pose[name])

    with draft.loop("i", last) as i:
        copy_pose(i)
        if S:
            draft.fill(S[i], 0)
        with draft.loop("j", steps.pieces(draft.tail)):
            if S:
                draft.step(steps.twist, pose, segments.at(i), S_=S[i])
            draft.step(steps.pose, pose, segments.at(i), **pose)
    copy_pose(as_index(last))


def tail_inertia(
    draft: Draft, state: State, H_tail: Block, columns: Array, R: Ref | None = None
) -> tuple[Segments, Vectors]:
    """All that H is made of (Eqs. 2, 16, 18): ``mass, h, I`` at B, momentum columns, H of the tail
    (lower triangle).

    The columns are in torso axes, or in world axes with the attitude R of the torso.  Returns the
    segments, and ``mass, h, I``.
    """
    segments = mechanism(draft).prepare(draft, state, True)
    pose = torso_pose(draft, R)
    roots = segment_roots(draft)
    S = draft.array("S", 12, max(draft.tail.segments - 1, 1))
    forward_roots(draft, segments, pose, roots, S)
    composite = gather_inertia(draft, segments, roots, columns, H_tail)

    # blocks of two segments
    with draft.loop("i", draft.tail.segments, start=1) as i, draft.loop("l", i) as other:
        first = coordinate(other)
        blocks = {
            "H_pitch": H_tail(coordinate(i), first, 2),
            "H_yaw": H_tail(coordinate(i, 1), first, 2),
        }
        reads = {"S": S[other], "columns": columns_of(columns, i)}
        draft.step(torso.segment_coupling, reads, **blocks)
    return segments, composite


def torso_pose(
    draft: Draft, R: Ref | None = None, origin: Ref | None = None, name: str = "link"
) -> Pose:
    """Pose of the tail mount, to be carried along the tail: from B in torso axes, or with the
    attitude R in world axes from an origin.
    """
    pose = Pose(draft.vector(f"R_{name}", 9), draft.vector(f"P_{name}", 3))
    if R:
        draft.copy(pose.R, R)
        start = origin or draft.fixed("origin", [0, 0, 0])
        draft.step(torso.mount_position, {"R": R, "p": start}, P=pose.P)
    else:
        draft.fill(pose.R, *IDENTITY)
        draft.copy(pose.P, draft.parameters["tail_mount"])
    return pose


def column_of(columns: Array, k: Index) -> Ref:
    """Momentum column of tail coordinate k."""
    return columns.part(6 * k, 6)


def columns_of(columns: Array, i: Index) -> Ref:
    """Both momentum columns of segment i."""
    return columns.part(12 * i, 12)


# ---- loads ---------------------------------------------------------------------------------------


def sample_joints(draft: Draft, state: State) -> tuple[Array, Array]:
    """Spatial columns between tail points, and all tail points, in torso axes from B."""
    tail, steps = draft.tail, mechanism(draft)
    samples = steps.prepare_samples(draft, state, None)
    S, points = draft.array("S_joint", 12, tail.total), draft.array("tail_point", 3, tail.total + 1)
    pose = torso_pose(draft, name="joint")
    draft.copy(points[0], pose.P)
    with draft.loop("i", tail.segments) as i, draft.loop("j", tail.links) as j:
        g = tail.links * i + j
        draft.step(steps.twist, pose, samples.at(i), S=S[g])
        draft.step(steps.pose, pose, samples.at(i), **pose)
        draft.copy(points[g + 1], pose.P)
    return S, points


def gather_loads(draft: Draft, state: State, R: Ref, f_ext: Array, torques: Array) -> Vectors:
    """J^T f (Eq. 10) of the loads in ``f_ext``: returns ``load_force, load_moment`` at B; the
    joints' part is added to ``torques``.
    """
    S, points = sample_joints(draft, state)
    beyond = draft.vectors(F_beyond=6)
    draft.fill(beyond["F_beyond"], 0)

    def add_load(point: Index) -> None:
        force = f_ext.part(6 + 3 * point, 3)
        reads = {"R": R, "P": points[point], "f_point": force}
        draft.step(loads.load_at_point, reads, beyond, **beyond)

    with (
        draft.loop("i", draft.tail.segments, downward=True) as i,
        draft.loop("j", draft.tail.links, downward=True) as j,
    ):
        g = draft.tail.links * i + j
        add_load(g + 1)
        draft.step(loads.joint_load, {"S": S[g]}, beyond, torque_=coordinates(torques, i))
    add_load(Index())
    at_torso = {"R": R, "f_torso": f_ext.part(0, 6)}
    return draft.store(loads.load_at_torso, at_torso, beyond, load_force=3, load_moment=3)
