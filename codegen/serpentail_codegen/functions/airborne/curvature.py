"""Second derivatives of mu^T y, where y are the rates of an airborne state.

mu^T y is differentiated on the surface where the equations for omega and for the accelerations
hold. Their multipliers follow from mu, so that no second derivative of these unknowns is needed.
"""

from dataclasses import dataclass

from serpentail_scene.layout import OMEGA, TORSO_NQ, VELOCITY

from ...autodiff.forward import Lanes, tangent_program, tangents_together
from ...autodiff.reverse import adjoint_program
from ...ir.program import Array
from ...mechanics import airborne, rotations, translation
from ..derivatives.differentiated import VIRTUAL_POWER
from ..derivatives.jacobians import weightless
from ..draft import Draft
from ..function import Assembly, assemble
from ..layout import block
from .balance import (
    QUATERNION,
    TURN,
    Balance,
    assemble_rates,
    at_drift,
    at_rates,
)
from .equations import AT_BASE, CONSERVED
from .slopes import AirborneSlopes, assemble_derivatives, placed

BY_Q = ("q", "v", "v_dot", "a")


@dataclass(frozen=True)
class Curvatures:
    """Minus the second derivatives of the weighted equations: rows are gradients, lanes are
    coordinates (``by_q``) or the numbers of x (``by_v``).  ``b_v``: the gradient by v.
    """

    by_q: dict[str, Array]
    by_v: Array
    b_v: Array
    d_q: Array


def assemble_hessian(draft: Draft, arrays: dict[str, Array]) -> None:
    """Rates of an airborne state with their Jacobian, and the Hessian of mu^T y."""
    b, slopes = assemble_derivatives(draft, arrays)
    found = curvatures(draft, b, slopes, arrays["weights"])
    turning = None
    if not draft.tail.widths:
        turning = store_turning(draft, b, found, arrays["weights"])
        add_momenta(draft, b, found, turning)
    draft.fill(arrays["hessian"].whole(), 0)
    store_state(draft, slopes, found, arrays["hessian"])
    add_attitude(draft, b, slopes, turning, arrays)
    H, size = arrays["hessian"], draft.tail.airborne_arguments
    with draft.loop("k", size) as k, draft.loop("l", k) as other:
        draft.copy(H.part(other * size + k, 1), H.part(k * size + other, 1))


def curvatures(draft: Draft, b: Balance, slopes: AirborneSlopes, mu: Array) -> Curvatures:
    """Differentiate the gradient of the equations of accelerations, weighted by M^-1 mu with the
    torso following.
    """
    tail, nt, count = draft.tail, draft.tail.nt, draft.tail.airborne_state
    multiplier, u = draft.array("multiplier", tail.nv), draft.array("u", 3)
    load = {}
    if tail.widths:
        at = at_drift(tail)
        load = {"load_force": mu.part(at, 3), "load_moment": mu.part(at + 3, TURN)}
    torques = weightless(draft, lambda k: mu.part(k + at_rates(tail), 1), **load)
    b.factored.solve(torques, multiplier)
    draft.copy(u[0], block(multiplier, VELOCITY))

    sizes = {"q": tail.nq, "v": tail.nv, "v_dot": tail.nv, "a": 3}
    by_q = {name: draft.wide(f"d_b_{name}", sizes[name], nt) for name in BY_Q}
    by_v, b_v = draft.wide("dv_b_v", tail.nv, count), draft.array("b_v", tail.nv)
    d_q = draft.wide("d_coordinates", tail.nq, nt)
    draft.unit(tail.all_q(d_q), 0)
    lanes = [
        Lanes(["v"], count, prefix="dv", wanted=["b_v"]),
        Lanes(["q"], nt, wanted=[f"b_{name}" for name in BY_Q]),
    ]
    inner = adjoint_program(assemble(VIRTUAL_POWER, tail), BY_Q, ("power",))
    given = {"q": b.q, "v": b.v, "v_dot": b.v_dot, "a": slopes.a, "multiplier": multiplier, "u": u}
    given |= {"b_power": draft.constant("minus_one", [-1]), "d_q": d_q, "dv_v": slopes.d_v}
    rows = {f"d_b_{name}": array for name, array in by_q.items()} | {"dv_b_v": by_v, "b_v": b_v}
    draft.call(tangents_together(inner, lanes, ["b_v"]), **given, **rows)
    draft.copy(block(by_q["v_dot"], VELOCITY), by_q["a"][0])
    return Curvatures(by_q, by_v, b_v, d_q)


def store_turning(draft: Draft, b: Balance, found: Curvatures, mu: Array) -> Array:
    """Store the multiplier of omega: everything that it changes, at fixed momentum."""
    turning = draft.array("turning", TURN)
    gradient = {"quaternion": b.quaternion[0], "gradient": block(mu, QUATERNION)}
    draft.step(rotations.turn_gradient, gradient, turn=turning[0])
    draft.copy(turning[0], mu.part(draft.tail.airborne_state, TURN), adds=True)
    draft.copy(turning[0], block(found.b_v, OMEGA), adds=True)
    draft.solve(b.inertia, turning[0])
    return turning


def add_momenta(draft: Draft, b: Balance, found: Curvatures, turning: Array) -> None:
    """Add the second derivatives of the momenta, weighted by a rotation of the whole animal about
    its COM.
    """
    linear, angular = draft.array("b_linear", 3), draft.array("b_angular", 3)
    draft.step(airborne.opposite, {"vector": turning[0]}, opposite=angular[0])
    reads = {"net": draft.zero(3), "w_dot": angular[0]}
    draft.step(translation.free_acceleration, b.factored.body, reads, a=linear[0])

    names = ("q", "v")
    more = {n: draft.wide(f"more_{n}", found.by_q[n].size, draft.tail.nt) for n in names}
    inner = adjoint_program(assemble(AT_BASE, draft.tail), names, ("linear", "angular"))
    inner = tangent_program(inner, ("q",), draft.tail.nt)
    given = {"q": b.q, "v": b.v, "d_q": found.d_q, "b_linear": linear, "b_angular": angular}
    draft.call(inner, **given, **{f"d_b_{n}": array for n, array in more.items()})
    for name, array in more.items():
        draft.copy(found.by_q[name].whole(), array.whole(), adds=True)


def store_state(draft: Draft, slopes: AirborneSlopes, found: Curvatures, H: Array) -> None:
    """Store the second derivatives at fixed attitude: of pairs of velocities, then those of a
    coordinate and anything, then those of coordinates alone.
    """
    tail, size, nt = draft.tail, draft.tail.airborne_arguments, draft.tail.nt
    count, first = tail.airborne_state, QUATERNION.stop
    both = summed(draft, "both", (slopes.d_v, found.by_v, 0))
    for lane, at, some in placed(tail):
        with draft.loop("k", some) as k:
            for other, beside, more in placed(tail):
                to = H.part((k + at) * size + beside, more)
                draft.copy(to, both.lane(k + lane, other, more))

    by_v, by_v_dot = found.by_q["v"], found.by_q["v_dot"]
    along = summed(draft, "along", (slopes.d_v, by_v, 0), (slopes.d_v_dot, by_v_dot, 0))
    add_both_ways(draft, along, first, H)
    torques = summed(draft, "torques", (slopes.by_torque, by_v_dot, 0))
    with draft.loop("k", nt) as k:
        row = found.by_q["q"].lane(k + TORSO_NQ, 0, nt)
        draft.copy(H.part((k + first) * size + first, nt), row, adds=True)
        draft.copy(H.part((k + count) * size + first, nt), torques.lane(k, 0, nt))


def add_attitude(
    draft: Draft,
    b: Balance,
    slopes: AirborneSlopes,
    turning: Array | None,
    arrays: dict[str, Array],
) -> None:
    """Add the second derivatives by the quaternion: of the momentum in torso axes, in air of
    gravity, and of the quaternion's rate, which is bilinear in it and omega.
    """
    tail, size, H = draft.tail, draft.tail.airborne_arguments, arrays["hessian"]
    unit, twice = draft.wide("d_numbers", 4, 4), draft.wide("d_b_quaternion", 4, 4)
    draft.unit(unit[0], 0)
    inner = adjoint_program(assemble(CONSERVED, tail), ("quaternion",), ("momentum",))
    inner = tangent_program(inner, ("quaternion",), 4)
    constant = arrays["angular"]
    if b.pull:
        constant, turning = b.pull, draft.array("b_pull", 3)
        mu = {"vector": arrays["weights"].part(at_drift(tail), 3)}
        draft.step(airborne.opposite, mu, opposite=turning[0])
        at = at_drift(tail) + 3
        rows = {f"row_{r}_": H.part((at + r) * size + at - 3, 3) for r in range(3)}
        draft.step(airborne.drift_curvature, {"weight": mu["vector"]}, **rows)
    assert turning is not None  # one of both has weights
    given = {"quaternion": b.quaternion, "angular": constant, "b_momentum": turning}
    draft.call(inner, **given, d_quaternion=unit, d_b_quaternion=twice)
    with draft.loop("k", 4) as k:
        draft.copy(H.part(k * size, 4), twice.lane(k, 0, 4), adds=True)

    turn = draft.wide("d_turn", TURN, 4)
    reads = {"quaternion": unit[0], "gradient": block(arrays["weights"], QUATERNION)}
    draft.step(rotations.turn_gradient, reads, turn=turn[0])
    across = summed(draft, "across", (slopes.d_v, turn, OMEGA.start))
    add_both_ways(draft, across, QUATERNION.start, H)


def summed(draft: Draft, name: str, *terms: tuple[Array, Array, int]) -> Array:
    """Return, for each lane of weights, the sum of rows times their weights in that lane; the rows
    belong to the weights from a first one on.
    """
    found = draft.wide(name, terms[0][0].lanes, terms[0][1].lanes)
    draft.fill(found.whole(), 0)
    for weights, rows, first in terms:
        with draft.loop("e", weights.lanes) as d, draft.loop("row", rows.length) as r:
            reads = {"weight": weights.lane(r + first, d, 1), "row": rows.part(r, 1)}
            draft.step(airborne.product, reads, sum_=found.part(d, 1))
    return found


def add_both_ways(draft: Draft, rows: Array, first: int, H: Array) -> None:
    """Add rows of the numbers of x to the columns of H from a first one on, and their transpose."""
    size, lanes = draft.tail.airborne_arguments, rows.lanes
    for lane, at, some in placed(draft.tail):
        with draft.loop("k", some) as k:
            row = rows.lane(k + lane, 0, lanes)
            draft.copy(H.part((k + at) * size + first, lanes), row, adds=True)
            draft.copy(H.part(k + at + first * size, lanes, size), row, adds=True)


ASSEMBLIES: dict[str, Assembly] = {
    "airborne_rates": assemble_rates,
    "airborne_rates_derivatives": assemble_derivatives,
    "airborne_rates_hessian": assemble_hessian,
}
