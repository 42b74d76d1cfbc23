"""H with translation eliminated, factored: all functions that need v_dot solve with it."""

from collections.abc import Callable
from dataclasses import dataclass

from serpentail_scene.layout import OMEGA, VELOCITY
from serpentail_scene.signatures.arguments import Argument, Q, V

from ..ir.program import Array, Index, Ref, padded
from ..mechanics import rotations, translation
from .draft import Draft
from .function import Function, assemble
from .layout import block, tail_v
from .scope import Instead, Scope, State, Vectors
from .sweeps.columns import factored_dynamics_by_columns
from .sweeps.inertia import column_of, tail_inertia
from .sweeps.wrenches import core_bias

# ---- factoring -----------------------------------------------------------------------------------


def assemble_factored_dynamics(draft: Draft, arrays: dict[str, Array]) -> None:
    """The factors for H v_dot + C = loads: H without translation, factored, and C without
    gravity.
    """
    tail, A, bias = draft.tail, arrays["A"], arrays["bias"]
    state, size = State(arrays["q"], arrays["v"]), 3 + tail.nt
    row = padded(size)

    def entry(r: Index | int, column: Index | int, entries: int = 1) -> Ref:
        return A.part(r * row + column, entries)

    def A_tail(k: Index, other: Index, entries: int = 1) -> Ref:
        return entry(3 + k, 3 + other, entries)

    quaternion = {"quaternion": state.quaternion}
    draft.step(rotations.quaternion_rotation, quaternion, R=arrays["R"].part(0, 9))
    if draft.dynamics != "composite":
        factored_dynamics_by_columns(draft, arrays, entry)
        draft.factor(A, size)
        return
    columns = arrays["columns"]
    segments, composite = tail_inertia(draft, state, A_tail, columns)
    draft.copy(arrays["first_moment"].part(0, 3), composite["h"])
    core_bias(draft, segments, bias)

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


FACTORED_DYNAMICS = Function(
    "balance",
    "H with translation eliminated, factored, and C without gravity",
    (Q, V),
    (
        Argument("R", (9,), "attitude"),
        Argument("inverse_mass", (1,), "1 / M"),
        Argument("com", (3,), "centre of mass from B, torso axes"),
        Argument("first_moment", (3,), "M times it"),
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
        given = None if draft.tail.shape.weightless else loads.gravity
        gravity = Instead({"gravity": given} if given else {})
        step, p_ddot = translation.base_acceleration, block(x, VELOCITY)
        draft.step(step, self.body, reads, gravity, p_ddot=p_ddot)


def factored_dynamics(draft: Draft, q: Array, v: Array) -> FactoredDynamics:
    """Call the function that factors H, and return what it gives."""
    arrays = {a.name: draft.array(a.name, a.length(draft.tail)) for a in FACTORED_DYNAMICS.outputs}
    draft.call(assemble(FACTORED_DYNAMICS, draft.tail, draft.dynamics), q=q, v=v, **arrays)
    bias, names = arrays["bias"], ("R", "inverse_mass", "com")
    body = {name: arrays[name].part(0, arrays[name].length) for name in names}
    body["h"] = arrays["first_moment"].part(0, 3)
    return FactoredDynamics(arrays["A"], arrays["columns"], bias, Vectors(body))
