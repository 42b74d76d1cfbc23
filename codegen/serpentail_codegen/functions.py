"""The functions a scene can ask for: a tail's sizes go in, the loop nest of each function comes out."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from math import prod

from . import sweeps
from .draft import Draft, Tail
from .ir.program import Array, Index, Program, Ref, padded
from .lane_sweeps import balance_in_lanes
from .mechanics import loads, rotations, torso, translation
from .parameters import Parameter
from .scene import Scene, parameters_of
from .segment_sweeps import accelerate
from .sweeps import column_of, mechanism


@dataclass(frozen=True)
class Argument:
    """One array argument of a function: its shape from the tail's sizes, and what it means."""

    name: str
    shape: Callable[[Tail], tuple[int, ...]]
    meaning: str

    def length(self, tail: Tail) -> int:
        """Number of scalars."""
        return prod(self.shape(tail))


Q = Argument(
    "q", lambda t: (t.nq,), "configuration: position of B (m, world), quaternion w x y z, tail coordinates (rad)"
)
V = Argument(
    "v", lambda t: (t.nv,), "velocity: of B (m/s, world), omega (rad/s, body), rates of the tail coordinates (rad/s)"
)
V_DOT = Argument("v_dot", lambda t: (t.nv,), "time derivative of v")
TAU = Argument("tau", lambda t: (t.nt,), "torques (N m), conjugate to the tail coordinates")
F_EXT = Argument(
    "f_ext",
    lambda t: (6 + 3 * (t.total + 1),),
    "force at B (N, world), moment (N m, body), then a force (N, world) at each of the N + 1 tail points",
)
GENERALISED = "generalised force: on p_dot (N, world), on omega (N m, body), on the rates of the tail coordinates (N m)"


@dataclass(frozen=True)
class Function:
    """A function that a scene can ask for: name, arguments, and how to assemble it."""

    name: str
    doc: str
    inputs: tuple[Argument, ...]
    outputs: tuple[Argument, ...]
    assemble: Callable[[Draft, dict[str, Array]], None]

    def of(self, tail: Tail) -> "Function":
        """Return this function with the arguments that a tail has: those of a length."""
        inputs, outputs = (tuple(a for a in some if a.length(tail)) for some in (self.inputs, self.outputs))
        return replace(self, inputs=inputs, outputs=outputs)


def struct_parameters(model: Tail | Scene) -> tuple[Parameter, ...]:
    """Return the parameters that the functions of a model read: the fields of its struct."""
    return tuple(p for p in parameters_of(model.kind, model.contacts) if p.name != "link_radius")


def program(function: Function, tail: Tail, dynamics: str = "composite") -> Program:
    """Assemble one function for given sizes; other ``dynamics`` where vectors hold several numbers and tails are long.

    What they do not apply to is the same in all.
    """
    dynamics = dynamics if tail.kind == "articulated" else "composite"
    draft = Draft(function.name, function.doc, tail=tail, dynamics=dynamics)
    for parameter in struct_parameters(tail):
        draft.known[parameter.name] = draft.array(parameter.name, parameter.size, role="parameters")[0]
    arrays = {a.name: draft.array(a.name, a.length(tail), role="input") for a in function.inputs}
    arrays |= {a.name: draft.array(a.name, a.length(tail), role="output") for a in function.outputs}
    draft.known |= {a.name: arrays[a.name][0] for a in function.inputs}
    if "q" in arrays:
        draft.known |= {"p": arrays["q"].part(0, 3), "quaternion": arrays["q"].part(3, 4)}
    if "v" in arrays:
        draft.known |= {"p_dot": arrays["v"].part(0, 3), "omega": arrays["v"].part(3, 3)}
    function.assemble(draft, arrays)
    return draft.finish()


def assemble_mass_matrix(
    d: Draft, arrays: dict[str, Array], world: bool = False, apart: Callable[[int], int] = int
) -> None:
    """H, both triangles; its rows are ``apart(nv)`` apart."""
    H, row, tail = arrays["H"], apart(d.tail.nv), d.tail
    d.store(rotations.quaternion_rotation, R=9)

    def H_tail(k, other, size=1):
        return H.part((6 + k) * row + 6 + other, size)

    columns = sweeps.tail_inertia(d, H_tail, d.array("columns", 12, tail.segments), world)
    if world:
        composite = {name: d.known[name] for name in ("h", "I")}
        d.step(rotations.world_composite, **composite)
        d.known["R"] = d.constant("identity", sweeps.IDENTITY)[0]
    d.step(torso.mass_matrix_base, **{f"H_{r}": H.part(r * row, 6) for r in range(6)})
    with d.loop("k", tail.nt) as k:
        lower, upper = H.part((6 + k) * row, 6), H.part(6 + k, 6, stride=row)
        d.step(torso.mass_matrix_column, {"column": column_of(columns, k)}, H_row=lower, H_column=upper)
        with d.loop("l", k) as other:
            d.copy(H.part((6 + other) * row + 6 + k, 1), H_tail(k, other))


def assemble_inverse_dynamics(d: Draft, arrays: dict[str, Array], world: bool = False) -> None:
    """H v_dot + C by Newton and Euler; without ``v_dot`` among the arguments it is C."""
    force, v_dot = arrays["force"], arrays.get("v_dot")
    still = d.constant("still", [0, 0, 0])[0]
    d.store(rotations.quaternion_rotation, R=9)
    mechanism(d).prepare(d)
    d.known |= {"w": d.known["omega"], "w_dot": v_dot.part(3, 3) if v_dot else still}
    d.known["p_ddot"] = v_dot.part(0, 3) if v_dot else still
    d.store(torso.torso_acceleration, a=3)
    wrench = sweeps.forward_wrenches(d, v_dot)
    sweeps.gather_wrenches(d, wrench, lambda i: force.part(6 + 2 * i, 2))
    d.step(torso.torso_wrench, force=force.part(0, 3), moment=force.part(3, 3))
    d.step(rotations.world_vector, {"vector": force.part(0, 3)}, vector=force.part(0, 3))
    if world:
        d.step(rotations.world_vector, {"vector": force.part(3, 3)}, vector=force.part(3, 3))


def assemble_balance(d: Draft, arrays: dict[str, Array]) -> None:
    """What H v_dot + C = loads is solved with: H without translation, factored, and C without gravity."""
    tail, A, bias = d.tail, arrays["A"], arrays["bias"]
    size = 3 + tail.nt
    row = padded(size)

    def A_tail(k, other, entries=1):
        return A.part((3 + k) * row + 3 + other, entries)

    d.step(rotations.quaternion_rotation, R=arrays["R"].part(0, 9))
    if d.dynamics != "composite":
        balance_in_lanes(d, arrays, lambda k, other, entries=1: A.part(k * row + other, entries))
        d.factor(A, size)
        return
    columns = sweeps.tail_inertia(d, A_tail, arrays["columns"])
    d.copy(arrays["first_moment"].part(0, 3), d.known["h"])
    sweeps.core_bias(d, bias)
    d.known |= {name: arrays[name].part(0, arrays[name].length) for name in ("inverse_mass", "com")}
    rows = {f"A_{r}": A.part(r * row, r + 1) for r in range(3)}
    d.step(translation.without_translation, inverse_mass=d.known["inverse_mass"], com=d.known["com"], **rows)
    with d.loop("k", tail.nt) as k:
        column = column_of(columns, k)
        d.step(translation.column_without_translation, {"column": column}, A_row=A.part((3 + k) * row, 3))
        with d.loop("l", k + 1) as other:
            reads = {"column": column, "other": column_of(columns, other)}
            d.step(translation.pair_without_translation, reads, A_entry_=A_tail(k, other))
    d.factor(A, size)


def balanced(d: Draft, q: Array, v: Array) -> "Balance":
    """Call the balance, and let steps find by their names what it gives."""
    arrays = {a.name: d.array(a.name, a.length(d.tail)) for a in BALANCE.outputs}
    d.call(program(BALANCE, d.tail, d.dynamics), q=q, v=v, **arrays)
    bias = arrays["bias"]
    d.known |= {name: arrays[name].part(0, arrays[name].length) for name in ("R", "inverse_mass", "com")}
    d.known |= {"h": arrays["first_moment"].part(0, 3), "force": bias.part(0, 3), "moment": bias.part(3, 3)}
    return Balance(arrays["A"], arrays["columns"], bias)


def assemble_forward_dynamics(d: Draft, arrays: dict[str, Array]) -> "Balance":
    """v_dot from H v_dot + C = [0; tau] + J^T f: translation eliminated, then LDL^T for omega_dot and q_t_ddot."""
    balance = balanced(d, arrays["q"], arrays["v"])
    torques = applied_load(d, arrays)
    loads = Loads({}, lambda k: balance.bias.part(6 + k, 1), lambda k: torques.part(k, 1))
    balance.solve(d, loads, arrays["v_dot"])
    return balance


def assemble_acceleration(d: Draft, arrays: dict[str, Array]) -> None:
    """v_dot alone: H is not formed where the draft goes by segments."""
    if d.dynamics != "segments":
        assemble_forward_dynamics(d, arrays)
        return
    d.store(rotations.quaternion_rotation, R=9)
    accelerate_by_segments(d, arrays, applied_load(d, arrays))


def accelerate_by_segments(d: Draft, arrays: dict[str, Array], torques: Array) -> None:
    """v_dot from ``load_force, load_moment`` at B in torso axes and torques."""
    load = d.array("load_at_torso", 6)
    for k, name in enumerate(("load_force", "load_moment")):
        d.copy(load.part(3 * k, 3), d.known[name])
    arguments = {name: arrays[name] for name in ("q", "v", "v_dot")}
    d.call(program(SEGMENT_DYNAMICS, d.tail), at_torso=load, torques=torques, **arguments)


def assemble_segment_dynamics(d: Draft, arrays: dict[str, Array]) -> None:
    """v_dot from loads at B and torques, by segments."""
    accelerate(d, arrays["at_torso"], arrays["torques"], arrays["v_dot"])


@dataclass(frozen=True)
class Loads:
    """What accelerates the animal: ``load_force, load_moment`` less ``force, moment`` at B in torso axes, and torques.

    ``at_torso`` names these and ``gravity``, which else are those that steps find by these names.
    ``inertial(k)`` is taken from the torque ``tau(k)``; None stands for zero.
    """

    at_torso: dict[str, Ref]
    inertial: Callable[[Index], Ref] | None = None
    tau: Callable[[Index], Ref] | None = None


@dataclass(frozen=True)
class Balance:
    """H with translation eliminated, factored, and the tail's momentum columns: all that solving H x = loads needs."""

    A: Array
    columns: Array
    bias: Array

    def solve(self, d: Draft, loads: Loads, x: Array) -> None:
        """Solve for p_b_ddot (world), omega_dot and q_t_ddot."""
        size, lanes = 3 + d.tail.nt, x.lanes
        zero = d.zero(1)
        net = d.wide(f"net_{x.name}", 3, lanes)[0]
        d.step(translation.rotational_load, loads.at_torso, net=net, rhs=x.part(3, 3))
        with d.loop("k", d.tail.nt) as k:
            reads = {"column": column_of(self.columns, k), "net": net}
            reads["inertial"] = loads.inertial(k) if loads.inertial else zero
            reads["tau"] = loads.tau(k) if loads.tau else zero
            d.step(translation.tail_load, reads, rhs=x.part(6 + k, 1))
        d.solve(self.A, x.part(3, size))
        tail_force = d.wide(f"tail_force_{x.name}", 3, lanes)[0]
        d.fill(tail_force, 0)
        with d.loop("k", d.tail.nt) as k:
            reads = {"column": column_of(self.columns, k), "acceleration": x.part(6 + k, 1)}
            d.step(translation.column_acceleration, reads, tail_force_=tail_force)
        reads = {"net": net, "tail_force": tail_force, "w_dot": x.part(3, 3)}
        d.step(translation.base_acceleration, loads.at_torso | reads, p_ddot=x.part(0, 3))


def applied_load(d: Draft, arrays: dict[str, Array]) -> Array:
    """Loads from outside, at B in torso axes; returns the torques of actuators and loads together."""
    if "f_ext" not in arrays:
        d.known["load_force"] = d.known["load_moment"] = d.constant("unloaded", [0, 0, 0])[0]
        return arrays["tau"]
    torques = d.array("applied", d.tail.nt)
    with d.loop("k", d.tail.nt) as k:
        d.copy(torques.part(k, 1), arrays["tau"].part(k, 1))
    sweeps.gather_loads(d, arrays["f_ext"], torques)
    return torques


def assemble_momentum(d: Draft, arrays: dict[str, Array]) -> None:
    """Momentum, and angular momentum about the COM; the sweep sees the motion relative to B."""
    still = d.constant("still", [0, 0, 0])[0]
    d.store(rotations.quaternion_rotation, R=9)
    sweeps.gather_momentum(d, still)
    d.step(torso.momentum_at_com, linear=arrays["linear"][0], angular=arrays["angular"][0])


def assemble_energy(d: Draft, arrays: dict[str, Array]) -> None:
    """Kinetic energy link by link, potential energy of the COM's height."""
    d.store(rotations.quaternion_rotation, R=9)
    sweeps.gather_momentum(d, d.known["p_dot"], kinetic=arrays["kinetic"][0])
    d.step(torso.potential_energy, potential=arrays["potential"][0])


def assemble_tail_points(d: Draft, arrays: dict[str, Array]) -> None:
    """The joints and the tip, or equally spaced samples of every segment."""
    points, tail = arrays["points"], d.tail
    d.store(rotations.quaternion_rotation, R=9)
    mechanism(d).prepare_samples(d)
    here = sweeps.torso_pose(d, True, d.known["p"])
    d.copy(points.part(0, 3), here["P"])
    with d.loop("i", tail.segments) as i, d.loop("j", tail.links) as j:
        d.step(mechanism(d).pose, here | d.sample(i), **here)
        d.copy(points.part(3 * (tail.links * i + j + 1), 3), here["P"])


def assemble_tail_point_jacobians(d: Draft, arrays: dict[str, Array]) -> None:
    """d(point)/dt = J v for every tail point; arms start at B, so distance from the origin costs no accuracy."""
    J, tail = arrays["J"], d.tail
    d.store(rotations.quaternion_rotation, R=9)
    mechanism(d).prepare_samples(d)
    S = d.array("S", 12, tail.segments)
    here = sweeps.torso_pose(d, True)

    def row(point: Index, axis: int, first: Index | int, size: int):
        return J.part((3 * tail.nv) * point + axis * tail.nv + first, size)

    def base_rows(point: Index):
        d.fill(J.part((3 * tail.nv) * point, 3 * tail.nv), 0)
        for axis in range(3):
            d.fill(row(point, axis, axis, 1), 1)
        rows = {f"J_{name}": row(point, axis, 3, 3) for axis, name in enumerate("xyz")}
        d.step(loads.point_jacobian_base, {"arm": here["P"]}, **rows)

    base_rows(Index())
    with d.loop("i", tail.segments) as i:
        d.fill(S[i], 0)
        with d.loop("j", tail.links) as j:
            d.step(mechanism(d).twist, here | d.sample(i), S_=S[i])
            d.step(mechanism(d).pose, here | d.sample(i), **here)
            point = tail.links * i + j + 1
            base_rows(point)
            with d.loop("l", i + 1) as segment:
                rows = {f"J_{name}": row(point, axis, 6 + 2 * segment, 2) for axis, name in enumerate("xyz")}
                d.step(loads.point_jacobian_tail, {"S": S[segment], "arm": here["P"]}, **rows)


BALANCE = Function(
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
    assemble_balance,
)
SEGMENT_DYNAMICS = Function(
    "segment_dynamics",
    "v_dot from loads, segment by segment as articulated bodies",
    (Q, V, Argument("at_torso", lambda t: (6,), "force and moment at B, torso axes"), replace(TAU, name="torques")),
    (V_DOT,),
    assemble_segment_dynamics,
)
FORCE = Argument("force", lambda t: (t.nv,), GENERALISED)
H = Argument("H", lambda t: (t.nv, t.nv), "inertia matrix, symmetric positive definite (kg, kg m, kg m^2)")
POINTS = Argument("points", lambda t: (t.total + 1, 3), "joint positions, then the tip (m, world)")
JACOBIANS = Argument("J", lambda t: (t.total + 1, 3, t.nv), "d(point)/dt = J v")
KINETIC = Argument("kinetic", lambda t: (1,), "kinetic energy (J)")
POTENTIAL = Argument("potential", lambda t: (1,), "potential energy, zero at the height of the world's origin (J)")
LINEAR = Argument("linear", lambda t: (3,), "momentum (kg m/s, world)")
ANGULAR = Argument("angular", lambda t: (3,), "angular momentum about the centre of mass (kg m^2/s, world)")

_TABLE = (
    Function("mass_matrix", "H(q) of Eq. 2", (Q,), (H,), assemble_mass_matrix),
    Function("bias_force", "C(q, v) of Eq. 3, gravity included", (Q, V), (FORCE,), assemble_inverse_dynamics),
    Function("inverse_dynamics", "H v_dot + C", (Q, V, V_DOT), (FORCE,), assemble_inverse_dynamics),
    Function("forward_dynamics", "v_dot from Eq. 1", (Q, V, TAU), (V_DOT,), assemble_acceleration),
    Function(
        "forward_dynamics_external",
        "v_dot from Eq. 1, loads applied",
        (Q, V, TAU, F_EXT),
        (V_DOT,),
        assemble_acceleration,
    ),
    Function("energy", "kinetic and potential energy", (Q, V), (KINETIC, POTENTIAL), assemble_energy),
    Function("momentum", "linear and angular momentum", (Q, V), (LINEAR, ANGULAR), assemble_momentum),
    Function("tail_points", "Eqs. 13 to 15", (Q,), (POINTS,), assemble_tail_points),
    Function("tail_point_jacobians", "Eqs. A5 to A8", (Q,), (JACOBIANS,), assemble_tail_point_jacobians),
    Function(
        "mass_matrix_world",
        "H for (p_dot, omega in world axes, q_t_dot)",
        (Q,),
        (H,),
        partial(assemble_mass_matrix, world=True),
    ),
    Function(
        "bias_force_world",
        "C for (p_dot, omega in world axes, q_t_dot)",
        (Q, V),
        (FORCE,),
        partial(assemble_inverse_dynamics, world=True),
    ),
)
FUNCTIONS = {function.name: function for function in _TABLE}
