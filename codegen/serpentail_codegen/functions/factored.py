"""H with translation eliminated, factored: all functions that need v_dot solve with it."""

from collections.abc import Callable
from dataclasses import dataclass

from serpentail_scene.layout import OMEGA, VELOCITY
from serpentail_scene.signatures.arguments import Argument, Q, V

from ..ir.program import Array, Index, Ref
from ..mechanics import rotations, translation
from .air import airspeed
from .draft import Draft
from .function import Function, assemble
from .layout import block
from .scope import Instead, Scope, Vectors
from .sweeps.columns import factored_dynamics_by_columns
from .sweeps.inertia import Block, animal_inertia, column_of
from .sweeps.pieces import IDENTITY
from .sweeps.wrenches import core_bias

# ---- factoring -----------------------------------------------------------------------------------


def assemble_factored_dynamics(draft: Draft, arrays: dict[str, Array]) -> None:
    """The factors for H v_dot + C = loads: H without translation, factored, and C without
    gravity.
    """
    tail, A, bias = draft.tail, arrays["A"], arrays["bias"]
    state, size = draft.state(arrays["q"], arrays["v"]), tail.rotational
    row, before = tail.rotational_row, tail.rotational - tail.nt

    def entry(r: Index | int, column: Index | int, entries: int = 1) -> Ref:
        return A.part(r * row + column, entries)

    def A_tail(k: Index, other: Index, entries: int = 1) -> Ref:
        return entry(before + k, before + other, entries)

    if not tail.fixed:
        quaternion = {"quaternion": state.quaternion}
        draft.step(rotations.quaternion_rotation, quaternion, R=arrays["R"].part(0, 9))
    R = draft.fixed("identity", IDENTITY) if tail.fixed else arrays["R"].part(0, 9)
    u = airspeed(draft, state, R)
    if draft.dynamics != "composite":
        factored_dynamics_by_columns(draft, arrays, entry, u)
        draft.factor(A, size)
        return
    columns = arrays["columns"]
    segments, composite = animal_inertia(draft, state, A_tail, columns)
    if tail.fixed:
        core_bias(draft, segments, bias, u)
        draft.factor(A, size)
        return
    draft.copy(arrays["first_moment"].part(0, 3), composite["h"])
    core_bias(draft, segments, bias, u)

    names = ("inverse_mass", "com")
    center = Vectors({name: arrays[name].part(0, arrays[name].length) for name in names})
    eliminate_translation(draft, composite, center, columns, entry)
    draft.factor(A, size)


def eliminate_translation(
    draft: Draft, composite: Vectors, center: Vectors, columns: Array, entry: Block
) -> None:
    """Complete H without translation, whose block of the tail is stored: from the torso's rows,
    then from those of the tail; store ``inverse_mass, com``, too.
    """
    rows = {f"A_{r}": entry(r, 0, r + 1) for r in range(3)}
    draft.step(translation.without_translation, composite, **center, **rows)
    with draft.loop("k", draft.tail.nt) as k:
        column = {"column": column_of(columns, k)}
        coupling = entry(k + 3, 0, 3)
        draft.step(translation.column_without_translation, center, column, A_row=coupling)
        with draft.loop("l", k + 1) as other:
            pair = column | {"other": column_of(columns, other)}
            step = translation.pair_without_translation
            draft.step(step, center, pair, A_entry_=entry(k + 3, other + 3))


FACTORED_DYNAMICS = Function(
    "balance",
    "H with translation eliminated, factored, and C without gravity",
    (Q, V),
    (
        Argument("R", ("free", 9), "attitude"),
        Argument("inverse_mass", ("free",), "1 / M"),
        Argument("com", ("free", 3), "centre of mass from B, torso axes"),
        Argument("first_moment", ("free", 3), "M times it"),
        Argument("A", ("rotational", "rotational_row"), "L^T D L"),
        Argument("columns", ("nt", 6), "momentum of each tail coordinate at B"),
        Argument("bias", ("nv",), "force, moment, and the tail's forces"),
    ),
    assemble_factored_dynamics,
)


# ---- solving -------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Loads:
    """The loads that accelerate the animal: ``load_force, load_moment`` minus ``force, moment`` at
    B in torso axes, and torques.

    ``inertial(k)`` is subtracted from the torque ``tau(k)``; None stands for zero. ``gravity`` is
    the parameter, or a vector in its place.
    """

    at_torso: Scope
    inertial: Callable[[Index], Ref] | None = None
    tau: Callable[[Index], Ref] | None = None
    gravity: Ref | None = None


@dataclass(frozen=True)
class FactoredDynamics:
    """H with translation eliminated, factored, the momentum columns of the tail, and ``R``,
    ``inverse_mass``, ``com``, ``h``: everything that is needed to solve H x = loads.
    """

    draft: Draft
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
        draft, bias = self.draft, self.bias
        inertial = {
            "force": draft.of_torso(bias, VELOCITY),
            "moment": draft.of_torso(bias, OMEGA),
        }
        return Loads(
            Vectors({**applied, **inertial}),
            lambda k: draft.tail.coordinate_v(bias, k),
            lambda k: torques.part(k, 1),
        )

    def solve(self, loads: Loads, x: Array) -> None:
        """Solve for p_b_ddot (world), omega_dot and q_t_ddot; on a fixed base for q_t_ddot."""
        draft, tail, lanes = self.draft, self.draft.tail, x.lanes
        zero, w_dot = draft.zero(1), block(x, OMEGA)

        # right-hand side, translation eliminated
        net = draft.zero(3) if tail.fixed else draft.wide(f"net_{x.name}", 3, lanes)[0]
        if not tail.fixed:
            draft.step(translation.rotational_load, self.body, loads.at_torso, net=net, rhs=w_dot)
        with draft.loop("k", tail.nt) as k:
            reads = {"column": column_of(self.columns, k), "net": net}
            reads["inertial"] = loads.inertial(k) if loads.inertial else zero
            reads["tau"] = loads.tau(k) if loads.tau else zero
            draft.step(translation.tail_load, self.body, reads, rhs=tail.coordinate_v(x, k))
        draft.solve(self.A, x.part(tail.nv - tail.rotational, tail.rotational))
        if tail.fixed:
            return

        # the torso's acceleration follows from the others
        tail_force = draft.wide(f"tail_force_{x.name}", 3, lanes)[0]
        draft.fill(tail_force, 0)
        with draft.loop("k", tail.nt) as k:
            reads = {
                "column": column_of(self.columns, k),
                "acceleration": tail.coordinate_v(x, k),
            }
            draft.step(translation.column_acceleration, reads, tail_force_=tail_force)
        reads = {"net": net, "tail_force": tail_force, "w_dot": w_dot}
        given = None if tail.shape.weightless else loads.gravity
        gravity = Instead({draft.gravity[0]: given} if given else {})
        step, p_ddot = translation.base_acceleration, block(x, VELOCITY)
        draft.step(step, self.body, reads, gravity, p_ddot=p_ddot)


def factored_dynamics(draft: Draft, q: Array, v: Array) -> FactoredDynamics:
    """Call the function that factors H, and return what it gives."""
    function = FACTORED_DYNAMICS.of(draft.tail)
    arrays = {a.name: draft.array(a.name, a.length(draft.tail)) for a in function.outputs}
    dynamics = "composite" if draft.dynamics == "composite" else "lanes"  # segments have no H
    draft.call(assemble(function, draft.tail, dynamics), q=q, v=v, **draft.given, **arrays)
    if draft.tail.fixed:
        body = {"R": draft.fixed("identity", IDENTITY), "inverse_mass": draft.zero(1)}
    else:
        names = ("R", "inverse_mass", "com")
        body = {name: arrays[name].part(0, arrays[name].length) for name in names}
        body["h"] = arrays["first_moment"].part(0, 3)
    return FactoredDynamics(draft, arrays["A"], arrays["columns"], arrays["bias"], Vectors(body))
