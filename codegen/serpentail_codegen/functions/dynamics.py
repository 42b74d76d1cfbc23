"""The functions a scene can ask for: a tail's sizes go in, the loop nest of each function comes
out.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

from ..ir.program import Array, Index, Ref, padded
from ..mechanics import rotations, torso, translation
from ..scene.signatures.arguments import TAU, V_DOT, Argument, Q, V
from .draft import Draft
from .function import Assembly, Function, assemble
from .sweeps import sweeps
from .sweeps.columns import balance_in_lanes
from .sweeps.segments import accelerate
from .sweeps.sweeps import column_of, mechanism


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
        d.step(
            torso.mass_matrix_column, {"column": column_of(columns, k)}, H_row=lower, H_column=upper
        )
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
    """What H v_dot + C = loads is solved with: H without translation, factored, and C without
    gravity.
    """
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
    d.step(
        translation.without_translation,
        inverse_mass=d.known["inverse_mass"],
        com=d.known["com"],
        **rows,
    )
    with d.loop("k", tail.nt) as k:
        column = column_of(columns, k)
        d.step(
            translation.column_without_translation,
            {"column": column},
            A_row=A.part((3 + k) * row, 3),
        )
        with d.loop("l", k + 1) as other:
            reads = {"column": column, "other": column_of(columns, other)}
            d.step(translation.pair_without_translation, reads, A_entry_=A_tail(k, other))
    d.factor(A, size)


def balanced(d: Draft, q: Array, v: Array) -> "Balance":
    """Call the balance, and let steps find by their names what it gives."""
    arrays = {a.name: d.array(a.name, a.length(d.tail)) for a in BALANCE.outputs}
    d.call(assemble(BALANCE, d.tail, d.dynamics), q=q, v=v, **arrays)
    bias = arrays["bias"]
    d.known |= {
        name: arrays[name].part(0, arrays[name].length) for name in ("R", "inverse_mass", "com")
    }
    d.known |= {
        "h": arrays["first_moment"].part(0, 3),
        "force": bias.part(0, 3),
        "moment": bias.part(3, 3),
    }
    return Balance(arrays["A"], arrays["columns"], bias)


def assemble_forward_dynamics(d: Draft, arrays: dict[str, Array]) -> "Balance":
    """v_dot from H v_dot + C = [0; tau] + J^T f: translation eliminated, then LDL^T for omega_dot
    and q_t_ddot.
    """
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
    d.call(assemble(SEGMENT_DYNAMICS, d.tail), at_torso=load, torques=torques, **arguments)


def assemble_segment_dynamics(d: Draft, arrays: dict[str, Array]) -> None:
    """v_dot from loads at B and torques, by segments."""
    accelerate(d, arrays["at_torso"], arrays["torques"], arrays["v_dot"])


@dataclass(frozen=True)
class Loads:
    """What accelerates the animal: ``load_force, load_moment`` less ``force, moment`` at B in torso
    axes, and torques.

    ``at_torso`` names these and ``gravity``, which else are those that steps find by these names.
    ``inertial(k)`` is taken from the torque ``tau(k)``; None stands for zero.
    """

    at_torso: dict[str, Ref]
    inertial: Callable[[Index], Ref] | None = None
    tau: Callable[[Index], Ref] | None = None


@dataclass(frozen=True)
class Balance:
    """H with translation eliminated, factored, and the tail's momentum columns: all that solving H
    x = loads needs.
    """

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
    """Loads from outside, at B in torso axes; returns the torques of actuators and loads
    together.
    """
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


BALANCE = Function(
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
    assemble_balance,
)
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
    "bias_force_world": partial(assemble_inverse_dynamics, world=True),
}
