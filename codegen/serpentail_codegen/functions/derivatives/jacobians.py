"""Exact first derivatives: Jacobians, and products with them.

No result depends on the position of B, and without air none on its velocity.
"""

from collections.abc import Callable

from serpentail_scene.layout import OMEGA, POSITION, QUATERNION, VELOCITY

from ...autodiff.forward import tangent_program
from ...autodiff.reverse import adjoint_program
from ...ir.program import Array, Index, Ref
from ...mechanics import rotation_derivatives as turns
from ...mechanics import rotations, torso, translation
from ..air import in_air, move_in_air
from ..draft import Draft
from ..dynamics import assemble_forward_dynamics
from ..factored import FactoredDynamics, Loads
from ..function import assemble
from ..layout import block
from ..scope import Vectors
from ..sweeps.pieces import attitude
from ..tail import Tail
from .by_segments import derivatives_by_segments
from .differentiated import CORE, FUNCTIONS, VIRTUAL_POWER
from .directions import Directions, in_tangent_space
from .torso_axes import TorsoAxes, acceleration_at, torso_axes, turned_back

# ---- Jacobians -----------------------------------------------------------------------------------


def with_unit_quaternion(draft: Draft, q: Array) -> Array:
    """Return q with a unit quaternion, at which rotations are taken; squares of another one may
    overflow.
    """
    unit = draft.array("q_unit", draft.tail.nq)
    draft.copy(block(unit, POSITION), block(q, POSITION))
    quaternion = {"quaternion": block(q, QUATERNION)}
    draft.step(rotations.unit_quaternion, quaternion, unit=block(unit, QUATERNION))
    draft.copy(draft.tail.all_q(unit), draft.tail.all_q(q))
    return unit


def assemble_inverse_dynamics_derivatives(draft: Draft, arrays: dict[str, Array]) -> None:
    """Tangents of H v_dot + C along all directions at once, in torso axes."""
    tail, R = draft.tail, attitude(draft, draft.state(arrays["q"]))
    if tail.fixed:
        motion = {"v_dot": arrays["v_dot"], "a": acceleration_at(draft, R, arrays["v_dot"])}
        directions = Directions(tail, ())
        rows = core_rows(draft, directions, {"q": arrays["q"], "v": arrays["v"]} | motion)
        directions.spread(draft, rows, arrays["dq"], arrays["dv"])
        return
    directions = Directions(tail, ("turn", *drift(tail), "omega"))
    lanes, active = directions.count, ("q", "v", "a")
    a, turn = acceleration_at(draft, R, arrays["v_dot"]), directions.turn(draft)
    v = in_air(draft, arrays["q"], arrays["v"], R)
    inner = tangent_program(
        assemble(CORE, tail), active, lanes, directions.outward, kept=("force",)
    )
    force, rows = draft.array("force", tail.nv), draft.wide("rows", tail.nv, lanes)
    arguments = {"q": arrays["q"], "v": v, "v_dot": arrays["v_dot"], "a": a, "force": force}
    tangents = directions.tangents(draft) | {"d_a": turned_back(draft, a, turn)}
    move_in_air(draft, v, tangents["d_v"], R, turn)
    draft.call(inner, **arguments, **tangents, d_force=rows)

    # the force in world axes rotates with the torso
    change = block(rows, VELOCITY)
    reads = {"R": R, "force": block(force, VELOCITY), "turn": turn, "change": change}
    draft.step(turns.turning_force, reads, change=change)
    directions.spread(draft, rows, arrays["dq"], arrays["dv"])


def drift(tail: Tail) -> tuple[str, ...]:
    """Return the direction of the velocity of B if forces depend on it."""
    return ("p_dot",) if tail.widths else ()


def core_rows(
    draft: Draft, directions: Directions, arguments: dict[str, Array], R: Ref | None = None
) -> Array:
    """Return tangents of H v_dot + C in torso axes at fixed accelerations, as wide rows; R is the
    attitude of a torso that can turn.
    """
    lanes, tangents = directions.count, directions.tangents(draft)
    if R and "turn" in directions.torso:
        move_in_air(draft, arguments["v"], tangents["d_v"], R, directions.turn(draft))
    inner = tangent_program(assemble(CORE, draft.tail), ("q", "v"), lanes, directions.outward)
    rows = draft.wide("rows", draft.tail.nv, lanes)
    draft.call(inner, d_force=rows, **arguments, **tangents)
    return rows


def forward_dynamics_first(
    draft: Draft, arrays: dict[str, Array]
) -> tuple[FactoredDynamics, dict[str, Array]]:
    """Forward dynamics: what solves it, and ``v_dot`` and ``a`` = R^T (p_b_ddot + g z)."""
    v_dot = draft.array("acceleration", draft.tail.nv)
    factored = assemble_forward_dynamics(draft, arrays | {"v_dot": v_dot})
    return factored, {"v_dot": v_dot, "a": acceleration_at(draft, factored.R, v_dot)}


def loads_at_torso(draft: Draft, **loads: Ref) -> Vectors:
    """Return loads at the torso of a system H x = loads; those that are not given are zero."""
    names = ("force", "moment", "load_force", "load_moment")
    return Vectors(dict.fromkeys(names, draft.zero(3)) | loads)


def weightless(draft: Draft, tau: Callable[[Index], Ref] | None, **loads: Ref) -> Loads:
    """Return loads of a system H x = loads without gravity; those that are not given are zero."""
    return Loads(loads_at_torso(draft, **loads), tau=tau, gravity=draft.zero(draft.gravity[1]))


def minus(
    draft: Draft,
    rows: Array,
    tau: Callable[[Index], Ref] | None = None,
    gravity: Ref | None = None,
) -> Loads:
    """Return loads of H x = tau - rows, where rows are a change of H v_dot + C in torso axes."""
    change = {"force": draft.of_torso(rows, VELOCITY), "moment": draft.of_torso(rows, OMEGA)}
    at_torso, none = loads_at_torso(draft, **change), draft.zero(draft.gravity[1])
    return Loads(at_torso, lambda k: draft.tail.coordinate_v(rows, k), tau, gravity or none)


def assemble_forward_dynamics_derivatives(draft: Draft, arrays: dict[str, Array]) -> None:
    """-H^-1 times the tangents of H v_dot + C at fixed v_dot; with respect to tau, columns of
    H^-1.
    """
    if draft.dynamics == "segments":
        derivatives_by_segments(draft, arrays)
        return
    tail, nv = draft.tail, draft.tail.nv
    factored, motion = forward_dynamics_first(draft, arrays)
    turning = ("turn", "p_dot") if tail.widths else ()
    directions = Directions(tail, () if tail.fixed else (*turning, "omega"))
    x = draft.wide("x", nv, directions.count)
    v = in_air(draft, arrays["q"], arrays["v"], factored.R)
    rows = core_rows(draft, directions, {"q": arrays["q"], "v": v} | motion, factored.R)
    factored.solve(minus(draft, rows), x)
    directions.spread(draft, x, arrays["dq"], arrays["dv"])

    # how p_b_ddot moves with a rotation of the torso
    if not tail.fixed:
        adds = "_" if turning else ""
        turned = {f"row_{r}{adds}": arrays["dq"].part(nv * r + OMEGA.start, 3) for r in range(3)}
        reads = {"R": factored.R, "a": motion["a"][0]}
        draft.step(translation.turned_acceleration, reads, **turned)
    torque_columns(draft, factored, arrays["dtau"])


def torque_columns(draft: Draft, factored: FactoredDynamics, dtau: Array) -> None:
    """Store the columns of H^-1 that belong to tau."""
    nt, nv = draft.tail.nt, draft.tail.nv
    unit, x = draft.wide("unit_torque", nt, nt), draft.wide("x_torque", nv, nt)
    draft.unit(unit.part(0, nt), 0)
    factored.solve(weightless(draft, lambda k: unit.part(k, 1)), x)
    with draft.loop("row", nv) as r:
        draft.copy(dtau.part(nt * r, nt), x.lane(r, 0, nt))


# ---- products with Jacobians ---------------------------------------------------------------------


def assemble_forward_dynamics_jvp(draft: Draft, arrays: dict[str, Array]) -> None:
    """Directional derivative of v_dot."""
    tail = draft.tail
    factored, motion = forward_dynamics_first(draft, arrays)
    d_q, rows, x = draft.array("d_q", tail.nq), draft.array("rows", tail.nv), arrays["dv_dot"]
    draft.copy(tail.all_q(d_q), tail.all_v(arrays["dq"]))
    inner = tangent_program(assemble(CORE, tail), ("q", "v"))
    v, d_v = in_air(draft, arrays["q"], arrays["v"], factored.R), arrays["dv"]
    if tail.widths:
        d_v = draft.array("d_v", tail.nv)
        draft.copy(d_v.whole(), arrays["dv"].whole())
        move_in_air(draft, v, d_v, factored.R, block(arrays["dq"], OMEGA))
    arguments = {"q": arrays["q"], "v": v} | motion
    draft.call(inner, **arguments, d_q=d_q, d_v=d_v, d_force=rows)
    factored.solve(minus(draft, rows, lambda k: arrays["dtau"].part(k, 1)), x)

    # how p_b_ddot moves with a rotation of the torso
    p_ddot = block(x, VELOCITY)
    reads = {"a": motion["a"][0], "turn": block(arrays["dq"], OMEGA), "p_ddot": p_ddot}
    draft.step(translation.turning_acceleration, {"R": factored.R}, reads, p_ddot=p_ddot)


def assemble_inverse_dynamics_vjp(draft: Draft, arrays: dict[str, Array]) -> None:
    """Gradient of lambda^T (H v_dot + C), by one sweep outward along the tail and one back."""
    axes = torso_axes(draft, arrays["q"], arrays["v_dot"], arrays["multiplier"])
    arguments = {name: arrays[name] for name in ("q", "v_dot", "multiplier")}
    arguments["v"] = in_air(draft, arrays["q"], arrays["v"], axes.R)
    wanted = {"b_v": arrays["dv"], "b_v_dot": arrays["dv_dot"]}
    force = power_gradient(draft, axes, arguments, 1, arrays["dq"], wanted)
    vector = {"R": axes.R, "vector": force}
    draft.step(rotations.world_vector, vector, vector=block(arrays["dv_dot"], VELOCITY))


def power_gradient(
    draft: Draft,
    axes: TorsoAxes,
    arguments: dict[str, Array],
    weight: int,
    dq: Array,
    others: dict[str, Array],
) -> Ref:
    """Store the weighted gradient of lambda^T (H v_dot + C) by q in its tangent space, and others;
    return that by a.
    """
    tail, gradient = draft.tail, draft.array("gradient", draft.tail.nq)
    by = {f"b_{name}": draft.array(f"b_{name}", 3) for name in ("a", "u")}
    wanted = ("q", *(name.removeprefix("b_") for name in others), "a", "u")
    inner = adjoint_program(assemble(VIRTUAL_POWER, tail), wanted, ("power",))
    given = arguments | axes.arrays() | {"b_power": draft.constant("weight", [weight])}
    draft.call(inner, **given, b_q=gradient, **by, **others)

    draft.fill(block(dq, POSITION), 0)
    turned = {name: array[0] for name, array in by.items()}
    draft.step(turns.power_by_turn, axes.vectors(), turned, turn=block(dq, OMEGA))
    if tail.widths:
        by_u = block(others["b_v"], VELOCITY)
        reads = {"gradient": by_u, "vector": block(arguments["v"], VELOCITY)}
        draft.step(turns.term_by_turn, reads, turn_=block(dq, OMEGA))
        draft.step(rotations.world_vector, {"R": axes.R, "vector": by_u}, vector=by_u)
    draft.copy(tail.all_v(dq), tail.all_q(gradient))
    return by["b_a"][0]


def response(draft: Draft, factored: FactoredDynamics, weights: Array) -> Array:
    """Return mu = H^-1 lambda: the weights lambda of v_dot are a load at B and torques."""
    mu = draft.array("response", draft.tail.nv)
    pull, p_dot = draft.vector("pull", 3), block(weights, VELOCITY)
    draft.step(torso.torso_velocity, {"R": factored.R, "p_dot": p_dot}, u=pull)
    load = {"load_force": pull, "load_moment": block(weights, OMEGA)}
    factored.solve(weightless(draft, lambda k: draft.tail.coordinate_v(weights, k), **load), mu)
    return mu


def assemble_forward_dynamics_vjp(draft: Draft, arrays: dict[str, Array]) -> None:
    """lambda^T times the Jacobian of v_dot: mu = H^-1 lambda, then minus the gradient of mu^T (H
    v_dot + C).
    """
    tail, v_dot = draft.tail, draft.array("acceleration", draft.tail.nv)
    factored = assemble_forward_dynamics(draft, arrays | {"v_dot": v_dot})
    mu = response(draft, factored, arrays["multiplier"])

    # minus the gradient of mu^T (H v_dot + C)
    axes = torso_axes(draft, arrays["q"], v_dot, mu, factored.R)
    v = in_air(draft, arrays["q"], arrays["v"], axes.R)
    arguments = {"q": arrays["q"], "v": v, "v_dot": v_dot, "multiplier": mu}
    power_gradient(draft, axes, arguments, -1, arrays["dq"], {"b_v": arrays["dv"]})
    draft.copy(arrays["dtau"].part(0, tail.nt), tail.all_v(mu))


# ---- energy and momentum -------------------------------------------------------------------------


def assemble_energy_derivatives(draft: Draft, arrays: dict[str, Array]) -> None:
    """Gradients of kinetic and potential energy."""
    q = with_unit_quaternion(draft, arrays["q"])
    for name, wanted in (("kinetic", ("q", "v")), ("potential", ("q",))):
        inner = adjoint_program(assemble(FUNCTIONS["energy"], draft.tail), wanted, (name,))
        gradient = draft.array(f"{name}_gradient", draft.tail.nq)
        bound = {"q": q, "v": arrays["v"], "b_q": gradient}
        if "v" in wanted:
            bound["b_v"] = arrays["kinetic_dv"]
        bound[f"b_{name}"] = draft.constant(f"one_{name}", [1])
        draft.call(inner, **bound)
        in_tangent_space(draft, q, gradient, arrays[f"{name}_dq"])


def assemble_momentum_derivatives(draft: Draft, arrays: dict[str, Array]) -> None:
    """Tangents of momentum and angular momentum along all directions at once."""
    directions, function = Directions(draft.tail, ("turn", "p_dot", "omega")), FUNCTIONS["momentum"]
    inner = tangent_program(assemble(function, draft.tail), ("q", "v"), directions.count)
    names = ("linear", "angular")
    rows = {name: draft.wide(f"{name}_rows", 3, directions.count) for name in names}
    outputs = {f"d_{name}": row for name, row in rows.items()}
    q = with_unit_quaternion(draft, arrays["q"])
    draft.call(inner, q=q, v=arrays["v"], **outputs, **directions.tangents(draft, q))
    for name, row in rows.items():
        directions.spread(draft, row, arrays[f"{name}_dq"], arrays[f"{name}_dv"])


ASSEMBLIES = {
    "inverse_dynamics_derivatives": assemble_inverse_dynamics_derivatives,
    "forward_dynamics_derivatives": assemble_forward_dynamics_derivatives,
    "inverse_dynamics_vjp": assemble_inverse_dynamics_vjp,
    "forward_dynamics_jvp": assemble_forward_dynamics_jvp,
    "forward_dynamics_vjp": assemble_forward_dynamics_vjp,
    "energy_derivatives": assemble_energy_derivatives,
    "momentum_derivatives": assemble_momentum_derivatives,
}
