"""The air around the animal: velocities against it, and its generalised force.

If a scene has air, inertial wrenches are less those of the air in all functions of forces. In torso
axes, ``v`` then begins with the velocity of B against the air.
"""

from serpentail_scene.layout import OMEGA, VELOCITY

from ..ir.program import Array, Ref
from ..mechanics import air, branch, mount, rotations, torso
from ..mechanics import rotation_derivatives as turns
from .draft import Draft
from .layout import block
from .scope import Motion, State, Vectors
from .sweeps.chains import add, prepared
from .sweeps.pieces import IDENTITY, across, attitude, each_piece, mechanism
from .sweeps.wrenches import add_torso_drag, against_air, gather_wrenches
from .tails.mechanism import Wrenches


def airspeed(draft: Draft, state: State, R: Ref | None) -> Ref | None:
    """Return the velocity of B against the air in torso axes; None without air."""
    if not draft.tail.widths:
        return None
    reads = {"R": R, "p_dot": state.velocity}
    return draft.store(air.relative_velocity, reads, u=3)["u"]


def core_airspeed(draft: Draft, state: State) -> Ref | None:
    """Return the same where v is in torso axes: what it begins with."""
    if draft.tail.fixed:
        return airspeed(draft, state, draft.fixed("identity", IDENTITY))
    return state.velocity if draft.tail.widths else None


def in_air(draft: Draft, q: Array, v: Array, R: Ref) -> Array:
    """Return v in torso axes, as functions of torso axes take it: it differs in air alone."""
    if not draft.tail.widths or draft.tail.fixed:
        return v
    found, others = draft.array("v_in_air", draft.tail.nv), draft.tail.nv - OMEGA.start
    u = airspeed(draft, draft.state(q, v), R)
    assert u is not None
    draft.copy(block(found, VELOCITY), u)
    draft.copy(found.part(OMEGA.start, others), v.part(OMEGA.start, others))
    return found


def move_in_air(draft: Draft, v: Array, d_v: Array, R: Ref, turn: Ref) -> None:
    """Turn directions of p_dot in ``d_v`` into those of the velocity against the air, which changes
    with a turn of the torso, too; ``v`` is in torso axes. Without air nothing is done.
    """
    if not draft.tail.widths:
        return
    d_u = block(d_v, VELOCITY)
    draft.step(torso.torso_velocity, {"R": R, "p_dot": d_u}, u=d_u)
    draft.step(turns.turned_back, {"vector": block(v, VELOCITY), "turn": turn}, change_=d_u)


def assemble_air_force(draft: Draft, arrays: dict[str, Array]) -> None:
    """Wrenches of the air on all pieces, summed to the torso."""
    tail, force, zero = draft.tail, arrays["force"], draft.zero(3)
    state = draft.state(arrays["q"], arrays["v"])
    R, own = attitude(draft, state), prepared(draft, state)[0]
    motion = Motion(state.omega, zero, zero, airspeed(draft, state, R))
    w = draft.vector("w_here", 3)
    draft.copy(w, state.omega)
    velocity = Vectors({"w": w, "u": against_air(draft, motion)})
    across(draft, mount.flow_at_root, u=w)

    # minus the wrenches, then their sum at B
    wrenches = Wrenches(
        draft.array("wrench", 6, tail.pieces), mechanism(draft).declare_torques(draft)
    )
    for i, g in each_piece(draft):
        mechanism(draft).fly(draft, own, (i, g), velocity, wrenches.at(i, g))
    total = gather_wrenches(draft, own, wrenches, lambda i: tail.segment_v(force, i))
    if not tail.fixed:
        sums = Vectors({"force": block(force, VELOCITY), "moment": block(force, OMEGA)})
        for ref in sums.named.values():
            draft.fill(ref, 0)
        add_torso_drag(draft, motion, sums)
        add(draft, branch.chain_wrench, total, sums)
        draft.step(rotations.world_vector, {"R": R, "vector": sums["force"]}, vector=sums["force"])
    with draft.loop("k", tail.nv) as k:
        number = force.part(k, 1)
        draft.step(air.opposite, {"minus": number}, force=number)


ASSEMBLIES = {"air_force": assemble_air_force}
