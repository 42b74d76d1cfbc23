"""Mass matrix, inverse and forward dynamics, energy and momentum."""

from dataclasses import replace
from functools import partial

from serpentail_scene.layout import OMEGA, TORSO_NV, VELOCITY
from serpentail_scene.signatures.arguments import TAU, V_DOT, Argument, Q, V

from ..ir.program import Array, Index, Ref
from ..mechanics import rotations, torso
from .air import airspeed
from .draft import Draft
from .factored import FactoredDynamics, factored_dynamics
from .function import Assembly, Function, assemble
from .layout import block
from .passive import add_elastic_energy, add_passive_forces, add_rotor_energy, net_torques
from .scope import Motion, State, Vectors
from .sweeps.chains import prepared
from .sweeps.inertia import animal_inertia, column_of
from .sweeps.loads import gather_loads
from .sweeps.momentum import gather_kinetic, gather_momentum
from .sweeps.pieces import IDENTITY, attitude, mechanism
from .sweeps.segments import forward_dynamics
from .sweeps.wrenches import forward_wrenches, gather_wrenches, inertial_forces
from .tails.mechanism import Segments

# ---- H and C -------------------------------------------------------------------------------------


def assemble_mass_matrix(draft: Draft, arrays: dict[str, Array], world: bool = False) -> None:
    """H (Eq. 2), both triangles; on a fixed base its rows and columns of the tail (Eq. 16)."""
    fill_mass_matrix(draft, draft.state(arrays["q"]), arrays["H"], draft.tail.nv, world)


def fill_mass_matrix(
    draft: Draft, state: State, H: Array, row: int, world: bool = False
) -> tuple[list[Segments], Ref]:
    """H (Eq. 2), both triangles; its rows are ``row`` apart.  Returns the segments of each chain,
    and the attitude.
    """
    tail, R, before = draft.tail, attitude(draft, state), draft.tail.torso_nv

    def H_tail(k: Index, other: Index, size: int = 1) -> Ref:
        return H.part((before + k) * row + before + other, size)

    columns = draft.array("columns", 12, tail.segments)
    along = R if world else None
    segments, composite = animal_inertia(draft, state, H_tail, columns, along)

    # columns in world axes need no further rotation
    axes = {"R": R}
    if world:
        inertia = composite.only("h", "I")
        draft.step(rotations.world_composite, axes, inertia, **inertia)
        axes = {"R": draft.fixed("identity", IDENTITY)}
    if not tail.fixed:
        base = {f"H_{r}": H.part(r * row, TORSO_NV) for r in range(TORSO_NV)}
        draft.step(torso.mass_matrix_base, axes, composite, **base)

    # coupling of torso and tail, and the upper triangle of the tail
    with draft.loop("k", tail.nt) as k:
        if not tail.fixed:
            lower = H.part((TORSO_NV + k) * row, TORSO_NV)
            upper = H.part(TORSO_NV + k, TORSO_NV, stride=row)
            column = {"column": column_of(columns, k)}
            draft.step(torso.mass_matrix_column, axes, column, H_row=lower, H_column=upper)
        with draft.loop("l", k) as other:
            draft.copy(H_tail(other, k), H_tail(k, other))
    return segments, R


def assemble_inverse_dynamics(draft: Draft, arrays: dict[str, Array], world: bool = False) -> None:
    """H v_dot + C by Newton and Euler (Eq. 4); C (Eq. 3) without ``v_dot`` among the arguments."""
    force, v_dot = arrays["force"], arrays.get("v_dot")
    state = draft.state(arrays["q"], arrays["v"])
    unmoved = draft.fixed("still", [0, 0, 0])
    R = attitude(draft, state)
    segments = prepared(draft, state)
    motion = _torso_motion(draft, state, R, v_dot, unmoved)
    inertial_forces(draft, segments, motion, v_dot, force, arrays.get("given_torques"))
    add_passive_forces(draft, state, lambda i: draft.tail.segment_v(force, i), v_dot)

    # forces on p_dot act in world axes
    if draft.tail.fixed:
        return
    for part in (VELOCITY, OMEGA) if world else (VELOCITY,):
        vector = block(force, part)
        draft.step(rotations.world_vector, {"R": R, "vector": vector}, vector=vector)


def _torso_motion(draft: Draft, state: State, R: Ref, v_dot: Array | None, unmoved: Ref) -> Motion:
    """Return the torso's motion in its own axes; gravity is an acceleration of it."""
    p_ddot = draft.of_torso(v_dot, VELOCITY) if v_dot else unmoved
    a = draft.store(torso.torso_acceleration, {"R": R, "p_ddot": p_ddot}, a=3)["a"]
    w_dot = draft.of_torso(v_dot, OMEGA) if v_dot else unmoved
    return Motion(state.omega, w_dot, a, airspeed(draft, state, R))


def assemble_mount_wrench(draft: Draft, arrays: dict[str, Array]) -> None:
    """Minus the wrench that the tail's motion needs at its mount (A1 to A12)."""
    state, v_dot = draft.state(arrays["q"], arrays["v"]), arrays["v_dot"]
    R = attitude(draft, state)
    motion = _torso_motion(draft, state, R, v_dot, draft.zero(3))
    with draft.on(draft.tail.chains[0]):
        segments = mechanism(draft).prepare(draft, state.on(draft.tail), False)
        total = gather_wrenches(draft, segments, forward_wrenches(draft, segments, motion, v_dot))
    writes = {name: arrays[name][0] for name in ("mount_force", "mount_moment")}
    draft.step(torso.wrench_on_torso, total, **writes)


# ---- forward dynamics ----------------------------------------------------------------------------


def assemble_forward_dynamics(draft: Draft, arrays: dict[str, Array]) -> FactoredDynamics:
    """v_dot from Eq. 1, H v_dot + C = [0; tau] + J^T f: translation eliminated, then LDL^T for
    omega_dot and q_t_ddot.
    """
    factored = factored_dynamics(draft, arrays["q"], arrays["v"])
    applied, torques = applied_load(draft, arrays, factored.R)
    factored.solve(factored.loads(applied, torques), arrays["v_dot"])
    return factored


def assemble_acceleration(draft: Draft, arrays: dict[str, Array]) -> None:
    """v_dot alone: H is not formed if the draft goes by segments."""
    if draft.dynamics != "segments":
        assemble_forward_dynamics(draft, arrays)
        return
    R = attitude(draft, draft.state(arrays["q"]))
    accelerate_by_segments(draft, arrays, *applied_load(draft, arrays, R))


def accelerate_by_segments(
    draft: Draft, arrays: dict[str, Array], applied: Vectors, torques: Array
) -> None:
    """Compute v_dot from ``load_force, load_moment`` at B in torso axes and torques."""
    load = draft.array("load_at_torso", 6)
    for k, name in enumerate(("load_force", "load_moment")):
        draft.copy(load.part(3 * k, 3), applied[name])
    arguments = {name: arrays[name] for name in ("q", "v", "v_dot")}
    inner = assemble(SEGMENT_DYNAMICS, draft.tail)
    draft.call(inner, at_torso=load, torques=torques, **arguments)


def assemble_segment_dynamics(draft: Draft, arrays: dict[str, Array]) -> None:
    """v_dot from loads at B and torques, by segments."""
    state = draft.state(arrays["q"], arrays["v"])
    forward_dynamics(draft, state, arrays["at_torso"], arrays["torques"], arrays["v_dot"])


def applied_load(draft: Draft, arrays: dict[str, Array], R: Ref) -> tuple[Vectors, Array]:
    """Return ``load_force, load_moment`` of external loads at B in torso axes, and the torques of
    actuators and loads minus those of the passive tail.
    """
    tau = net_torques(draft, draft.state(arrays["q"], arrays["v"]), arrays["tau"])
    if "f_ext" not in arrays:
        unloaded = draft.fixed("unloaded", [0, 0, 0])
        return Vectors(dict.fromkeys(("load_force", "load_moment"), unloaded)), tau
    torques = copied_torques(draft, tau)
    state = draft.state(arrays["q"])
    return gather_loads(draft, state, R, arrays["f_ext"], torques), torques


def copied_torques(draft: Draft, tau: Array) -> Array:
    """Return a copy of torques, to which others can be added."""
    torques = draft.array("applied", draft.tail.nt)
    with draft.loop("k", draft.tail.nt) as k:
        draft.copy(torques.part(k, 1), tau.part(k, 1))
    return torques


# ---- momentum and energy -------------------------------------------------------------------------


def assemble_momentum(draft: Draft, arrays: dict[str, Array]) -> None:
    """Momentum, and angular momentum about the COM; the sweep uses the motion relative to B."""
    state = draft.state(arrays["q"], arrays["v"])
    unmoved = draft.fixed("still", [0, 0, 0])
    R = attitude(draft, state)
    momentum = gather_momentum(draft, state, R, unmoved)
    writes = {name: arrays[name][0] for name in ("linear", "angular")}
    draft.step(torso.momentum_at_com, state.torso(R), momentum, **writes)


def assemble_energy(draft: Draft, arrays: dict[str, Array]) -> None:
    """Kinetic energy link by link, potential energy of the COM's height and of the passive tail."""
    state = draft.state(arrays["q"], arrays["v"])
    R = attitude(draft, state)
    moment = gather_kinetic(draft, state, R, arrays["kinetic"][0])
    add_rotor_energy(draft, state, arrays["kinetic"][0])
    potential = arrays["potential"][0]
    draft.step(torso.potential_energy, state.torso(R), moment, potential=potential)
    add_elastic_energy(draft, state, potential)


SEGMENT_DYNAMICS = Function(
    "segment_dynamics",
    "v_dot from loads, segment by segment as articulated bodies",
    (
        Q,
        V,
        Argument("at_torso", (6,), "force and moment at B, torso axes"),
        replace(TAU, name="torques"),
    ),
    (V_DOT,),
    assemble_segment_dynamics,
)
ASSEMBLIES: dict[str, Assembly] = {
    "mass_matrix": assemble_mass_matrix,
    "bias_force": assemble_inverse_dynamics,
    "inverse_dynamics": assemble_inverse_dynamics,
    "forward_dynamics": assemble_acceleration,
    "forward_dynamics_external": assemble_acceleration,
    "energy": assemble_energy,
    "momentum": assemble_momentum,
    "mass_matrix_world": partial(assemble_mass_matrix, world=True),
    "mount_wrench": assemble_mount_wrench,
    "bias_force_world": partial(assemble_inverse_dynamics, world=True),
}
