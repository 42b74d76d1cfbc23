"""Exact first derivatives: a tail's sizes go in, loop nests of Jacobians and of products with them
come out.

Nothing depends on the position of B or on its velocity.
"""

from collections.abc import Callable

from ...autodiff.forward import tangent_program
from ...autodiff.reverse import adjoint_program
from ...ir.program import Array, Index, Ref
from ...mechanics import rotations, torso, translation
from ...scene.signatures.arguments import FORCE, MULTIPLIER, V_DOT, Argument, Q, V
from ..draft import Draft
from ..dynamics import Balance, Loads, assemble_forward_dynamics
from ..function import Function, assemble
from ..plain import FUNCTIONS
from ..sweeps import sweeps
from ..sweeps.sweeps import mechanism
from ..tail import struct_parameters
from .directions import Directions

POWER = Argument("power", (1,), "lambda^T (H v_dot + C)")


# ---- the functions that are differentiated -------------------------------------------------------


def assemble_core(d: Draft, arrays: dict[str, Array]) -> None:
    """H v_dot + C in torso axes throughout, v_dot[0:3] being R^T (p_b_ddot + g z): no attitude, no
    gravity.
    """
    v_dot, force = arrays["v_dot"], arrays["force"]
    mechanism(d).prepare(d)
    d.known |= {"w": d.known["omega"], "w_dot": v_dot.part(3, 3), "a": v_dot.part(0, 3)}
    wrench = sweeps.forward_wrenches(d, v_dot)
    sweeps.gather_wrenches(d, wrench, lambda i: force.part(6 + 2 * i, 2))
    d.step(torso.torso_wrench, force=force.part(0, 3), moment=force.part(3, 3))


def assemble_virtual_power(d: Draft, arrays: dict[str, Array]) -> None:
    """lambda^T (H v_dot + C) as one sum over the links, from the torso to the tip."""
    v_dot, multiplier = arrays["v_dot"], arrays["multiplier"]
    d.store(rotations.quaternion_rotation, R=9)
    mechanism(d).prepare(d)
    d.known |= {
        "w": d.known["omega"],
        "w_dot": v_dot.part(3, 3),
        "w_virtual": multiplier.part(3, 3),
    }
    d.known["p_ddot"] = v_dot.part(0, 3)
    d.store(torso.torso_acceleration, a=3)
    d.step(torso.torso_velocity, {"p_dot": multiplier.part(0, 3)}, u=d.vector("u_virtual", 3))
    sweeps.virtual_power(d, arrays["power"][0], multiplier, v_dot)


def assemble_inertia(d: Draft, arrays: dict[str, Array]) -> None:
    """The core at rest: H v_dot in torso axes."""
    d.at_rest, d.known["omega"] = True, d.zero(3)
    assemble_core(d, arrays)


CORE = Function("core", "H v_dot + C in torso axes", (Q, V, V_DOT), (FORCE,), assemble_core)
INERTIA = Function("inertia", "H v_dot in torso axes", (Q, V_DOT), (FORCE,), assemble_inertia)
VIRTUAL_POWER = Function(
    "virtual_power",
    "lambda^T (H v_dot + C)",
    (Q, V, V_DOT, MULTIPLIER),
    (POWER,),
    assemble_virtual_power,
)


# ---- Jacobians -----------------------------------------------------------------------------------


def with_unit_quaternion(d: Draft, q: Array) -> Array:
    """Return q with a unit quaternion, which turns are taken at: of any other, squares may
    overflow.
    """
    unit = d.array("q_unit", d.tail.nq)
    d.copy(unit.part(0, 3), q.part(0, 3))
    d.step(rotations.unit_quaternion, unit=unit.part(3, 4))
    d.copy(unit.part(7, d.tail.nt), q.part(7, d.tail.nt))
    d.known["quaternion"] = unit.part(3, 4)
    return unit


def assemble_inverse_dynamics_derivatives(d: Draft, arrays: dict[str, Array]) -> None:
    """Tangents of H v_dot + C along all directions at once."""
    directions = Directions(d.tail, ("turn", "omega"))
    inner = tangent_program(
        assemble(FUNCTIONS["inverse_dynamics"], d.tail),
        ("q", "v"),
        directions.count,
        directions.outward,
    )
    rows = d.wide("rows", d.tail.nv, directions.count)
    given = {"q": with_unit_quaternion(d, arrays["q"]), "v": arrays["v"], "v_dot": arrays["v_dot"]}
    d.call(inner, d_force=rows, **given, **directions.tangents(d))
    directions.spread(d, rows, arrays["dq"], arrays["dv"])


def forward_dynamics_first(d: Draft, arrays: dict[str, Array]) -> tuple[Balance, Array]:
    """Forward dynamics, then its acceleration with R^T (p_b_ddot + g z) in place of p_b_ddot."""
    v_dot, body = d.array("acceleration", d.tail.nv), d.array("body_acceleration", d.tail.nv)
    balance = assemble_forward_dynamics(d, arrays | {"v_dot": v_dot})
    d.step(torso.torso_acceleration, {"p_ddot": v_dot.part(0, 3)}, a=body.part(0, 3))
    d.copy(body.part(3, d.tail.nv - 3), v_dot.part(3, d.tail.nv - 3))
    return balance, body


def loads(d: Draft, **at_torso: Ref) -> dict[str, Ref]:
    """Loads at the torso of a system H x = loads; what is not named is zero."""
    zeros = dict.fromkeys(("force", "moment", "load_force", "load_moment"), d.zero(3))
    return zeros | {"gravity": d.zero(1)} | at_torso


def less(
    d: Draft, rows: Array, tau: Callable[[Index], Ref] | None = None, **at_torso: Ref
) -> Loads:
    """Loads of H x = tau - rows, rows being a change of H v_dot + C in torso axes."""
    at_torso = loads(d, force=rows.part(0, 3), moment=rows.part(3, 3), **at_torso)
    return Loads(at_torso, lambda k: rows.part(6 + k, 1), tau)


def assemble_forward_dynamics_derivatives(d: Draft, arrays: dict[str, Array]) -> None:
    """-H^-1 times the tangents of H v_dot + C at fixed v_dot; with respect to tau, columns of
    H^-1.
    """
    tail, nv = d.tail, d.tail.nv
    balance, body = forward_dynamics_first(d, arrays)
    directions = Directions(tail, ("omega",))
    inner = tangent_program(assemble(CORE, tail), ("q", "v"), directions.count, directions.outward)
    rows, x = d.wide("rows", nv, directions.count), d.wide("x", nv, directions.count)
    given = {name: arrays[name] for name in ("q", "v")}
    d.call(inner, d_force=rows, v_dot=body, **given, **directions.tangents(d))
    balance.solve(d, less(d, rows), x)
    directions.spread(d, x, arrays["dq"], arrays["dv"])
    turned = {f"row_{r}": arrays["dq"].part(nv * r + 3, 3) for r in range(3)}
    d.step(translation.turned_acceleration, {"a": body.part(0, 3)}, **turned)
    torques(d, balance, arrays["dtau"])


def torques(d: Draft, balance: Balance, dtau: Array) -> None:
    """Columns of H^-1 that belong to tau."""
    nt, nv = d.tail.nt, d.tail.nv
    unit, x = d.wide("unit_torque", nt, nt), d.wide("x_torque", nv, nt)
    d.unit(unit.part(0, nt), 0)
    balance.solve(d, Loads(loads(d), tau=lambda k: unit.part(k, 1)), x)
    with d.loop("row", nv) as r:
        d.copy(dtau.part(nt * r, nt), x.lane(r, 0, nt))


def assemble_inverse_dynamics_parameter_derivatives(d: Draft, arrays: dict[str, Array]) -> None:
    """Tangents of H v_dot + C with respect to every parameter."""
    rows = parameter_tangents(
        d, FUNCTIONS["inverse_dynamics"], {n: arrays[n] for n in ("q", "v", "v_dot")}
    )
    spread_parameters(d, rows, arrays["dparameters"])


def assemble_forward_dynamics_parameter_derivatives(d: Draft, arrays: dict[str, Array]) -> None:
    """-H^-1 times the tangents of H v_dot + C with respect to every parameter, at fixed v_dot."""
    count = d.tail.parameter_numbers
    balance, body = forward_dynamics_first(d, arrays)
    rows, x = (
        parameter_tangents(d, CORE, {"q": arrays["q"], "v": arrays["v"], "v_dot": body}),
        d.wide("x", d.tail.nv, count),
    )
    gravity = d.wide("d_gravity_z", 1, count)[0]
    d.unit(gravity, 0)  # it is the first parameter: p_b_ddot falls by as much
    balance.solve(d, less(d, rows, gravity=gravity), x)
    spread_parameters(d, x, arrays["dparameters"])


def parameter_tangents(d: Draft, function: Function, given: dict[str, Array]) -> Array:
    """Return the tangents of a force with respect to every parameter, a lane for each number of the
    struct.
    """
    count, lane, tangents = d.tail.parameter_numbers, 0, {}
    names = [p.name for p in struct_parameters(d.tail)]
    inner = tangent_program(assemble(function, d.tail), names, count)
    for p in struct_parameters(d.tail):
        if any(a.name == f"d_{p.name}" for a in inner.arrays):
            tangents[f"d_{p.name}"] = d.wide(f"d_{p.name}", p.size, count)
            d.unit(tangents[f"d_{p.name}"][0], lane)
        lane += p.size
    rows = d.wide("rows", d.tail.nv, count)
    d.call(inner, d_force=rows, **given, **tangents)
    return rows


def spread_parameters(d: Draft, source: Array, dparameters: Array) -> None:
    """Copy rows to a matrix with a column for each number of the parameter struct."""
    count = d.tail.parameter_numbers
    with d.loop("row", d.tail.nv) as row:
        d.copy(dparameters.part(count * row, count), source.lane(row, 0, count))


# ---- products with Jacobians ---------------------------------------------------------------------


def assemble_forward_dynamics_jvp(d: Draft, arrays: dict[str, Array]) -> None:
    """Directional derivative of v_dot."""
    nv = d.tail.nv
    balance, body = forward_dynamics_first(d, arrays)
    d_q, rows, x = d.array("d_q", d.tail.nq), d.array("rows", nv), arrays["dv_dot"]
    d.copy(d_q.part(7, d.tail.nt), arrays["dq"].part(6, d.tail.nt))
    inner = tangent_program(assemble(CORE, d.tail), ("q", "v"))
    d.call(inner, q=arrays["q"], v=arrays["v"], v_dot=body, d_q=d_q, d_v=arrays["dv"], d_force=rows)
    balance.solve(d, less(d, rows, lambda k: arrays["dtau"].part(k, 1)), x)
    reads = {"a": body.part(0, 3), "turn": arrays["dq"].part(3, 3), "p_ddot": x.part(0, 3)}
    d.step(translation.turning_acceleration, reads, p_ddot=x.part(0, 3))


def assemble_inverse_dynamics_vjp(d: Draft, arrays: dict[str, Array]) -> None:
    """Gradient of lambda^T (H v_dot + C), by one way out along the tail and one back."""
    inner = adjoint_program(assemble(VIRTUAL_POWER, d.tail), ("q", "v", "v_dot"), ("power",))
    one, gradient = d.constant("one", [1]), d.array("gradient", d.tail.nq)
    q = with_unit_quaternion(d, arrays["q"])
    given = {"q": q} | {name: arrays[name] for name in ("v", "v_dot", "multiplier")}
    d.call(inner, b_power=one, b_q=gradient, b_v=arrays["dv"], b_v_dot=arrays["dv_dot"], **given)
    in_tangent_space(d, gradient, arrays["dq"])


def in_tangent_space(d: Draft, gradient: Array, dq: Array) -> None:
    """Turn a gradient with respect to the numbers of q into one with respect to a velocity's
    directions.
    """
    d.copy(dq.part(0, 3), gradient.part(0, 3))
    d.step(rotations.turn_gradient, {"gradient": gradient.part(3, 4)}, turn=dq.part(3, 3))
    d.copy(dq.part(6, d.tail.nt), gradient.part(7, d.tail.nt))


def assemble_forward_dynamics_vjp(d: Draft, arrays: dict[str, Array]) -> None:
    """lambda^T times the Jacobian of v_dot: mu = H^-1 lambda, then minus the gradient of mu^T (H
    v_dot + C).
    """
    tail, multiplier = d.tail, arrays["multiplier"]
    v_dot, mu = (
        d.array("acceleration", tail.nv),
        d.array("response", tail.nv),
    )  # "mu" is a parameter of contact
    balance = assemble_forward_dynamics(d, arrays | {"v_dot": v_dot})
    d.step(torso.torso_velocity, {"p_dot": multiplier.part(0, 3)}, u=d.vector("pull", 3))
    at_torso = loads(d, load_force=d.known["pull"], load_moment=multiplier.part(3, 3))
    balance.solve(d, Loads(at_torso, tau=lambda k: multiplier.part(6 + k, 1)), mu)
    inner = adjoint_program(assemble(VIRTUAL_POWER, tail), ("q", "v"), ("power",))
    minus, gradient = d.constant("minus", [-1]), d.array("gradient", tail.nq)
    q = with_unit_quaternion(d, arrays["q"])
    given = {"q": q, "v": arrays["v"], "v_dot": v_dot, "multiplier": mu}
    d.call(inner, b_power=minus, b_q=gradient, b_v=arrays["dv"], **given)
    in_tangent_space(d, gradient, arrays["dq"])
    d.copy(arrays["dtau"].part(0, tail.nt), mu.part(6, tail.nt))


# ---- energy and momentum -------------------------------------------------------------------------


def assemble_energy_derivatives(d: Draft, arrays: dict[str, Array]) -> None:
    """Gradients of kinetic and potential energy."""
    q = with_unit_quaternion(d, arrays["q"])
    for name, wanted in (("kinetic", ("q", "v")), ("potential", ("q",))):
        inner = adjoint_program(assemble(FUNCTIONS["energy"], d.tail), wanted, (name,))
        gradient = d.array(f"{name}_gradient", d.tail.nq)
        given = {"q": q, "v": arrays["v"]} | (
            {"b_v": arrays["kinetic_dv"]} if "v" in wanted else {}
        )
        weight = {f"b_{name}": d.constant(f"one_{name}", [1]), "b_q": gradient}
        d.call(inner, **given, **weight)
        in_tangent_space(d, gradient, arrays[f"{name}_dq"])


def assemble_momentum_derivatives(d: Draft, arrays: dict[str, Array]) -> None:
    """Tangents of momentum and angular momentum along all directions at once."""
    directions = Directions(d.tail, ("turn", "p_dot", "omega"))
    inner = tangent_program(assemble(FUNCTIONS["momentum"], d.tail), ("q", "v"), directions.count)
    rows = {name: d.wide(f"{name}_rows", 3, directions.count) for name in ("linear", "angular")}
    outputs = {f"d_{name}": row for name, row in rows.items()}
    q = with_unit_quaternion(d, arrays["q"])
    d.call(inner, q=q, v=arrays["v"], **outputs, **directions.tangents(d))
    for name, row in rows.items():
        directions.spread(d, row, arrays[f"{name}_dq"], arrays[f"{name}_dv"])


ASSEMBLIES = {
    "inverse_dynamics_derivatives": assemble_inverse_dynamics_derivatives,
    "forward_dynamics_derivatives": assemble_forward_dynamics_derivatives,
    "inverse_dynamics_parameter_derivatives": assemble_inverse_dynamics_parameter_derivatives,
    "forward_dynamics_parameter_derivatives": assemble_forward_dynamics_parameter_derivatives,
    "inverse_dynamics_vjp": assemble_inverse_dynamics_vjp,
    "forward_dynamics_jvp": assemble_forward_dynamics_jvp,
    "forward_dynamics_vjp": assemble_forward_dynamics_vjp,
    "energy_derivatives": assemble_energy_derivatives,
    "momentum_derivatives": assemble_momentum_derivatives,
}
