"""Exact first derivatives with respect to the parameters."""

from serpentail_scene.layout import VELOCITY

from ...autodiff.forward import tangent_program
from ...ir.program import Array
from ...mechanics import torso
from ..draft import Draft
from ..function import Function, assemble
from ..layout import block
from ..tail import struct_parameters
from .differentiated import CORE, FUNCTIONS
from .jacobians import forward_dynamics_first, minus


def assemble_inverse_dynamics_parameter_derivatives(draft: Draft, arrays: dict[str, Array]) -> None:
    """Tangents of H v_dot + C with respect to every parameter."""
    arguments = {name: arrays[name] for name in ("q", "v", "v_dot")}
    rows = parameter_tangents(draft, FUNCTIONS["inverse_dynamics"], arguments)
    spread_parameters(draft, rows, arrays["dparameters"])


def assemble_forward_dynamics_parameter_derivatives(draft: Draft, arrays: dict[str, Array]) -> None:
    """-H^-1 times the tangents of H v_dot + C with respect to every parameter, at fixed v_dot."""
    count = draft.tail.parameter_numbers
    factored, motion = forward_dynamics_first(draft, arrays)
    arguments = {name: arrays[name] for name in ("q", "v")} | motion
    # in torso axes gravity acts as an acceleration of a torso that moves; wind is of the world
    world = draft.tail.fixed or draft.tail.widths
    inner = FUNCTIONS["inverse_dynamics"] if world else CORE
    arguments = {a.name: arguments[a.name] for a in inner.inputs}
    rows = parameter_tangents(draft, inner, arguments)
    if draft.tail.widths and not draft.tail.fixed:
        force = block(rows, VELOCITY)
        draft.step(torso.torso_velocity, {"R": factored.R, "p_dot": force}, u=force)
    x = draft.wide("x", draft.tail.nv, count)
    gravity = None
    name, size = draft.gravity
    if name in draft.parameters and not world:
        # it is the first parameter: p_b_ddot changes by the same amount
        gravity = draft.wide("d_gravity_z", size, count)[0]
        draft.unit(gravity, 0)
    factored.solve(minus(draft, rows, gravity=gravity), x)
    spread_parameters(draft, x, arrays["dparameters"])


def parameter_tangents(draft: Draft, function: Function, arguments: dict[str, Array]) -> Array:
    """Return the tangents of a force with respect to every parameter: one lane for each number of
    the struct.
    """
    count, lane, tangents = draft.tail.parameter_numbers, 0, {}
    names = [p.name for p in struct_parameters(draft.tail)]
    inner = tangent_program(assemble(function, draft.tail), names, count)
    for p in struct_parameters(draft.tail):
        if any(a.name == f"d_{p.name}" for a in inner.arrays):
            tangents[f"d_{p.name}"] = draft.wide(f"d_{p.name}", p.size, count)
            draft.unit(tangents[f"d_{p.name}"][0], lane)
        lane += p.size
    rows = draft.wide("rows", draft.tail.nv, count)
    draft.call(inner, d_force=rows, **arguments, **tangents)
    return rows


def spread_parameters(draft: Draft, source: Array, dparameters: Array) -> None:
    """Copy rows to a matrix with a column for each number of the parameter struct."""
    count = draft.tail.parameter_numbers
    with draft.loop("row", draft.tail.nv) as row:
        draft.copy(dparameters.part(count * row, count), source.lane(row, 0, count))


ASSEMBLIES = {
    "inverse_dynamics_parameter_derivatives": assemble_inverse_dynamics_parameter_derivatives,
    "forward_dynamics_parameter_derivatives": assemble_forward_dynamics_parameter_derivatives,
}
