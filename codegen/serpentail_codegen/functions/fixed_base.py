"""Functions of a tail on a base that never moves: q, v and all forces are those of the tail alone.

The torso is at rest, with B at the world's origin and along the world's axes. Its mass, its motion
and the momentum of the whole animal are not computed.
"""

from dataclasses import replace
from functools import partial

from ..autodiff.forward import tangent_program
from ..ir.program import Array, Index, Ref, padded
from ..mechanics import fixed_base as resting
from .derivatives.by_parameters import parameter_tangents, spread_parameters
from .draft import Draft
from .fixed_base_values import ASSEMBLIES, whole_state, whole_v
from .function import Function, assemble, signed
from .implicit.factor import assemble_factor
from .implicit.solve import assemble_solve
from .layout import coordinates
from .passive import add_passive_forces
from .scope import Motion, State
from .sweeps.inertia import tail_inertia
from .sweeps.pieces import mechanism
from .sweeps.wrenches import forward_wrenches, gather_wrenches
from .tails.mechanism import Segments

MEANINGS = {
    "q": "tail coordinates (rad)",
    "v": "rates of the tail coordinates (rad/s)",
    "v_dot": "accelerations of the tail coordinates (rad/s^2)",
    "force": "generalised forces on the tail coordinates (N m)",
    "linear": "linear momentum of the tail (kg m/s, world)",
    "angular": "angular momentum of the tail about its own centre of mass (kg m^2/s, world)",
    "position": "position of the tail's centre of mass (m, world)",
    "velocity": "velocity of the tail's centre of mass, J v (m/s, world)",
    "J": "Jacobian of the tail's centre of mass, world",
    "r_q": "right-hand side for q",
    "k_q": "solution for q",
}


# ---- equation of motion --------------------------------------------------------------------------


def fill_inertia(draft: Draft, state: State, H: Array, row: int) -> Segments:
    """Fill the lower triangle of H of the tail, its rows ``row`` apart; return the segments."""

    def H_tail(k: Index, other: Index, size: int = 1) -> Ref:
        return H.part(k * row + other, size)

    columns = draft.array("columns", 12, draft.tail.segments)
    return tail_inertia(draft, state, H_tail, columns)[0]


def fill_forces(draft: Draft, segments: Segments, v_dot: Array | None, force: Array) -> None:
    """Fill H v_dot + C of the tail, or C, including the forces of its passive parts."""
    zero = draft.zero(3)
    motion = Motion(zero, zero, draft.store(resting.resting_acceleration, a=3)["a"])
    wrenches = forward_wrenches(draft, segments, motion, v_dot)
    gather_wrenches(draft, segments, wrenches, lambda i: coordinates(force, i))
    add_passive_forces(draft, segments.state, lambda i: coordinates(force, i))


def assemble_mass_matrix(draft: Draft, arrays: dict[str, Array]) -> None:
    """H of the tail (Eq. 16), both triangles."""
    nt, H = draft.tail.nt, arrays["H"]
    fill_inertia(draft, whole_state(draft, arrays), H, nt)
    with draft.loop("k", nt) as k, draft.loop("l", k) as other:
        draft.copy(H.part(nt * other + k, 1), H.part(nt * k + other, 1))


def assemble_inverse_dynamics(draft: Draft, arrays: dict[str, Array]) -> None:
    """H v_dot + C of the tail (Eq. 4); C without ``v_dot`` among the arguments."""
    segments = mechanism(draft).prepare(draft, whole_state(draft, arrays), False)
    v_dot = whole_v(draft, arrays["v_dot"]) if "v_dot" in arrays else None
    fill_forces(draft, segments, v_dot, arrays["force"])


def assemble_forward_dynamics(draft: Draft, arrays: dict[str, Array]) -> None:
    """v_dot of H v_dot + C = tau."""
    accelerate(draft, arrays)


def accelerate(draft: Draft, arrays: dict[str, Array]) -> Array:
    """Store v_dot of H v_dot + C = tau, by LDL^T; return the factored H."""
    nt = draft.tail.nt
    A, bias = draft.array("A", padded(nt), nt), draft.array("bias", nt)
    segments = fill_inertia(draft, whole_state(draft, arrays), A, padded(nt))
    fill_forces(draft, segments, None, bias)
    subtract(draft, arrays["tau"], bias, arrays["v_dot"])
    draft.factor(A, nt)
    draft.solve(A, arrays["v_dot"].part(0, nt))
    return A


def subtract(draft: Draft, tau: Array | None, force: Array, rest: Array) -> None:
    """Store torques minus forces, in all lanes; tau None stands for zero."""
    with draft.loop("k", draft.tail.nt) as k:
        torque = tau.part(k, 1) if tau else draft.zero(1)
        reads = {"tau": torque, "inertial": force.part(k, 1)}
        draft.step(resting.net_torque, reads, rest=rest.part(k, 1))


# ---- tracking, and implicit methods --------------------------------------------------------------


def assemble_pfl(draft: Draft, arrays: dict[str, Array]) -> None:
    """Torques H v_dot + C: on a fixed base they give exactly the wanted v_dot.

    If ``v_dot`` is among the arguments, it is these accelerations.
    """
    segments = mechanism(draft).prepare(draft, whole_state(draft, arrays), False)
    fill_forces(draft, segments, whole_v(draft, arrays["accelerations"]), arrays["tau"])
    if "v_dot" in arrays:
        nt = draft.tail.nt
        draft.copy(arrays["v_dot"].part(0, nt), arrays["accelerations"].part(0, nt))


def resting_inertia(
    draft: Draft, arrays: dict[str, Array], A: Array, row: int
) -> tuple[State, Segments, None]:
    """Fill H of the tail for implicit methods; return state and segments."""
    state = whole_state(draft, arrays)
    return state, fill_inertia(draft, state, A, row), None


# ---- derivatives ---------------------------------------------------------------------------------


def force_tangents(draft: Draft, arguments: dict[str, Array]) -> Array:
    """Return tangents of H v_dot + C: a lane for each coordinate, then for each rate."""
    nt = draft.tail.nt
    tangents = {f"d_{name}": draft.wide(f"d_{name}_unit", nt, 2 * nt) for name in ("q", "v")}
    for first, array in zip((0, nt), tangents.values(), strict=True):
        draft.unit(array.part(0, nt), first)
    inner = assemble(FUNCTIONS["inverse_dynamics"], draft.tail)
    rows = draft.wide("rows", nt, 2 * nt)
    inner = tangent_program(inner, ("q", "v"), 2 * nt)
    draft.call(inner, **arguments, **tangents, d_force=rows)
    return rows


def spread(draft: Draft, rows: Array, arrays: dict[str, Array]) -> None:
    """Copy lanes of rows to the matrices by q and by v."""
    nt = draft.tail.nt
    with draft.loop("row", nt) as row:
        for first, name in ((0, "dq"), (nt, "dv")):
            draft.copy(arrays[name].part(nt * row, nt), rows.lane(row, first, nt))


def assemble_inverse_dynamics_derivatives(draft: Draft, arrays: dict[str, Array]) -> None:
    """Tangents of H v_dot + C along all directions at once."""
    arguments = {name: arrays[name] for name in ("q", "v", "v_dot")}
    spread(draft, force_tangents(draft, arguments), arrays)


def assemble_forward_dynamics_derivatives(draft: Draft, arrays: dict[str, Array]) -> None:
    """-H^-1 times the tangents of H v_dot + C at fixed v_dot; with respect to tau, H^-1."""
    nt, v_dot = draft.tail.nt, draft.array("acceleration", draft.tail.nt)
    A = accelerate(draft, arrays | {"v_dot": v_dot})
    arguments = {"q": arrays["q"], "v": arrays["v"], "v_dot": v_dot}
    x, inverse = draft.wide("x", nt, 2 * nt), draft.wide("inverse", nt, nt)
    subtract(draft, None, force_tangents(draft, arguments), x)
    draft.solve(A, x.part(0, nt))
    spread(draft, x, arrays)
    draft.unit(inverse.part(0, nt), 0)
    draft.solve(A, inverse.part(0, nt))
    with draft.loop("row", nt) as row:
        draft.copy(arrays["dtau"].part(nt * row, nt), inverse.lane(row, 0, nt))


def assemble_inverse_dynamics_parameter_derivatives(draft: Draft, arrays: dict[str, Array]) -> None:
    """Tangents of H v_dot + C with respect to every parameter."""
    arguments = {name: arrays[name] for name in ("q", "v", "v_dot")}
    rows = parameter_tangents(draft, FUNCTIONS["inverse_dynamics"], arguments)
    spread_parameters(draft, rows, arrays["dparameters"])


def assemble_forward_dynamics_parameter_derivatives(draft: Draft, arrays: dict[str, Array]) -> None:
    """-H^-1 times the tangents of H v_dot + C with respect to every parameter."""
    nt, v_dot = draft.tail.nt, draft.array("acceleration", draft.tail.nt)
    A = accelerate(draft, arrays | {"v_dot": v_dot})
    arguments = {"q": arrays["q"], "v": arrays["v"], "v_dot": v_dot}
    x = draft.wide("x", nt, draft.tail.parameter_numbers)
    rows = parameter_tangents(draft, FUNCTIONS["inverse_dynamics"], arguments)
    subtract(draft, None, rows, x)
    draft.solve(A, x.part(0, nt))
    spread_parameters(draft, x, arrays["dparameters"])


def _named(function: Function) -> Function:
    """Return a function whose arguments are described as those of the tail alone."""
    inputs, outputs = (
        tuple(replace(a, meaning=MEANINGS.get(a.name, a.meaning)) for a in arguments)
        for arguments in (function.inputs, function.outputs)
    )
    return replace(function, inputs=inputs, outputs=outputs)


FUNCTIONS = {
    name: _named(function)
    for name, function in signed(
        {
            "mass_matrix": assemble_mass_matrix,
            "bias_force": assemble_inverse_dynamics,
            "inverse_dynamics": assemble_inverse_dynamics,
            "forward_dynamics": assemble_forward_dynamics,
            **ASSEMBLIES,
            "pfl": assemble_pfl,
            "tracked_dynamics": assemble_pfl,
            "implicit_factor": partial(assemble_factor, inertia=resting_inertia),
            "implicit_solve": assemble_solve,
            "inverse_dynamics_derivatives": assemble_inverse_dynamics_derivatives,
            "forward_dynamics_derivatives": assemble_forward_dynamics_derivatives,
            "inverse_dynamics_parameter_derivatives": (
                assemble_inverse_dynamics_parameter_derivatives
            ),
            "forward_dynamics_parameter_derivatives": (
                assemble_forward_dynamics_parameter_derivatives
            ),
        }
    ).items()
}
