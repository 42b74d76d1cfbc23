"""The air around the animal: velocities against it, and its generalised force.

If a scene has air, inertial wrenches are less those of the air in all functions of forces. In torso
axes, ``v`` then begins with the velocity of B against the air.
"""

from types import MappingProxyType

from serpentail_scene.layout import OMEGA, VELOCITY

from ..ir.program import Array, Ref
from ..mechanics import air, rotations, torso
from ..mechanics import rotation_derivatives as turns
from .draft import Draft
from .layout import block
from .scope import Motion, State
from .sweeps.chains import prepared
from .sweeps.pieces import IDENTITY, attitude
from .sweeps.wrenches import inertial_forces

MASSES = ("_mass", "_masses", "_inertia", "_inertias")  # how the names of parameters end


def airspeed(draft: Draft, state: State, R: Ref | None) -> Ref | None:
    """Return the velocity of B against the air in torso axes; None without air."""
    if not draft.tail.widths or R is None:
        return None
    reads = {"R": R, "p_dot": state.velocity}
    u = draft.vector("u_in_air", 3)
    draft.step(air.relative_velocity, reads, u=u)
    return u


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
    """What acts on an animal without mass that does not accelerate."""
    tail, force, zero = draft.tail, arrays["force"], draft.zero(3)
    masses = [name for name in draft.parameters if name.endswith(MASSES)]
    none = {n: draft.fixed(f"no_{n}", [0] * draft.parameters[n].size) for n in masses}
    draft.parameters = MappingProxyType({**draft.parameters, **none})
    state = draft.state(arrays["q"], arrays["v"])
    R = attitude(draft, state)
    motion = Motion(state.omega, zero, zero, airspeed(draft, state, R))
    inertial_forces(draft, prepared(draft, state), motion, None, force)
    if not tail.fixed:
        at_B = block(force, VELOCITY)
        draft.step(rotations.world_vector, {"R": R, "vector": at_B}, vector=at_B)
    with draft.loop("k", tail.nv) as k:
        number = force.part(k, 1)
        draft.step(air.negated, {"minus": number}, force=number)


ASSEMBLIES = {"air_force": assemble_air_force}
