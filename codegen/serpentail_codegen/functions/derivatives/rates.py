"""Gradients of the rates of v and of the bristles by all that they depend on: its "causes".

With mu = H^-1 lambda, the gradient of lambda^T v_dot is that of -P, the virtual power P = mu^T (H
v_dot + C - J^T f) at fixed v_dot and mu. P has no solves, so it is differentiated as a whole.
"""

from dataclasses import replace

from serpentail_scene.layout import OMEGA
from serpentail_scene.signatures.arguments import BRISTLES, LEGS, MULTIPLIER, V_DOT, Argument, Q, V
from serpentail_scene.signatures.gradients import BRANCHES

from ...autodiff.reverse import adjoint_program
from ...ir.dataflow import inlined
from ...ir.program import Array
from ...mechanics import contact, rotations
from ...mechanics import rotation_derivatives as turns
from ..air import in_air
from ..contact import contact_load, gather_contact_loads, gather_points, press
from ..draft import Draft
from ..dynamics import assemble_forward_dynamics
from ..factored import factored_dynamics
from ..function import Assembly, Function, assemble, signed
from ..implicit.solve import assemble_solve
from ..layout import block
from ..sweeps.pieces import attitude
from ..tail import struct_parameters
from .differentiated import POWER, U_VIRTUAL, A, assemble_virtual_power
from .directions import in_tangent_space
from .jacobians import response, with_unit_quaternion
from .torso_axes import torso_axes

SLIPS = Argument("slips", ("bristles",), "weights of the bristles' rates")
FIXED = ("v_dot", "multiplier", "slips", "branches")  # arguments of P that are held


def assemble_power(draft: Draft, arrays: dict[str, Array]) -> None:
    """P - slips^T (rates of the bristles)."""
    tail, power, multiplier = draft.tail, arrays["power"][0], arrays["multiplier"]
    moving = {}
    if tail.widths:  # in torso axes, so that the velocity against the air turns with the torso
        R = attitude(draft, draft.state(arrays["q"], arrays["v"]))
        moving["v"] = in_air(draft, arrays["q"], arrays["v"], R)
    segments = assemble_virtual_power(draft, arrays | moving)
    if not tail.contacts:
        return

    # the load of the ground at B and on the tail
    state, torques = draft.state(arrays["q"], arrays["v"]), draft.array("torques", tail.nt)
    forces, rates = draft.array("forces", 3 * tail.points), draft.array("slip_rates", tail.bristles)
    R = attitude(draft, state)
    draft.fill(torques[0], 0)
    points = gather_points(draft, state, R, arrays, segments)
    press(draft, state.torso(R), points, arrays | {"forces": forces, "bristle_rates": rates})
    load = gather_contact_loads(draft, R, points, forces, torques)

    # its power
    virtual = {"u_virtual": arrays["u"][0], "w_virtual": block(multiplier, OMEGA)}
    draft.step(contact.load_power, load, virtual, power_=power)
    with draft.loop("i", tail.segments) as i:
        reads = {"torque": torques.part(2 * i, 2), "rate": tail.segment_v(multiplier, i)}
        draft.step(contact.taken_power, reads, power_=power)
    with draft.loop("k", tail.points) as k:
        reads = {"torque": rates.part(2 * k, 2), "rate": arrays["slips"].part(2 * k, 2)}
        draft.step(contact.taken_power, reads, power_=power)


def assemble_margins(draft: Draft, arrays: dict[str, Array]) -> None:
    """What changes sign where the force of each point has a kink."""
    state = draft.state(arrays["q"], arrays["v"])
    points = gather_points(draft, state, R := attitude(draft, state), arrays)
    drag = draft.store(contact.bristle_properties, drag=1)
    with draft.loop("k", draft.tail.points) as k:
        reads = {"bristle": arrays["bristles"].part(2 * k, 2)}
        writes = {"margin": arrays["margins"].part(3 * k, 3)}
        draft.step(contact.point_margins, state.torso(R), drag, points.motion(k), reads, **writes)


STATE = (Q, V, V_DOT, A, BRISTLES, LEGS, BRANCHES)
P = Function("motion_power", "P", (*STATE, MULTIPLIER, U_VIRTUAL, SLIPS), (POWER,), assemble_power)


def adjoints(
    draft: Draft, function: Function, given: str, arguments: dict[str, Array]
) -> dict[str, Array]:
    """Return the gradients of one weighted output of a function by its inputs and parameters, that
    of q in its tangent space. arguments: the inputs, and ``b_<output>``.
    """
    program, dq = assemble(function.of(draft.tail), draft.tail), draft.array("dq", draft.tail.nv)
    names = [a.name for a in program.arrays if a.role in ("input", "parameters")]
    inner = adjoint_program(program, [name for name in names if name not in FIXED], (given,))
    found = {a.name: draft.array(f"by_{a.name}", a.length) for a in inner.of_role("output")}
    draft.call(inner, **{a.name: arguments[a.name] for a in inner.of_role("input")}, **found)
    in_tangent_space(draft, arguments["q"], found["b_q"], dq)
    return {name.removeprefix("b_"): array for name, array in (found | {"b_q": dq}).items()}


def gathered(draft: Draft, gradient: Array, parts: dict[str, Array]) -> None:
    """Store the gradients by some causes, and zero for the others."""
    tail, first = draft.tail, 0
    sizes = {"q": tail.nv, "v": tail.nv, "tau": tail.nt, "bristles": tail.bristles}
    sizes |= {"legs": tail.leg_numbers} | {p.name: p.size for p in struct_parameters(tail)}
    draft.fill(gradient[0], 0)
    for name, size in sizes.items():
        if name in parts:
            draft.copy(gradient.part(first, size), parts[name].part(0, size))
        first += size


def assemble_rates_vjp(draft: Draft, arrays: dict[str, Array]) -> None:
    """Gradient of weights^T (v_dot, rates of the bristles)."""
    tail, weights, q = draft.tail, arrays["weights"], with_unit_quaternion(draft, arrays["q"])
    v_dot = draft.array("acceleration", tail.nv)
    given = arrays | {"q": q, "v_dot": v_dot}
    if tail.contacts:
        given["forces"] = draft.array("forces", 3 * tail.points)
        given["bristle_rates"] = draft.array("bristle_rates", tail.bristles)
        given["slips"] = draft.array("slips", tail.bristles)
        draft.copy(given["slips"][0], weights.part(tail.nv, tail.bristles))
        factored = factored_dynamics(draft, q, arrays["v"])
        load, torques = contact_load(draft, draft.state(q, arrays["v"]), factored.R, given)
        factored.solve(factored.loads(load, torques), v_dot)
    else:
        factored = assemble_forward_dynamics(draft, given)
    mu = response(draft, factored, weights)

    # minus the gradient of P; a and u are constant in the world while the torso turns
    axes = torso_axes(draft, q, v_dot, mu, factored.R)
    given |= axes.arrays() | {"multiplier": mu, "b_power": draft.constant("minus", [-1])}
    by = adjoints(draft, P, "power", given)
    turned = {"b_a": by["a"][0], "b_u": by["u"][0]}
    draft.step(turns.power_by_turn, axes.vectors(), turned, turn_=block(by["q"], OMEGA))
    if "gravity" in by:  # a = R^T (p_b_ddot + g z)
        reads = {"R": factored.R, "vector": by["a"][0]}
        draft.step(rotations.upward_part, reads, part_=by["gravity"][0])
    tau = draft.array("dtau", tail.nt)
    draft.copy(tau[0], tail.all_v(mu))
    gathered(draft, arrays["gradient"], by | {"tau": tau})


def assemble_margins_vjp(draft: Draft, arrays: dict[str, Array]) -> None:
    """Gradient of weights^T margins."""
    function = signed({"margins": assemble_margins})["margins"]
    given = {"q": with_unit_quaternion(draft, arrays["q"]), "b_margins": arrays["weights"]}
    gathered(draft, arrays["gradient"], adjoints(draft, function, "margins", arrays | given))


def transposed(name: str, assembly: Assembly, sides: tuple[str, ...], **names: str) -> Assembly:
    """Return the assembly of the transpose of a function that is linear in its sides: its reverse.

    names: those of arguments that have others here.
    """

    def assemble_transpose(draft: Draft, arrays: dict[str, Array]) -> None:
        function = signed({name: assembly})[name].of(draft.tail)
        program, given = assemble(function, draft.tail), [a.name for a in function.outputs]
        wanted = [a.name for a in function.inputs if a.name in sides]
        inner = adjoint_program(inlined(program), wanted, given)
        inner = replace(inner, arrays=tuple(a for a in inner.arrays if a.name not in sides))
        bound = (*inner.of_role("input"), *inner.of_role("output"))
        own = {a.name: a.name.removeprefix("b_") for a in bound}
        draft.call(inner, **{each: arrays[names.get(last, last)] for each, last in own.items()})

    return assemble_transpose


ASSEMBLIES = {
    "rates_vjp": assemble_rates_vjp,
    "rates_jvp": transposed(
        "rates_vjp", assemble_rates_vjp, ("weights",), weights="change", gradient="direction"
    ),
    "margins": assemble_margins,
    "margins_vjp": assemble_margins_vjp,
    "implicit_solve_transposed": transposed(
        "implicit_solve", assemble_solve, ("r_q", "r_v", "r_u")
    ),
}
