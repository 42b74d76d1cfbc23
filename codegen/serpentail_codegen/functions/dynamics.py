"""Mass matrix, inverse and forward dynamics, energy and momentum."""

from collections.abc import Callable
from dataclasses import dataclass, replace

from ..ir.program import Array, Index, Ref, padded
from ..mechanics import rotations, torso, translation
from .arguments import TAU, V_DOT, Q, V
from .draft import Draft
from .function import Argument, Function, assemble
from .layout import OMEGA, TORSO_NV, VELOCITY, block, segment_v, tail_v
from .scope import Instead, Motion, Scope, State, Vectors
from .sweeps import sweeps
from .sweeps.columns import factored_dynamics_by_columns
from .sweeps.segments import forward_dynamics
from .sweeps.sweeps import column_of, mechanism
from .tails.mechanism import Segments

# ---- H and C -------------------------------------------------------------------------------------


def assemble_mass_matrix(draft: Draft, arrays: dict[str, Array], world: bool = False) -> None:
    """H (Eq. 2), both triangles."""
    fill_mass_matrix(draft, State(arrays["q"]), arrays["H"], draft.tail.nv, world)


def fill_mass_matrix(
    draft: Draft, state: State, H: Array, row: int, world: bool = False
) -> tuple[Segments, Ref]:
    """H (Eq. 2), both triangles; its rows are ``row`` apart.  Returns segments and attitude."""
    tail, R = draft.tail, sweeps.attitude(draft, state)

    def H_tail(k: Index, other: Index, size: int = 1) -> Ref:
        return H.part((TORSO_NV + k) * row + TORSO_NV + other, size)

    columns = draft.array("columns", 12, tail.segments)
    along = R if world else None
    segments, composite = sweeps.tail_inertia(draft, state, H_tail, columns, along)

    # with columns in world axes all is there: nothing else has to be turned
    axes = {"R": R}
    if world:
        inertia = composite.only("h", "I")
        draft.step(rotations.world_composite, axes, inertia, **inertia)
        axes = {"R": draft.fixed("identity", sweeps.IDENTITY)}
    base = {f"H_{r}": H.part(r * row, TORSO_NV) for r in range(TORSO_NV)}
    draft.step(torso.mass_matrix_base, axes, composite, **base)

    # coupling of torso and tail, and the upper triangle of the tail
    with draft.loop("k", tail.nt) as k:
        lower = H.part((TORSO_NV + k) * row, TORSO_NV)
        upper = H.part(TORSO_NV + k, TORSO_NV, stride=row)
        column = {"column": column_of(columns, k)}
        draft.step(torso.mass_matrix_column, axes, column, H_row=lower, H_column=upper)
        with draft.loop("l", k) as other:
            mirrored = H.part((TORSO_NV + other) * row + TORSO_NV + k, 1)
            draft.copy(mirrored, H_tail(k, other))
    return segments, R


def assemble_inverse_dynamics(draft: Draft, arrays: dict[str, Array], world: bool = False) -> None:
    """H v_dot + C by Newton and Euler (Eq. 4); C (Eq. 3) without ``v_dot`` among the arguments."""
    force, v_dot = arrays["force"], arrays.get("v_dot")
    state = State(arrays["q"], arrays["v"])
    unmoved = draft.fixed("still", [0, 0, 0])
    R = sweeps.attitude(draft, state)
    segments = mechanism(draft).prepare(draft, state, False)

    # gravity is an acceleration of the torso
    p_ddot = block(v_dot, VELOCITY) if v_dot else unmoved
    a = draft.store(torso.torso_acceleration, {"R": R, "p_ddot": p_ddot}, a=3)["a"]
    motion = Motion(state.omega, block(v_dot, OMEGA) if v_dot else unmoved, a)
    inertial_forces(draft, segments, motion, v_dot, force)

    # forces on p_dot act in world axes
    for part in (VELOCITY, OMEGA) if world else (VELOCITY,):
        vector = block(force, part)
        draft.step(rotations.world_vector, {"R": R, "vector": vector}, vector=vector)


def inertial_forces(
    draft: Draft, segments: Segments, motion: Motion, v_dot: Array | None, force: Array
) -> None:
    """Generalised forces of a motion of the torso and ``v_dot`` of the tail, in torso axes."""
    wrenches = sweeps.forward_wrenches(draft, segments, motion, v_dot)
    total = sweeps.gather_wrenches(draft, segments, wrenches, lambda i: segment_v(force, i))
    sweeps.torso_wrench(draft, motion, total, force)


# ---- forward dynamics ----------------------------------------------------------------------------


def assemble_factored_dynamics(draft: Draft, arrays: dict[str, Array]) -> None:
    """What H v_dot + C = loads is solved with: H without translation, factored, and C without
    gravity.
    """
    tail, A, bias = draft.tail, arrays["A"], arrays["bias"]
    state, size = State(arrays["q"], arrays["v"]), 3 + tail.nt
    row = padded(size)

    def entry(r: Index | int, column: Index | int, entries: int = 1) -> Ref:
        return A.part(r * row + column, entries)

    def A_tail(k: Index, other: Index, entries: int = 1) -> Ref:
        return entry(3 + k, 3 + other, entries)

    attitude = {"quaternion": state.quaternion}
    draft.step(rotations.quaternion_rotation, attitude, R=arrays["R"].part(0, 9))
    if draft.dynamics != "composite":
        factored_dynamics_by_columns(draft, arrays, entry)
        draft.factor(A, size)
        return
    columns = arrays["columns"]
    segments, composite = sweeps.tail_inertia(draft, state, A_tail, columns)
    draft.copy(arrays["first_moment"].part(0, 3), composite["h"])
    sweeps.core_bias(draft, segments, bias)

    # eliminate translation: from the torso's rows, then from those of the tail
    names = ("inverse_mass", "com")
    center = Vectors({name: arrays[name].part(0, arrays[name].length) for name in names})
    rows = {f"A_{r}": entry(r, 0, r + 1) for r in range(3)}
    draft.step(translation.without_translation, composite, **center, **rows)
    with draft.loop("k", tail.nt) as k:
        column = {"column": column_of(columns, k)}
        coupling = entry(3 + k, 0, 3)
        draft.step(translation.column_without_translation, center, column, A_row=coupling)
        with draft.loop("l", k + 1) as other:
            pair = column | {"other": column_of(columns, other)}
            step = translation.pair_without_translation
            draft.step(step, center, pair, A_entry_=A_tail(k, other))
    draft.factor(A, size)


def factored_dynamics(draft: Draft, q: Array, v: Array) -> "FactoredDynamics":
    """Call the function that factors H, and return what it gives."""
    arrays = {a.name: draft.array(a.name, a.length(draft.tail)) for a in FACTORED_DYNAMICS.outputs}
    draft.call(assemble(FACTORED_DYNAMICS, draft.tail, draft.dynamics), q=q, v=v, **arrays)
    bias, names = arrays["bias"], ("R", "inverse_mass", "com")
    body = {name: arrays[name].part(0, arrays[name].length) for name in names}
    body["h"] = arrays["first_moment"].part(0, 3)
    return FactoredDynamics(arrays["A"], arrays["columns"], bias, Vectors(body))


@dataclass(frozen=True)
class Loads:
    """What accelerates the animal: ``load_force, load_moment`` minus ``force, moment`` at B in
    torso axes, and torques.

    ``inertial(k)`` is taken from the torque ``tau(k)``; None stands for zero.  ``gravity`` is the
    parameter's, or what stands for it.
    """

    at_torso: Scope
    inertial: Callable[[Index], Ref] | None = None
    tau: Callable[[Index], Ref] | None = None
    gravity: Ref | None = None


@dataclass(frozen=True)
class FactoredDynamics:
    """H with translation eliminated, factored, the tail's momentum columns, and ``R``,
    ``inverse_mass``, ``com``, ``h``: all that solving H x = loads needs.
    """

    A: Array
    columns: Array
    bias: Array
    body: Vectors

    @property
    def R(self) -> Ref:
        """Attitude of the torso."""
        return self.body["R"]

    def loads(self, applied: Vectors, torques: Array) -> Loads:
        """Return the loads of forward dynamics: ``load_force, load_moment`` and torques."""
        bias = {"force": block(self.bias, VELOCITY), "moment": block(self.bias, OMEGA)}
        return Loads(
            Vectors({**applied, **bias}),
            lambda k: tail_v(self.bias, k),
            lambda k: torques.part(k, 1),
        )

    def solve(self, draft: Draft, loads: Loads, x: Array) -> None:
        """Solve for p_b_ddot (world), omega_dot and q_t_ddot."""
        lanes, zero, w_dot = x.lanes, draft.zero(1), block(x, OMEGA)

        # right-hand side, translation eliminated
        net = draft.wide(f"net_{x.name}", 3, lanes)[0]
        draft.step(translation.rotational_load, self.body, loads.at_torso, net=net, rhs=w_dot)
        with draft.loop("k", draft.tail.nt) as k:
            reads = {"column": column_of(self.columns, k), "net": net}
            reads["inertial"] = loads.inertial(k) if loads.inertial else zero
            reads["tau"] = loads.tau(k) if loads.tau else zero
            draft.step(translation.tail_load, self.body, reads, rhs=tail_v(x, k))
        draft.solve(self.A, x.part(OMEGA.start, 3 + draft.tail.nt))

        # the torso's acceleration follows from the others
        tail_force = draft.wide(f"tail_force_{x.name}", 3, lanes)[0]
        draft.fill(tail_force, 0)
        with draft.loop("k", draft.tail.nt) as k:
            reads = {"column": column_of(self.columns, k), "acceleration": tail_v(x, k)}
            draft.step(translation.column_acceleration, reads, tail_force_=tail_force)
        reads = {"net": net, "tail_force": tail_force, "w_dot": w_dot}
        gravity = Instead({"gravity": loads.gravity} if loads.gravity else {})
        step, p_ddot = translation.base_acceleration, block(x, VELOCITY)
        draft.step(step, self.body, reads, gravity, p_ddot=p_ddot)


def assemble_forward_dynamics(draft: Draft, arrays: dict[str, Array]) -> FactoredDynamics:
    """v_dot from Eq. 1, H v_dot + C = [0; tau] + J^T f: translation eliminated, then LDL^T for
    omega_dot and q_t_ddot.
    """
    factored = factored_dynamics(draft, arrays["q"], arrays["v"])
    applied, torques = applied_load(draft, arrays, factored.R)
    factored.solve(draft, factored.loads(applied, torques), arrays["v_dot"])
    return factored


def assemble_acceleration(draft: Draft, arrays: dict[str, Array]) -> None:
    """v_dot alone: H is not formed where the draft goes by segments."""
    if draft.dynamics != "segments":
        assemble_forward_dynamics(draft, arrays)
        return
    R = sweeps.attitude(draft, State(arrays["q"]))
    accelerate_by_segments(draft, arrays, *applied_load(draft, arrays, R))


def accelerate_by_segments(
    draft: Draft, arrays: dict[str, Array], applied: Vectors, torques: Array
) -> None:
    """v_dot from ``load_force, load_moment`` at B in torso axes and torques."""
    load = draft.array("load_at_torso", 6)
    for k, name in enumerate(("load_force", "load_moment")):
        draft.copy(load.part(3 * k, 3), applied[name])
    arguments = {name: arrays[name] for name in ("q", "v", "v_dot")}
    inner = assemble(SEGMENT_DYNAMICS, draft.tail)
    draft.call(inner, at_torso=load, torques=torques, **arguments)


def assemble_segment_dynamics(draft: Draft, arrays: dict[str, Array]) -> None:
    """v_dot from loads at B and torques, by segments."""
    state = State(arrays["q"], arrays["v"])
    forward_dynamics(draft, state, arrays["at_torso"], arrays["torques"], arrays["v_dot"])


def applied_load(draft: Draft, arrays: dict[str, Array], R: Ref) -> tuple[Vectors, Array]:
    """Return ``load_force, load_moment`` from outside, at B in torso axes, and the torques of
    actuators and loads together.
    """
    if "f_ext" not in arrays:
        unloaded = draft.fixed("unloaded", [0, 0, 0])
        return Vectors(dict.fromkeys(("load_force", "load_moment"), unloaded)), arrays["tau"]
    torques = copied_torques(draft, arrays["tau"])
    state = State(arrays["q"])
    return sweeps.gather_loads(draft, state, R, arrays["f_ext"], torques), torques


def copied_torques(draft: Draft, tau: Array) -> Array:
    """Return a copy of the actuators' torques, for others to be added."""
    torques = draft.array("applied", draft.tail.nt)
    with draft.loop("k", draft.tail.nt) as k:
        draft.copy(torques.part(k, 1), tau.part(k, 1))
    return torques


# ---- momentum and energy -------------------------------------------------------------------------


def assemble_momentum(draft: Draft, arrays: dict[str, Array]) -> None:
    """Momentum, and angular momentum about the COM; the sweep sees the motion relative to B."""
    state = State(arrays["q"], arrays["v"])
    unmoved = draft.fixed("still", [0, 0, 0])
    R = sweeps.attitude(draft, state)
    momentum = sweeps.gather_momentum(draft, state, R, unmoved)
    writes = {name: arrays[name][0] for name in ("linear", "angular")}
    draft.step(torso.momentum_at_com, state.torso(R), momentum, **writes)


def assemble_energy(draft: Draft, arrays: dict[str, Array]) -> None:
    """Kinetic energy link by link, potential energy of the COM's height."""
    state = State(arrays["q"], arrays["v"])
    R = sweeps.attitude(draft, state)
    moment = sweeps.gather_kinetic(draft, state, R, arrays["kinetic"][0])
    potential = arrays["potential"][0]
    draft.step(torso.potential_energy, state.torso(R), moment, potential=potential)


FACTORED_DYNAMICS = Function(
    "balance",
    "H with translation eliminated, factored, and C without gravity",
    (Q, V),
    (
        Argument("R", lambda t: (9,), "attitude"),
        Argument("inverse_mass", lambda t: (1,), "1 / M"),
        Argument("com", lambda t: (3,), "centre of mass from B, torso axes"),
        Argument("first_moment", lambda t: (3,), "M times it"),
        Argument("A", lambda t: (3 + t.nt, padded(3 + t.nt)), "L^T D L"),
        Argument("columns", lambda t: (t.nt, 6), "momentum of each tail coordinate at B"),
        Argument("bias", lambda t: (t.nv,), "force, moment, and the tail's forces"),
    ),
    assemble_factored_dynamics,
)
SEGMENT_DYNAMICS = Function(
    "segment_dynamics",
    "v_dot from loads, segment by segment as articulated bodies",
    (
        Q,
        V,
        Argument("at_torso", lambda t: (6,), "force and moment at B, torso axes"),
        replace(TAU, name="torques"),
    ),
    (V_DOT,),
    assemble_segment_dynamics,
)
