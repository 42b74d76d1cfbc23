"""Sweeps over the tail: a draft goes in, loop nests that several functions share are added to it.

Forward sweeps go from the torso to the tip, backward sweeps from the tip to the torso; ``i`` counts
segments, ``g`` pieces or tail points.  What a sweep carries from piece to piece is updated in
place.
"""

from collections.abc import Callable
from contextlib import contextmanager

from ...ir.program import Array, Index, Ref
from ...mechanics import loads, torso
from ..draft import Draft
from ..tails.mechanism import Mechanism, motion
from ..tails.of_scene import mechanism_of

Block = Callable[[Index, Index], Ref]  # an entry of H, by the numbers of two tail coordinates
IDENTITY = (1, 0, 0, 0, 1, 0, 0, 0, 1)


def mechanism(d: Draft) -> Mechanism:
    """Return the steps of the draft's tail."""
    return mechanism_of(d.tail)


@contextmanager
def each_piece(d: Draft, downward: bool = False):
    """Open the loops over segments and their pieces; yields the segment and the number of the
    piece.
    """
    pieces = mechanism(d).pieces(d.tail)
    with d.loop("i", d.tail.segments, downward) as i, d.loop("j", pieces, downward) as j:
        yield i, pieces * i + j


def forward_wrenches(d: Draft, v_dot: Array | None) -> Array:
    """Velocities and accelerations to the tip, and the inertial wrench of every piece (Eqs. A1 to
    A12, 17, 19).

    Starts from ``w``, ``w_dot`` and ``a`` of the torso; ``v_dot`` None means that the tail does not
    accelerate.
    """
    wrench = d.array("wrench", 6, d.tail.segments * mechanism(d).pieces(d.tail))
    here = {name: d.array(f"{name}_here", 3)[0] for name in ("w", "w_dot", "a")}
    d.copy(here["w"], d.known["w"])
    d.copy(here["w_dot"], d.known["w_dot"])
    d.step(torso.mount_acceleration, a_mount=here["a"])
    with each_piece(d) as (i, g):
        mechanism(d).move(d, i, here, v_dot, wrench[g])
    return wrench


def gather_wrenches(d: Draft, wrench: Array, torque: Callable[[Index], Ref] | None) -> None:
    """Sum wrenches (or momenta) from the tip to the tail mount, in ``F_next``; torques add up per
    segment.
    """
    total, pieces = d.vector("F_next", 6), mechanism(d).pieces(d.tail)
    d.fill(total, 0)
    with d.loop("i", d.tail.segments, downward=True) as i:
        writes = {"F_next": total}
        if torque:
            d.fill(torque(i), 0)
            writes["torque_"] = torque(i)
        with d.loop("j", pieces, downward=True) as j:
            d.step(mechanism(d).gather_wrench, d.piece(i) | {"F": wrench[pieces * i + j]}, **writes)


def virtual_power(d: Draft, power: Ref, multiplier: Array, v_dot: Array) -> None:
    """Sum the power of all inertial wrenches when the animal moves with the velocity
    ``multiplier``.

    Starts from ``w``, ``w_dot``, ``a`` of the torso and ``w_virtual``, ``u_virtual``, its virtual
    velocities.
    """
    carried = {
        name: d.array(f"{name}_here", 3)[0]
        for name in ("w", "w_dot", "a", "w_virtual", "u_virtual")
    }
    d.step(torso.torso_power, power=power)
    d.step(torso.mount_acceleration, a_mount=carried["a"])
    d.step(
        torso.mount_velocity,
        {"w": d.known["w_virtual"], "u": d.known["u_virtual"]},
        u=carried["u_virtual"],
    )
    for name in ("w", "w_dot", "w_virtual"):
        d.copy(carried[name], d.known[name])
    with each_piece(d) as (i, _):
        reads = d.piece(i) | motion(d, i, v_dot) | {"virtual_rates": multiplier.part(6 + 2 * i, 2)}
        d.step(mechanism(d).power, reads | carried, power_=power, **carried)


def gather_momentum(d: Draft, p_dot: Ref, kinetic: Ref | None = None) -> None:
    """``mass`` and first moment ``h`` of the animal, and its momentum ``force, moment``, at B,
    which moves with p_dot.

    With ``kinetic`` the kinetic energy is summed there, and momentum is not.
    """
    mechanism(d).prepare(d)
    gather_moment(d)
    w, u = d.vector("w", 3), d.vector("u", 3)
    d.step(torso.torso_velocity, {"p_dot": p_dot}, u=u)
    d.copy(d.vector("u_torso", 3), u)
    d.copy(w, d.known["omega"])
    d.step(torso.mount_velocity, u=u)
    momentum = (
        None if kinetic else d.array("momenta", 6, d.tail.segments * mechanism(d).pieces(d.tail))
    )
    if kinetic:
        d.fill(kinetic, 0)
    with each_piece(d) as (i, g):
        mechanism(d).momentum(d, i, {"kinetic_": kinetic} if kinetic else {"F": momentum[g]})
    d.known["w"] = d.known["omega"]
    if kinetic:
        d.step(torso.torso_momentum, kinetic_=kinetic)
        return
    gather_wrenches(d, momentum, None)
    d.store(torso.torso_momentum, force=3, moment=3)


def gather_moment(d: Draft) -> None:
    """Mass and first moment of the tail at its mount, then with the torso at B, in ``mass`` and
    ``h``.
    """
    carried = {name: d.vector(name, size) for name, size in (("mass", 1), ("h", 3))}
    for ref in carried.values():
        d.fill(ref, 0)
    with each_piece(d, downward=True) as (i, _):
        d.step(mechanism(d).gather_moment, d.piece(i), **carried)
    d.step(torso.torso_moment, **carried)


def gather_inertia(
    d: Draft, roots: dict[str, Array], columns: Array, H_tail: Block | None = None
) -> None:
    """Composite inertia in ``mass, h, I`` at B; each segment's momentum columns at B and its own
    block of H.
    """
    sizes = {"mass": 1, "h": 3, "I": 6, "pitch": 6, "yaw": 6}
    carried = {name: d.vector(name, size) for name, size in sizes.items()}
    for name in ("mass", "h", "I"):
        d.fill(carried[name], 0)
    with d.loop("i", d.tail.segments, downward=True) as i:
        places = {
            "H_pp_": (2 * i, 2 * i),
            "H_py_": (2 * i + 1, 2 * i),
            "H_yy_": (2 * i + 1, 2 * i + 1),
        }
        own = {name: H_tail(*place) for name, place in places.items()} if H_tail else {}
        for ref in (carried["pitch"], carried["yaw"], *own.values()):
            d.fill(ref, 0)
        with d.loop("j", mechanism(d).pieces(d.tail), downward=True):
            d.step(mechanism(d).gather, d.piece(i), **carried, **own)
        d.step(
            torso.column_at_torso,
            {name: array[i] for name, array in roots.items()},
            columns=columns.part(12 * i, 12),
        )
    d.step(torso.torso_composite, **{name: carried[name] for name in ("mass", "h", "I")})


def segment_columns(d: Draft) -> Array:
    """Declare the spatial columns of all segments but the last."""
    return d.array("S", 12, max(d.tail.segments - 1, 1))


def forward_roots(
    d: Draft, here: dict[str, Ref], roots: dict[str, Array], S: Array | None = None
) -> None:
    """Pose of every segment's root, and spatial columns of all segments but the last, from pose
    ``R, P`` on.
    """
    last = d.tail.segments - 1
    with d.loop("i", last) as i:
        for name, ref in here.items():
            d.copy(roots[name][i], ref)
        if S:
            d.fill(S[i], 0)
        with d.loop("j", mechanism(d).pieces(d.tail)):
            if S:
                d.step(mechanism(d).twist, here | d.piece(i), S_=S[i])
            d.step(mechanism(d).pose, here | d.piece(i), **here)
    for name, ref in here.items():
        d.copy(roots[name][last], ref)


def segment_roots(d: Draft) -> dict[str, Array]:
    """Declare the pose of every segment's root."""
    return {"R": d.array("R_root", 9, d.tail.segments), "P": d.array("P_root", 3, d.tail.segments)}


def tail_inertia(d: Draft, H_tail: Block, columns: Array, world: bool = False) -> Array:
    """All that H is made of (Eqs. 2, 16, 18): ``mass, h, I`` at B, momentum columns, H of the tail
    (lower triangle).

    In torso axes, or with ``world`` the columns in world axes.
    """
    mechanism(d).prepare(d, True)
    here = torso_pose(d, world)
    roots, S = segment_roots(d), segment_columns(d)
    forward_roots(d, here, roots, S)
    gather_inertia(d, roots, columns, H_tail)
    with d.loop("i", d.tail.segments, start=1) as i, d.loop("l", i) as segment:
        block = {
            "H_pitch": H_tail(2 * i, 2 * segment, 2),
            "H_yaw": H_tail(2 * i + 1, 2 * segment, 2),
        }
        d.step(
            torso.segment_coupling, {"S": S[segment], "columns": columns.part(12 * i, 12)}, **block
        )
    return columns


def torso_pose(
    d: Draft, world: bool, origin: Ref | None = None, name: str = "link"
) -> dict[str, Ref]:
    """Pose of the tail mount, to be carried along the tail: from B in torso axes, or in world axes
    from an origin.
    """
    here = {"R": d.array(f"R_{name}", 9)[0], "P": d.array(f"P_{name}", 3)[0]}
    if world:
        d.copy(here["R"], d.known["R"])
        d.step(
            torso.mount_position, {"p": origin or d.constant("origin", [0, 0, 0])[0]}, P=here["P"]
        )
    else:
        d.fill(here["R"], *IDENTITY)
        d.copy(here["P"], d.known["tail_mount"])
    return here


def column_of(columns: Array, k: Index) -> Ref:
    """Momentum column of tail coordinate k."""
    return columns.part(6 * k, 6)


def core_bias(d: Draft, bias: Array) -> None:
    """C without gravity and translation: force and moment at B in torso axes, then the tail's
    forces.
    """
    zero = d.zero(3)
    d.known |= {"w": d.known["omega"], "w_dot": zero, "a": zero}
    wrench = forward_wrenches(d, None)
    gather_wrenches(d, wrench, lambda i: bias.part(6 + 2 * i, 2))
    d.step(torso.torso_wrench, force=bias.part(0, 3), moment=bias.part(3, 3))


def sample_joints(d: Draft) -> tuple[Array, Array]:
    """Spatial columns between tail points, and all tail points, in torso axes from B."""
    tail = d.tail
    mechanism(d).prepare_samples(d)
    S, points = d.array("S_joint", 12, tail.total), d.array("tail_point", 3, tail.total + 1)
    here = torso_pose(d, world=False, name="joint")
    d.copy(points[0], here["P"])
    with d.loop("i", tail.segments) as i, d.loop("j", tail.links) as j:
        g = tail.links * i + j
        d.step(mechanism(d).twist, here | d.sample(i), S=S[g])
        d.step(mechanism(d).pose, here | d.sample(i), **here)
        d.copy(points[g + 1], here["P"])
    return S, points


def gather_loads(d: Draft, f_ext: Array, torques: Array) -> None:
    """J^T f of the loads in ``f_ext``: ``load_force, load_moment`` at B; the joints' share is added
    to ``torques``.
    """
    S, points = sample_joints(d)
    beyond = d.vector("F_beyond", 6)
    d.fill(beyond, 0)

    def add_load(point):
        reads = {"P": points[point], "f_point": f_ext.part(6 + 3 * point, 3)}
        d.step(loads.load_at_point, reads, F_beyond=beyond)

    with (
        d.loop("i", d.tail.segments, downward=True) as i,
        d.loop("j", d.tail.links, downward=True) as j,
    ):
        g = d.tail.links * i + j
        add_load(g + 1)
        d.step(loads.joint_load, {"S": S[g]}, torque_=torques.part(2 * i, 2))
    add_load(Index())
    d.known["f_torso"] = f_ext.part(0, 6)
    d.store(loads.load_at_torso, load_force=3, load_moment=3)
