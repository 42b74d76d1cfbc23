"""Derivatives a scene can ask for: a tail's sizes go in, loop nests that give exact derivatives come out.

With respect to q all are in the tangent space: position of B, a turn of the torso in body axes, tail coordinates; the
columns of such a matrix are those of a velocity v.  Nothing depends on the position of B, or on its velocity.
"""

from dataclasses import dataclass, replace

from . import dynamics as dyn
from . import kinematics as kin
from . import sweeps
from .adjoints import adjoint_program
from .compose import inline
from .draft import Draft, Tail
from .functions import (
    FORCE,
    FUNCTIONS,
    TAU,
    V_DOT,
    Argument,
    Balance,
    Function,
    Loads,
    Q,
    V,
    assemble_forward_dynamics,
    assemble_inverse_dynamics,
    inertial,
    program,
)
from .program import Array, Index, Loop, Ref, as_index
from .sweeps import mechanism
from .tangents import tangent_program

MULTIPLIER = Argument("multiplier", lambda t: (t.nv,), "weights lambda of the rows")
POWER = Argument("power", lambda t: (1,), "lambda^T (H v_dot + C)")


# ---- the functions that are differentiated -----------------------------------------------------------------------


def assemble_core(d: Draft, arrays: dict[str, Array]) -> None:
    """H v_dot + C in torso axes throughout, v_dot[0:3] being R^T (p_b_ddot + g z): no attitude, no gravity."""
    v_dot, force = arrays["v_dot"], arrays["force"]
    mechanism(d).prepare(d)
    d.known |= {"w": d.known["omega"], "w_dot": v_dot.part(3, 3), "a": v_dot.part(0, 3)}
    wrench = sweeps.forward_wrenches(d, v_dot)
    sweeps.gather_wrenches(d, wrench, lambda i: force.part(6 + 2 * i, 2))
    d.step(dyn.torso_wrench, force=force.part(0, 3), moment=force.part(3, 3))


def assemble_virtual_power(d: Draft, arrays: dict[str, Array]) -> None:
    """lambda^T (H v_dot + C) as one sum over the links, from the torso to the tip."""
    v_dot, multiplier = arrays["v_dot"], arrays["multiplier"]
    d.store(kin.quaternion_rotation, R=9)
    mechanism(d).prepare(d)
    d.known |= {"w": d.known["omega"], "w_dot": v_dot.part(3, 3), "w_virtual": multiplier.part(3, 3)}
    d.known["p_ddot"] = v_dot.part(0, 3)
    d.store(kin.torso_acceleration, a=3)
    d.step(kin.torso_velocity, {"p_dot": multiplier.part(0, 3)}, u=d.vector("u_virtual", 3))
    sweeps.virtual_power(d, arrays["power"][0], multiplier, v_dot)


def assemble_inertia_force(d: Draft, arrays: dict[str, Array]) -> None:
    """H v_dot: the inverse dynamics of rest without gravity."""
    d.known["gravity"] = d.zero(1)
    assemble_inverse_dynamics(d, arrays)


CORE = Function("core", "H v_dot + C in torso axes", (Q, V, V_DOT), (FORCE,), assemble_core)
INERTIA_FORCE = Function("inertia_force", "H v_dot", (Q, V, V_DOT), (FORCE,), assemble_inertia_force)
VIRTUAL_POWER = Function(
    "virtual_power", "lambda^T (H v_dot + C)", (Q, V, V_DOT, MULTIPLIER), (POWER,), assemble_virtual_power
)


# ---- directions ---------------------------------------------------------------------------------------------------

# directions of the torso: first column in the tangent of q or v, and whether it is q
TORSO = {"p": (0, True), "turn": (3, True), "p_dot": (0, False), "omega": (3, False)}


@dataclass(frozen=True)
class Directions:
    """Which lane stands for which direction: some of the torso, then coordinates and rates of segment after segment."""

    tail: Tail
    torso: tuple[str, ...]
    rates: bool = True

    @property
    def base(self) -> int:
        """Lanes of the torso."""
        return 3 * len(self.torso)

    @property
    def each(self) -> int:
        """Lanes of one segment."""
        return 4 if self.rates else 2

    @property
    def count(self) -> int:
        """All lanes."""
        return self.base + self.each * self.tail.segments

    def outward(self, loops: tuple[Loop, ...]) -> Index | None:
        """Where a sweep goes from the torso to the tip, segment i depends on the segments up to i alone."""
        return None if any(loop.downward for loop in loops) else self.up_to(loops)

    def up_to(self, loops: tuple[Loop, ...]) -> Index | None:
        """Lanes of the torso and the segments up to i, within a loop over segments."""
        within = any(loop.var == "i" for loop in loops)
        return self.each * Index((("i", 1),)) + (self.base + self.each) if within else None

    def of_q(self, i: Index) -> Index:
        """First lane of the coordinates of segment i."""
        return self.each * i + self.base

    def of_v(self, i: Index) -> Index:
        """First lane of the rates of segment i."""
        return self.each * i + (self.base + 2)

    def tangents(self, d: Draft) -> dict[str, Array]:
        """Declare ``d_q`` and ``d_v`` and store the directions in them as rows."""
        label = "_".join(self.torso)
        d_q = d.wide(f"d_q_{label}", d.tail.nq, self.count)
        d_v = d.wide(f"d_v_{label}", d.tail.nv, self.count) if self.rates else None
        for lane, name in enumerate(self.torso):
            column, is_q = TORSO[name]
            if name == "turn":
                turn = d.wide(f"d_{label}", 3, self.count)
                d.unit(turn[0], 3 * lane)
                d.step(kin.turned_quaternion, {"turn": turn[0]}, rate=d_q.part(3, 4))
            else:
                d.unit((d_q if is_q else d_v).part(column, 3), 3 * lane)
        with d.loop("i", self.tail.segments) as i:
            d.unit(d_q.part(7 + 2 * i, 2), self.of_q(i))
            if self.rates:
                d.unit(d_v.part(6 + 2 * i, 2), self.of_v(i))
        return {"d_q": d_q, "d_v": d_v} if self.rates else {"d_q": d_q}

    def spread(self, d: Draft, source: Array, of_q: Array, of_v: Array | None = None) -> None:
        """Copy wide rows to the columns of matrices (rows, nv)."""
        nv = self.tail.nv
        for target in (of_q, of_v) if of_v else (of_q,):
            d.fill(target.part(0, target.length), 0)
        with d.loop("r", source.length) as r:
            for lane, name in enumerate(self.torso):
                column, is_q = TORSO[name]
                d.copy((of_q if is_q else of_v).part(nv * r + column, 3), source.lane(r, 3 * lane, 3))
            with d.loop("i", self.tail.segments) as i:
                d.copy(of_q.part(nv * r + 2 * i + 6, 2), source.lane(r, self.of_q(i), 2))
                if self.rates:
                    d.copy(of_v.part(nv * r + 2 * i + 6, 2), source.lane(r, self.of_v(i), 2))


# ---- Jacobians ----------------------------------------------------------------------------------------------------


def assemble_inverse_dynamics_derivatives(d: Draft, arrays: dict[str, Array]) -> None:
    """Tangents of H v_dot + C along all directions at once."""
    directions = Directions(d.tail, ("turn", "omega"))
    inner = tangent_program(
        program(FUNCTIONS["inverse_dynamics"], d.tail), ("q", "v"), directions.count, directions.outward
    )
    rows = d.wide("rows", d.tail.nv, directions.count)
    given = {name: arrays[name] for name in ("q", "v", "v_dot")}
    inline(d, inner, d_force=rows, **given, **directions.tangents(d))
    directions.spread(d, rows, arrays["dq"], arrays["dv"])


def forward_dynamics_first(d: Draft, arrays: dict[str, Array]) -> tuple[Balance, Array]:
    """Forward dynamics, then its acceleration with R^T (p_b_ddot + g z) in place of p_b_ddot."""
    v_dot, body = d.array("acceleration", d.tail.nv), d.array("body_acceleration", d.tail.nv)
    balance = assemble_forward_dynamics(d, arrays | {"v_dot": v_dot})
    d.step(kin.torso_acceleration, {"p_ddot": v_dot.part(0, 3)}, a=body.part(0, 3))
    d.copy(body.part(3, d.tail.nv - 3), v_dot.part(3, d.tail.nv - 3))
    return balance, body


def loads(d: Draft, **at_torso: Ref) -> dict[str, Ref]:
    """Loads at the torso of a system H x = loads; what is not named is zero."""
    return dict.fromkeys(("force", "moment", "load_force", "load_moment"), d.zero(3)) | at_torso


def assemble_forward_dynamics_derivatives(d: Draft, arrays: dict[str, Array]) -> None:
    """-H^-1 times the tangents of H v_dot + C at fixed v_dot; with respect to tau, columns of H^-1."""
    tail, nv = d.tail, d.tail.nv
    balance, body = forward_dynamics_first(d, arrays)
    d.known["gravity"] = d.zero(1)
    directions = Directions(tail, ("omega",))
    inner = tangent_program(program(CORE, tail), ("q", "v"), directions.count, directions.outward)
    rows, x = d.wide("rows", nv, directions.count), d.wide("x", nv, directions.count)
    given = {name: arrays[name] for name in ("q", "v")}
    inline(d, inner, d_force=rows, v_dot=body, **given, **directions.tangents(d))
    at_torso = loads(d, force=rows.part(0, 3), moment=rows.part(3, 3))
    balance.solve(d, Loads(at_torso, inertial=lambda k: rows.part(6 + k, 1)), x)
    directions.spread(d, x, arrays["dq"], arrays["dv"])
    turned = {f"row_{r}": arrays["dq"].part(nv * r + 3, 3) for r in range(3)}
    d.step(dyn.turned_acceleration, {"a": body.part(0, 3)}, **turned)
    torques(d, balance, arrays["dtau"])


def torques(d: Draft, balance: Balance, dtau: Array) -> None:
    """Columns of H^-1 that belong to tau."""
    nt, nv = d.tail.nt, d.tail.nv
    unit, x = d.wide("unit_torque", nt, nt), d.wide("x_torque", nv, nt)
    d.unit(unit.part(0, nt), 0)
    balance.solve(d, Loads(loads(d), tau=lambda k: unit.part(k, 1)), x)
    with d.loop("r", nv) as r:
        d.copy(dtau.part(nt * r, nt), x.lane(r, 0, nt))


def assemble_parameter_derivatives(d: Draft, arrays: dict[str, Array]) -> None:
    """Tangents of H v_dot + C with respect to every parameter; -H^-1 times them where ``tau`` is given."""
    nv, count = d.tail.nv, parameter_count(d.tail)
    forward = "tau" in arrays
    function = CORE if forward else FUNCTIONS["inverse_dynamics"]
    tangents, lane = {}, 0
    for p in inertial(d.tail.kind):
        tangents[f"d_{p.name}"] = wide = d.wide(f"d_{p.name}", p.size, count)
        d.unit(wide[0], lane)
        lane += p.size
    balance, v_dot = forward_dynamics_first(d, arrays) if forward else (None, arrays["v_dot"])
    inner = tangent_program(program(function, d.tail), [p.name for p in inertial(d.tail.kind)], count)
    tangents = {name: array for name, array in tangents.items() if any(a.name == name for a in inner.arrays)}
    rows = d.wide("rows", nv, count)
    inline(d, inner, d_force=rows, v_dot=v_dot, q=arrays["q"], v=arrays["v"], **tangents)
    if forward:
        x = d.wide("x", nv, count)
        at_torso = loads(d, force=rows.part(0, 3), moment=rows.part(3, 3))
        d.known["gravity"] = d.wide("d_gravity_z", 1, count)[0]
        d.unit(d.known["gravity"], 0)  # gravity is the first parameter: p_b_ddot falls by as much
        balance.solve(d, Loads(at_torso, inertial=lambda k: rows.part(6 + k, 1)), x)
        rows = x
    with d.loop("r", nv) as r:
        d.copy(arrays["dparameters"].part(count * r, count), rows.lane(r, 0, count))


# ---- products with Jacobians --------------------------------------------------------------------------------------


def assemble_forward_dynamics_jvp(d: Draft, arrays: dict[str, Array]) -> None:
    """Directional derivative of v_dot."""
    nv = d.tail.nv
    balance, body = forward_dynamics_first(d, arrays)
    d.known["gravity"] = d.zero(1)
    d_q, rows, x = d.array("d_q", d.tail.nq), d.array("rows", nv), arrays["dv_dot"]
    d.copy(d_q.part(7, d.tail.nt), arrays["dq"].part(6, d.tail.nt))
    inner = tangent_program(program(CORE, d.tail), ("q", "v"))
    inline(d, inner, q=arrays["q"], v=arrays["v"], v_dot=body, d_q=d_q, d_v=arrays["dv"], d_force=rows)
    at_torso = loads(d, force=rows.part(0, 3), moment=rows.part(3, 3))
    dtau = arrays["dtau"]
    balance.solve(d, Loads(at_torso, lambda k: rows.part(6 + k, 1), lambda k: dtau.part(k, 1)), x)
    reads = {"a": body.part(0, 3), "turn": arrays["dq"].part(3, 3), "p_ddot": x.part(0, 3)}
    d.step(dyn.turning_acceleration, reads, p_ddot=x.part(0, 3))


def assemble_inverse_dynamics_vjp(d: Draft, arrays: dict[str, Array]) -> None:
    """Gradient of lambda^T (H v_dot + C), by one way out along the tail and one back."""
    inner = adjoint_program(program(VIRTUAL_POWER, d.tail), ("q", "v", "v_dot"), ("power",))
    one, gradient = d.constant("one", [1]), d.array("gradient", d.tail.nq)
    given = {name: arrays[name] for name in ("q", "v", "v_dot", "multiplier")}
    inline(d, inner, b_power=one, b_q=gradient, b_v=arrays["dv"], b_v_dot=arrays["dv_dot"], **given)
    in_tangent_space(d, arrays["q"], gradient, arrays["dq"])


def in_tangent_space(d: Draft, q: Array, gradient: Array, dq: Array) -> None:
    """Turn a gradient with respect to the numbers of q into one with respect to a velocity's directions."""
    d.copy(dq.part(0, 3), gradient.part(0, 3))
    reads = {"quaternion": q.part(3, 4), "gradient": gradient.part(3, 4)}
    d.step(kin.turn_gradient, reads, turn=dq.part(3, 3))
    d.copy(dq.part(6, d.tail.nt), gradient.part(7, d.tail.nt))


def assemble_forward_dynamics_vjp(d: Draft, arrays: dict[str, Array]) -> None:
    """lambda^T times the Jacobian of v_dot: mu = H^-1 lambda, then minus the gradient of mu^T (H v_dot + C)."""
    tail, multiplier = d.tail, arrays["multiplier"]
    v_dot, mu = d.array("acceleration", tail.nv), d.array("mu", tail.nv)
    balance = assemble_forward_dynamics(d, arrays | {"v_dot": v_dot})
    d.known["gravity"] = d.zero(1)
    d.step(kin.torso_velocity, {"p_dot": multiplier.part(0, 3)}, u=d.vector("pull", 3))
    at_torso = loads(d, load_force=d.known["pull"], load_moment=multiplier.part(3, 3))
    balance.solve(d, Loads(at_torso, tau=lambda k: multiplier.part(6 + k, 1)), mu)
    inner = adjoint_program(program(VIRTUAL_POWER, tail), ("q", "v"), ("power",))
    minus, gradient = d.constant("minus", [-1]), d.array("gradient", tail.nq)
    given = {"q": arrays["q"], "v": arrays["v"], "v_dot": v_dot, "multiplier": mu}
    inline(d, inner, b_power=minus, b_q=gradient, b_v=arrays["dv"], **given)
    in_tangent_space(d, arrays["q"], gradient, arrays["dq"])
    d.copy(arrays["dtau"].part(0, tail.nt), mu.part(6, tail.nt))


# ---- second derivatives -------------------------------------------------------------------------------------------


def assemble_inverse_dynamics_hessian(d: Draft, arrays: dict[str, Array]) -> None:
    """Tangents of the gradient of lambda^T (H v_dot + C) with respect to q and v; its mixed block by those of H lambda.

    Only the lower triangle is computed: rows of segment i in the lanes of segments up to i.
    """
    tail, nv = d.tail, d.tail.nv
    directions = Directions(tail, ("turn", "omega"))
    inner = adjoint_program(program(VIRTUAL_POWER, tail), ("q", "v"), ("power",))
    inner = tangent_program(inner, ("q", "v"), directions.count, directions.up_to)
    b_q, b_v = d.wide("d_b_q", tail.nq, directions.count), d.wide("d_b_v", nv, directions.count)
    given = {name: arrays[name] for name in ("q", "v", "v_dot", "multiplier")}
    d_q = directions.tangents(d)
    inline(d, inner, b_power=d.constant("one", [1]), d_b_q=b_q, d_b_v=b_v, **given, **d_q)
    turn = d.wide("d_b_turn", 3, directions.count)
    d.step(kin.turn_gradient, {"gradient": b_q.part(3, 4)}, turn=turn[0])
    mirror(d, directions, {"turn": turn[0], "omega": b_v.part(3, 3)}, (b_q, b_v), arrays)
    mixed_block(d, arrays)


def mirror(d: Draft, directions: Directions, torso: dict[str, Ref], rows: tuple[Array, Array], out: dict) -> None:
    """Copy the lower triangle of the Hessian to the blocks qq, qv and vv, and mirror it."""
    nv, m = d.tail.nv, d.tail.segments
    for name in ("qq", "qv", "vv"):
        d.fill(out[name].part(0, nv * nv), 0)

    def place(row: Ref, of_row: tuple[Index, bool], lane: Index, of_lane: tuple[Index, bool], size: int) -> None:
        """Copy lanes of one row to the block it belongs to, and to the mirrored place."""
        (r, row_is_q), (c, lane_is_q) = of_row, of_lane
        source = row.array.lane(row.offset, lane, size)
        block = out["qq" if row_is_q and lane_is_q else "qv" if row_is_q or lane_is_q else "vv"]
        if row_is_q or not lane_is_q:
            d.copy(block.part(nv * r + c, size), source)
        if lane_is_q or not row_is_q:
            d.copy(block.part(nv * c + r, size, nv), source)

    def place_row(row: Ref, of_row: tuple[Index, bool], segments: Index | None) -> None:
        for lane, name in enumerate(directions.torso):
            column, is_q = TORSO[name]
            place(row, of_row, as_index(3 * lane), (as_index(column), is_q), 3)
        if segments:
            with d.loop("l", segments) as other:
                place(row, of_row, directions.of_q(other), (2 * other + 6, True), 2)
                place(row, of_row, directions.of_v(other), (2 * other + 6, False), 2)

    for name in directions.torso:
        column, is_q = TORSO[name]
        with d.loop("k", 3) as k:
            place_row(torso[name].array.part(torso[name].offset + k, 1), (k + column, is_q), None)
    with d.loop("i", m) as i, d.loop("k", 2) as k:
        place_row(rows[0].part(2 * i + k + 7, 1), (2 * i + k + 6, True), i + 1)
        place_row(rows[1].part(2 * i + k + 6, 1), (2 * i + k + 6, False), i + 1)


def mixed_block(d: Draft, arrays: dict[str, Array]) -> None:
    """d(H lambda)/dq: tangents of the inverse dynamics of the acceleration lambda at rest, without gravity."""
    directions = Directions(d.tail, ("turn",), rates=False)
    inner = tangent_program(program(INERTIA_FORCE, d.tail), ("q",), directions.count, directions.outward)
    rows = d.wide("inertial_rows", d.tail.nv, directions.count)
    still = d.array("at_rest", d.tail.nv)
    d.fill(still.part(0, d.tail.nv), 0)
    tangents = directions.tangents(d)
    inline(d, inner, q=arrays["q"], v=still, v_dot=arrays["multiplier"], d_force=rows, **tangents)
    directions.spread(d, rows, arrays["aq"])


# ---- energy and momentum ------------------------------------------------------------------------------------------


def assemble_energy_derivatives(d: Draft, arrays: dict[str, Array]) -> None:
    """Gradients of kinetic and potential energy."""
    for name, wanted in (("kinetic", ("q", "v")), ("potential", ("q",))):
        inner = adjoint_program(program(FUNCTIONS["energy"], d.tail), wanted, (name,))
        inner = replace(inner, name=f"{inner.name}_{name}")
        gradient = d.array(f"{name}_gradient", d.tail.nq)
        given = {"q": arrays["q"], "v": arrays["v"]} | ({"b_v": arrays["kinetic_dv"]} if "v" in wanted else {})
        weight = {f"b_{name}": d.constant(f"one_{name}", [1]), "b_q": gradient}
        inline(d, inner, **given, **weight)
        in_tangent_space(d, arrays["q"], gradient, arrays[f"{name}_dq"])


def assemble_momentum_derivatives(d: Draft, arrays: dict[str, Array]) -> None:
    """Tangents of momentum and angular momentum along all directions at once."""
    directions = Directions(d.tail, ("turn", "p_dot", "omega"))
    inner = tangent_program(program(FUNCTIONS["momentum"], d.tail), ("q", "v"), directions.count)
    rows = {name: d.wide(f"{name}_rows", 3, directions.count) for name in ("linear", "angular")}
    outputs = {f"d_{name}": row for name, row in rows.items()}
    inline(d, inner, q=arrays["q"], v=arrays["v"], **outputs, **directions.tangents(d))
    for name, row in rows.items():
        directions.spread(d, row, arrays[f"{name}_dq"], arrays[f"{name}_dv"])


# ---- what a scene can ask for -------------------------------------------------------------------------------------


def parameter_count(tail: Tail) -> int:
    """Numbers in the parameter struct."""
    return sum(p.size for p in inertial(tail.kind))


def square(name: str, meaning: str) -> Argument:
    """Return a matrix argument (nv, nv)."""
    return Argument(name, lambda t: (t.nv, t.nv), meaning)


def row(name: str, meaning: str) -> Argument:
    """Return a vector argument (nv,)."""
    return Argument(name, lambda t: (t.nv,), meaning)


def three(name: str, meaning: str) -> Argument:
    """Return a matrix argument (3, nv)."""
    return Argument(name, lambda t: (3, t.nv), meaning)


DTAU_IN = Argument("dtau", lambda t: (t.nt,), "direction of tau")
DTAU_OUT = Argument("dtau", lambda t: (t.nt,), "lambda^T d(v_dot)/d(tau)")
DPARAMETERS = Argument(
    "dparameters", lambda t: (t.nv, parameter_count(t)), "derivative with respect to the numbers of the parameter struct"
)
_TABLE = (
    Function(
        "inverse_dynamics_derivatives",
        "Jacobians of H v_dot + C; that with respect to v_dot is H",
        (Q, V, V_DOT),
        (square("dq", "d(force)/d(q), q in its tangent space"), square("dv", "d(force)/d(v)")),
        assemble_inverse_dynamics_derivatives,
    ),
    Function(
        "forward_dynamics_derivatives",
        "Jacobians of v_dot from Eq. 1",
        (Q, V, TAU),
        (
            square("dq", "d(v_dot)/d(q), q in its tangent space"),
            square("dv", "d(v_dot)/d(v)"),
            Argument("dtau", lambda t: (t.nv, t.nt), "d(v_dot)/d(tau)"),
        ),
        assemble_forward_dynamics_derivatives,
    ),
    Function(
        "inverse_dynamics_parameter_derivatives",
        "Jacobian of H v_dot + C with respect to the parameters",
        (Q, V, V_DOT),
        (DPARAMETERS,),
        assemble_parameter_derivatives,
    ),
    Function(
        "forward_dynamics_parameter_derivatives",
        "Jacobian of v_dot from Eq. 1 with respect to the parameters",
        (Q, V, TAU),
        (DPARAMETERS,),
        assemble_parameter_derivatives,
    ),
    Function(
        "inverse_dynamics_vjp",
        "gradient of lambda^T (H v_dot + C)",
        (Q, V, V_DOT, MULTIPLIER),
        (
            row("dq", "with respect to q, in its tangent space"),
            row("dv", "with respect to v"),
            row("dv_dot", "with respect to v_dot: H lambda"),
        ),
        assemble_inverse_dynamics_vjp,
    ),
    Function(
        "forward_dynamics_jvp",
        "directional derivative of v_dot from Eq. 1",
        (Q, V, TAU, row("dq", "direction of q, in its tangent space"), row("dv", "direction of v"), DTAU_IN),
        (row("dv_dot", "derivative of v_dot"),),
        assemble_forward_dynamics_jvp,
    ),
    Function(
        "forward_dynamics_vjp",
        "lambda^T times the Jacobians of v_dot from Eq. 1",
        (Q, V, TAU, MULTIPLIER),
        (row("dq", "lambda^T d(v_dot)/d(q), in the tangent space"), row("dv", "lambda^T d(v_dot)/d(v)"), DTAU_OUT),
        assemble_forward_dynamics_vjp,
    ),
    Function(
        "inverse_dynamics_hessian",
        "second derivatives of lambda^T (H v_dot + C); with respect to v_dot twice, or v_dot and v, they are zero",
        (Q, V, V_DOT, MULTIPLIER),
        (
            square("qq", "with respect to q twice, in its tangent space (by the exponential map)"),
            square("qv", "row: q, column: v"),
            square("vv", "with respect to v twice"),
            square("aq", "row: v_dot, column: q; d(H lambda)/d(q)"),
        ),
        assemble_inverse_dynamics_hessian,
    ),
    Function(
        "energy_derivatives",
        "gradients of kinetic and potential energy",
        (Q, V),
        (
            row("kinetic_dq", "of the kinetic energy with respect to q, in its tangent space"),
            row("kinetic_dv", "of the kinetic energy with respect to v: H v"),
            row("potential_dq", "of the potential energy with respect to q, in its tangent space"),
        ),
        assemble_energy_derivatives,
    ),
    Function(
        "momentum_derivatives",
        "Jacobians of linear and angular momentum",
        (Q, V),
        (
            three("linear_dq", "of the momentum with respect to q, in its tangent space"),
            three("linear_dv", "of the momentum with respect to v"),
            three("angular_dq", "of the angular momentum with respect to q, in its tangent space"),
            three("angular_dv", "of the angular momentum with respect to v"),
        ),
        assemble_momentum_derivatives,
    ),
)
CATALOGUE = FUNCTIONS | {function.name: function for function in _TABLE}
