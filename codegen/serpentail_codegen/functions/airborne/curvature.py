"""Second derivatives of mu^T y, where y are the rates of an airborne state.

mu^T y is differentiated on the surface where the equations for omega and for the accelerations
hold. Their multipliers follow from mu, so that no second derivative of these unknowns is needed.
"""

from dataclasses import dataclass

from serpentail_scene.layout import OMEGA, PER_SEGMENT, TORSO_NQ, TORSO_NV, VELOCITY

from ...ir.program import Array, Index, Ref
from ...mechanics import airborne, rotations
from ..derivatives.differentiated import POWER_AND_MOMENTUM
from ..derivatives.directions import Directions
from ..derivatives.hessian import tangents_of_gradient
from ..draft import Draft
from ..function import Assembly
from ..layout import block, coordinate
from .balance import (
    QUATERNION,
    TURN,
    Accelerations,
    Balance,
    assemble_rates,
    at_coordinates,
    at_rates,
)
from .slopes import AirborneSlopes, assemble_derivatives

BY_Q = ("q", "v", "v_dot", "a", "drift", "slide")


@dataclass(frozen=True)
class Weights:
    """The weights of the equations: ``accelerating`` (nv, in torso axes) of those of accelerations,
    ``turning`` of that of omega.
    """

    accelerating: Array
    turning: Array


@dataclass(frozen=True)
class Curvatures:
    """Minus the second derivatives of the weighted equations: rows are gradients, lanes are
    coordinates (``by_q``), or omega and rates (``by_v``).
    """

    by_q: dict[str, Array]
    by_v: Array
    of_q: Directions
    of_v: Directions


def assemble_hessian(draft: Draft, arrays: dict[str, Array]) -> None:
    """Rates of an airborne state with their Jacobian, and the Hessian of mu^T y."""
    b, motion, slopes = assemble_derivatives(draft, arrays)
    weights = store_weights(b, slopes, arrays["weights"])
    found = curvatures(b, motion, slopes, weights)
    crossed = store_crossed(b, slopes, found)
    store_hessian(b, slopes, found, crossed, weights, arrays)


def store_weights(b: Balance, slopes: AirborneSlopes, mu: Array) -> Weights:
    """Store the multipliers: those of accelerations, M^-1 mu with the torso following, then those
    of omega.
    """
    draft, tail = b.draft, b.draft.tail
    first, second = at_rates(tail), tail.airborne_state
    accelerating, turning = draft.array("accelerating", tail.nv), draft.array("turning", TURN)

    # of accelerations
    draft.copy(tail.all_v(accelerating), mu.part(first, tail.nt))
    draft.solve(b.M, tail.all_v(accelerating))
    draft.fill(block(accelerating, OMEGA), 0)
    turn, move = block(accelerating, OMEGA), block(accelerating, VELOCITY)
    b.follow(accelerating, turn, move)

    # of omega: everything that it changes, at fixed momentum
    gradient = {"quaternion": b.quaternion, "gradient": block(mu, QUATERNION)}
    draft.step(rotations.turn_gradient, gradient, turn=turning[0])
    draft.copy(turning[0], mu.part(second, TURN), adds=True)
    with draft.loop("row", tail.nv) as r:
        reads = {"weight": accelerating.part(r, 1), "by_omega": slopes.by_omega[r]}
        draft.step(airborne.weighted, reads, gradient_=turning[0])
    draft.solve(b.inertia, turning[0])
    return Weights(accelerating, turning)


def curvatures(
    b: Balance, motion: Accelerations, slopes: AirborneSlopes, weights: Weights
) -> Curvatures:
    """Differentiate the gradients of the weighted equations, by coordinates, and by omega and
    rates.
    """
    draft, tail = b.draft, b.draft.tail
    of_q = Directions(tail, (), rates=False)
    of_v = Directions(tail, ("omega",), coordinates=False)
    given = {"q": b.q, "v": b.v, "v_dot": motion.v_dot, "multiplier": weights.accelerating}
    given |= {"a": slopes.a, "u": draft.array("u", 3)}
    draft.copy(given["u"][0], block(weights.accelerating, VELOCITY))

    # velocities of B that leave it without momentum
    drift, slide = draft.array("drift", 3), draft.array("slide", 3)
    b.shift(b.omega, drift[0], b.v)
    b.shift(weights.turning[0], slide[0])
    rigid = {"drift": drift, "slide": slide, "rigid": weights.turning}

    given["b_power"] = draft.constant("minus_one", [-1])
    given |= rigid | of_q.tangents(draft) | {"dv_v": of_v.tangents(draft)["d_v"]}
    by_q, by_v = tangents_of_gradient(
        draft, POWER_AND_MOMENTUM, (of_q, BY_Q), (of_v, ("v",)), given
    )
    return Curvatures(by_q, by_v["v"], of_q, of_v)


def store_crossed(b: Balance, slopes: AirborneSlopes, found: Curvatures) -> tuple[Array, Array]:
    """Return the mixed terms of pairs of a coordinate (lane) and any direction through
    accelerations and drift: along the directions of slopes, and along torques.
    """
    draft, tail, by_q = b.draft, b.draft.tail, found.by_q
    nt, directions = tail.nt, slopes.directions

    # weights of loads and of the tail, the torso following it
    turn, move = block(by_q["v_dot"], OMEGA), by_q["a"][0]
    reads = {"move": move, "turn": turn}
    draft.step(airborne.torso_weights, b.center, reads, move=move, turn=turn)
    with draft.loop("k", nt) as k:
        weight = tail.coordinate_v(by_q["v_dot"], k)
        reads = b.of_tail(k) | {"weight": weight, "move": move, "turn": turn}
        draft.step(airborne.tail_weight, reads, weight=weight)
    draft.solve(b.inertia, turn)

    # changes by their weights, direction after direction
    crossed = draft.wide("crossed", directions.count, nt)
    with draft.loop("e", directions.count) as d:
        for weight, rows, first in ((move, slopes.loads, 0), (turn, slopes.loads, 3)):
            reads = {"weight": weight, "change": rows.down(first, d, 3)}
            add = "sum_" if first else "sum"
            draft.step(airborne.crossed, reads, **{add: crossed.part(d, 1)})
        with draft.loop("k", nt) as k:
            reads = {
                "weight": tail.coordinate_v(by_q["v_dot"], k),
                "change": slopes.tail.lane(k, d, 1),
            }
            draft.step(airborne.crossed_by_rate, reads, sum_=crossed.part(d, 1))
    add_drift(b, slopes, found, crossed)

    by_torque = draft.wide("crossed_torques", nt, nt)
    draft.fill(by_torque.part(0, nt), 0)
    with draft.loop("l", nt) as other, draft.loop("k", nt) as k:
        change = slopes.by_torque.lane(k, other, 1)
        reads = {"weight": tail.coordinate_v(by_q["v_dot"], k), "change": change}
        draft.step(airborne.crossed_by_rate, reads, sum_=by_torque.part(other, 1))
    return crossed, by_torque


def add_drift(b: Balance, slopes: AirborneSlopes, found: Curvatures, crossed: Array) -> None:
    """Add what the drift changes, weighted by the rigid motion's momentum."""
    draft, tail, directions = b.draft, b.draft.tail, slopes.directions
    shift, mass = draft.vector("drift_slope", 3), b.center.only("inverse_mass")
    weight = {"weight": found.by_q["drift"][0], "change": shift}

    # by the momentum
    with draft.loop("k", TURN) as k:
        b.shift(slopes.omega.down(0, k, TURN), shift)
        draft.step(airborne.crossed, weight, sum_=crossed.part(k, 1))

    # by coordinates, and by rates
    with draft.loop("i", tail.segments) as i, draft.loop("k", PER_SEGMENT) as k:
        number = coordinate(i) + k
        lane = directions.of_q(i) + k
        b.shift(slopes.omega.down(0, lane, TURN), shift)
        momentum = {"net": found.by_q["slide"].down(0, number, 3)}
        draft.step(airborne.pushed, mass, momentum, shift_=shift)
        draft.step(airborne.crossed, weight, sum_=crossed.part(lane, 1))

        lane = directions.of_v(i) + k
        b.shift(slopes.omega.down(0, lane, TURN), shift)
        reads = {"column": b.of_tail(number)["column"], "rate": draft.fixed("one", [1])}
        draft.step(airborne.moved_back_by, mass, reads, shift_=shift)
        draft.step(airborne.crossed, weight, sum_=crossed.part(lane, 1))


def store_hessian(
    b: Balance,
    slopes: AirborneSlopes,
    found: Curvatures,
    crossed: tuple[Array, Array],
    weights: Weights,
    arrays: dict[str, Array],
) -> None:
    """Store the Hessian: lower triangle, then its mirror image."""
    draft, tail, H = b.draft, b.draft.tail, arrays["hessian"]
    size, nt = tail.airborne_arguments, tail.nt
    q, v, tau = at_coordinates(tail), at_rates(tail), tail.airborne_state
    draft.fill(H.whole(), 0)
    store_by_omega(b, found, arrays)

    # the quaternion twice, and with coordinates
    reads = {"quaternion": b.quaternion, "angular": arrays["angular"][0]}
    rows = {f"row_{k}_": H.part(k * size, 4) for k in range(4)}
    draft.step(airborne.turned_twice, reads, {"weight": weights.turning[0]}, **rows)
    along, torques = crossed
    with draft.loop("k", nt) as k:
        reads = {"row": along.down(0, k, TURN)}
        row = H.part((k + q) * size, 4)
        draft.step(airborne.by_quaternion, slopes.turn(), reads, row_=row)

    # coordinates, rates and torques
    with draft.loop("i", tail.segments) as i, draft.loop("k", PER_SEGMENT) as k:
        number = coordinate(i) + k
        first, column = (number + q) * size + q, number + (q * size + q)
        of_q, of_v = slopes.directions.of_q(i) + k, slopes.directions.of_v(i) + k
        draft.copy(H.part(first, nt), found.by_q["q"].lane(number + TORSO_NQ, 0, nt), adds=True)
        draft.copy(H.part(first, nt), along.lane(of_q, 0, nt), adds=True)
        draft.copy(H.part(column, nt, size), along.lane(of_q, 0, nt), adds=True)
        first = (number + v) * size
        draft.copy(H.part(first + q, nt), found.by_q["v"].lane(number + TORSO_NV, 0, nt), adds=True)
        draft.copy(H.part(first + q, nt), along.lane(of_v, 0, nt), adds=True)
        draft.copy(H.part(first + v, nt), found.by_v.lane(number + TORSO_NV, 3, nt), adds=True)
        draft.copy(H.part((number + tau) * size + q, nt), torques.lane(number, 0, nt))
    with draft.loop("k", size) as k, draft.loop("l", k) as other:
        draft.copy(H.part(other * size + k, 1), H.part(k * size + other, 1))


def store_by_omega(b: Balance, found: Curvatures, arrays: dict[str, Array]) -> None:
    """Store the terms of pairs of directions of x through omega, in the lower triangle."""
    draft, tail, H, J = b.draft, b.draft.tail, arrays["hessian"], arrays["J"]
    size, count = tail.airborne_arguments, tail.airborne_state
    q, v = at_coordinates(tail), at_rates(tail)

    def turn(k: Index) -> Ref:
        """Return how omega changes along a direction."""
        return J.part(k + size * count, TURN, size)

    # the gradient by omega along each direction, and half of the second derivative by omega
    share = draft.array("turn_share", TURN, count)
    rows = {f"row_{k}": found.by_v.lane(OMEGA.start + k, 0, TURN) for k in range(TURN)}
    with draft.loop("k", count) as k:
        draft.step(airborne.curvature_by_omega, rows, {"omega": turn(k)}, share=share[k])
    columns = {f"column_{k}_": share[k] for k in range(4)}
    draft.step(
        airborne.weighted_turning, {"weight": block(arrays["weights"], QUATERNION)}, **columns
    )
    with draft.loop("k", tail.nt) as k:
        by_q = found.by_q["v"].down(OMEGA.start, k, TURN)
        draft.copy(share[k + q], by_q, adds=True)
        draft.copy(share[k + v], found.by_v.lane(k + TORSO_NV, 0, TURN), adds=True)

    with draft.loop("k", count) as k, draft.loop("l", k + 1) as other:
        reads = {"share": share[k], "other": share[other]}
        reads |= {"turn": turn(k), "other_turn": turn(other)}
        entry = H.part(k * size + other, 1)
        draft.step(airborne.both_by_omega, reads, entry=entry)


ASSEMBLIES: dict[str, Assembly] = {
    "airborne_rates": assemble_rates,
    "airborne_rates_derivatives": assemble_derivatives,
    "airborne_rates_hessian": assemble_hessian,
}
