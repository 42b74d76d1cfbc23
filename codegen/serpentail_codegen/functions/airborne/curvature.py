"""Second derivatives of mu^T y, where y are the rates of an airborne state.

mu^T y is differentiated on the surface where the equations for omega and for the accelerations
hold. Their multipliers follow from mu, so that no second derivative of these unknowns is needed.
"""

from serpentail_scene.layout import OMEGA, TORSO_NQ, TORSO_NV, VELOCITY

from ...autodiff.forward import Lanes, tangent_program, tangents_together
from ...autodiff.reverse import adjoint_program
from ...ir.program import Array
from ...mechanics import airborne, rotations, translation
from ..derivatives.differentiated import VIRTUAL_POWER
from ..derivatives.jacobians import weightless
from ..draft import Draft
from ..function import Assembly, Function, assemble
from ..layout import block
from .balance import QUATERNION, TURN, Balance, assemble_rates, at_coordinates, at_rates
from .equations import AT_BASE, CONSERVED
from .slopes import assemble_derivatives, placed


def assemble_hessian(draft: Draft, arrays: dict[str, Array]) -> None:
    """Rates of an airborne state with their Jacobian, and the Hessian of mu^T y."""
    tail, nt, mu = draft.tail, draft.tail.nt, arrays["weights"]
    b, slopes = assemble_derivatives(draft, arrays)
    count, size, H = tail.airborne_state, tail.airborne_arguments, arrays["hessian"]
    first, second = at_coordinates(tail), at_rates(tail)
    draft.fill(H.whole(), 0)

    # the multipliers of accelerations, and how the power of their equations moves
    multiplier, u = draft.array("multiplier", tail.nv), draft.array("u", 3)
    b.factored.solve(weightless(draft, lambda k: mu.part(k + second, 1)), multiplier)
    draft.copy(u[0], block(multiplier, VELOCITY))
    d_q = draft.wide("d_coordinates", tail.nq, nt)
    draft.unit(tail.all_q(d_q), 0)
    by_q = {n: draft.wide(f"d_b_{n}", s, nt) for n, s in (("q", tail.nq), ("v", tail.nv), ("v_dot", tail.nv), ("a", 3))}
    by_v, b_v = draft.wide("dv_b_v", tail.nv, count), draft.array("b_v", tail.nv)
    given = {"q": b.q, "v": b.v, "v_dot": b.v_dot, "a": slopes.a, "multiplier": multiplier, "u": u}
    given["b_power"] = draft.constant("minus_one", [-1])
    lanes = [
        Lanes(["v"], count, prefix="dv", wanted=["b_v"]),
        Lanes(["q"], nt, prefix="d", wanted=[f"b_{name}" for name in by_q]),
    ]
    inner = adjoint_program(assemble(VIRTUAL_POWER, tail), tuple(by_q), ("power",))
    inner = tangents_together(inner, lanes, ["b_v"])
    moved = {f"d_b_{name}": array for name, array in by_q.items()}
    draft.call(inner, **given, d_q=d_q, dv_v=slopes.d_v, b_v=b_v, dv_b_v=by_v, **moved)
    draft.copy(block(by_q["v_dot"], VELOCITY), by_q["a"][0])

    # the multiplier of omega: everything that it changes, at fixed momentum
    turning = draft.array("turning", 3)
    weight = block(mu, QUATERNION)
    reads = {"quaternion": b.quaternion[0], "gradient": weight}
    draft.step(rotations.turn_gradient, reads, turn=turning[0])
    draft.copy(turning[0], mu.part(count, TURN), adds=True)
    draft.copy(turning[0], block(b_v, OMEGA), adds=True)
    draft.solve(b.inertia, turning[0])

    # how the momenta move, under minus this multiplier
    rigid = {name: draft.array(f"b_{name}", 3) for name in ("linear", "angular")}
    draft.step(airborne.opposite, {"vector": turning[0]}, opposite=rigid["angular"][0])
    reads = {"net": draft.zero(3), "w_dot": rigid["angular"][0]}
    draft.step(translation.free_acceleration, b.factored.body, reads, a=rigid["linear"][0])
    inner = adjoint_program(assemble(AT_BASE, tail), ("q", "v"), tuple(rigid))
    inner = tangent_program(inner, ("q",), nt)
    more = {n: draft.wide(f"more_{n}", by_q[n].size, nt) for n in ("q", "v")}
    weights = {f"b_{name}": array for name, array in rigid.items()}
    moved = {f"d_b_{name}": array for name, array in more.items()}
    draft.call(inner, q=b.q, v=b.v, d_q=d_q, **weights, **moved)
    for name, array in more.items():
        draft.copy(by_q[name].whole(), array.whole(), adds=True)

    # twice by the quaternion; by it and omega
    twice, d_c, turn = (draft.wide(n, s, 4) for n, s in (("curvature", 4), ("d_c", 4), ("turn", 3)))
    draft.unit(d_c[0], 0)
    inner = adjoint_program(assemble(CONSERVED, tail), ("quaternion",), ("momentum",))
    inner = tangent_program(inner, ("quaternion",), 4)
    reads = {"quaternion": b.quaternion, "angular": arrays["angular"], "b_momentum": turning}
    draft.call(inner, d_quaternion=d_c, d_b_quaternion=twice, **reads)
    reads = {"quaternion": d_c[0], "gradient": weight}
    draft.step(rotations.turn_gradient, reads, turn=turn[0])

    # the Hessian
    def add_products(weights: Array, rows: Array, start: int, target: Array) -> None:
        with draft.loop("e", weights.lanes) as d, draft.loop("row", rows.length) as r:
            reads = {"weight": weights.lane(r + start, d, 1), "row": rows.part(r, 1)}
            draft.step(airborne.product, reads, sum_=target.part(d, 1))

    def cleared(name: str, rows: int, lanes: int) -> Array:
        array = draft.wide(name, rows, lanes)
        draft.fill(array.whole(), 0)
        return array

    along, across, both = cleared("along", count, nt), cleared("across", count, 4), cleared("both", count, count)
    torques = cleared("along_torques", nt, nt)
    add_products(slopes.d_v, by_q["v"], 0, along)
    add_products(slopes.d_v_dot, by_q["v_dot"], 0, along)
    add_products(slopes.by_torque, by_q["v_dot"], 0, torques)
    add_products(slopes.d_v, turn, OMEGA.start, across)
    add_products(slopes.d_v, by_v, 0, both)
    for lane, at, some in placed(tail):
        with draft.loop("k", some) as k:
            for other, beside, more_ in placed(tail):
                to = H.part((k + at) * size + beside, more_)
                draft.copy(to, both.lane(k + lane, other, more_))
    for lane, at, some in placed(tail):
        with draft.loop("k", some) as k:
            for source, begin, lanes in ((along, first, nt), (across, 0, 4)):
                row = source.lane(k + lane, 0, lanes)
                draft.copy(H.part((k + at) * size + begin, lanes), row, adds=True)
                draft.copy(H.part(k + at + begin * size, lanes, size), row, adds=True)
    with draft.loop("k", 4) as k:
        draft.copy(H.part(k * size, 4), twice.lane(k, 0, 4), adds=True)
    with draft.loop("k", nt) as k:
        row = by_q["q"].lane(k + TORSO_NQ, 0, nt)
        draft.copy(H.part((k + first) * size + first, nt), row, adds=True)
        draft.copy(H.part((k + count) * size + first, nt), torques.lane(k, 0, nt))
    with draft.loop("k", size) as k, draft.loop("l", k) as other:
        draft.copy(H.part(other * size + k, 1), H.part(k * size + other, 1))


ASSEMBLIES: dict[str, Assembly] = {
    "airborne_rates": assemble_rates,
    "airborne_rates_derivatives": assemble_derivatives,
    "airborne_rates_hessian": assemble_hessian,
}
