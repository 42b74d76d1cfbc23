"""First derivatives of the rates of an airborne state, a lane for each number of the state."""

from dataclasses import dataclass

from serpentail_scene.layout import OMEGA, TORSO_NV, VELOCITY

from ...autodiff.forward import tangent_program
from ...ir.program import Array
from ...mechanics import rotations
from ..derivatives.differentiated import CORE
from ..derivatives.jacobians import minus, weightless
from ..draft import Draft
from ..function import Function, assemble
from ..layout import block
from .balance import (
    QUATERNION,
    TURN,
    Balance,
    assemble_rates,
    at_coordinates,
    at_rates,
    turn_and_drift,
)
from .equations import AT_BASE, CONSERVED


@dataclass(frozen=True)
class AirborneSlopes:
    """Derivatives of an airborne motion, a lane for each number of x; ``by_torque``: of v_dot, a
    lane for each torque.  ``a``: acceleration of B.
    """

    d_quaternion: Array
    d_q: Array
    d_v: Array
    d_v_dot: Array
    by_torque: Array
    a: Array


def assemble_derivatives(draft: Draft, arrays: dict[str, Array]) -> tuple[Balance, AirborneSlopes]:
    """Rates of an airborne state with their Jacobian."""
    b = assemble_rates(draft, arrays)
    slopes = store_slopes(draft, b, arrays["angular"])
    store_jacobian(draft, b, slopes, arrays["J"])
    return b, slopes


def store_slopes(draft: Draft, b: Balance, conserved: Array) -> AirborneSlopes:
    """Differentiate the equations of momenta, then those of forces at fixed accelerations."""
    tail, lanes = draft.tail, draft.tail.airborne_state

    def wide(name: str, size: int) -> Array:
        return draft.wide(name, size, lanes)

    def tangents(function: Function, *active: str, **arguments: Array) -> None:
        draft.call(tangent_program(assemble(function, tail), active, lanes), **arguments)

    # what each lane moves
    d_quaternion, d_q, d_v = wide("d_quaternion", 4), wide("d_q", tail.nq), wide("d_v", tail.nv)
    draft.unit(d_quaternion[0], QUATERNION.start)
    draft.unit(tail.all_q(d_q), at_coordinates(tail))
    draft.fill(d_v.whole(), 0)
    draft.unit(tail.all_v(d_v), at_rates(tail))

    # omega, and the velocity of B
    given, linear, angular = (wide(name, 3) for name in ("d_momentum", "d_linear", "d_angular"))
    turned = {"quaternion": b.quaternion, "angular": conserved, "d_quaternion": d_quaternion}
    tangents(CONSERVED, "quaternion", d_momentum=given, **turned)
    moved = {"q": b.q, "v": b.v, "d_q": d_q, "d_v": d_v}
    tangents(AT_BASE, "q", "v", d_linear=linear, d_angular=angular, **moved)
    body = b.factored.body
    turn_and_drift(draft, b.inertia, body, given[0], linear[0], angular[0], d_v)

    # accelerations
    a, rows, d_v_dot = draft.array("a", 3), wide("rows", tail.nv), wide("d_v_dot", tail.nv)
    draft.copy(a[0], block(b.v_dot, VELOCITY))
    tangents(CORE, "q", "v", v_dot=b.v_dot, a=a, d_force=rows, **moved)
    b.factored.solve(minus(draft, rows), d_v_dot)
    unit = draft.wide("unit_torque", tail.nt, tail.nt)
    by_torque = draft.wide("by_torque", tail.nv, tail.nt)
    draft.unit(unit.whole(), 0)
    b.factored.solve(weightless(draft, lambda k: unit.part(k, 1)), by_torque)
    return AirborneSlopes(d_quaternion, d_q, d_v, d_v_dot, by_torque, a)


def store_jacobian(draft: Draft, b: Balance, slopes: AirborneSlopes, J: Array) -> None:
    """Store d(y)/d(x, tau), row by row."""
    tail, size = draft.tail, draft.tail.airborne_arguments
    nt, count, second = tail.nt, tail.airborne_state, at_rates(tail)
    omega, turn = block(b.v, OMEGA), block(slopes.d_v, OMEGA)
    rate = draft.wide("d_rate", 4, count)
    reads = {"quaternion": slopes.d_quaternion[0], "turn": omega}
    draft.step(rotations.turned_quaternion, reads, rate=rate[0])
    reads = {"quaternion": b.quaternion[0], "turn": turn}
    draft.step(rotations.turned_quaternion, reads, rate_=rate[0])

    draft.fill(J.whole(), 0)
    sources = (rate, 0, 0, 4), (slopes.d_v_dot, TORSO_NV, second, nt), (slopes.d_v, OMEGA.start, count, TURN)
    for source, first, row, rows in sources:
        with draft.loop("row", rows) as r:
            draft.copy(J.part((r + row) * size, count), source.lane(r + first, 0, count))
    with draft.loop("k", nt) as k:
        draft.fill(J.part((k + at_coordinates(tail)) * size + k + second, 1), 1)
        to = J.part((k + second) * size + count, nt)
        draft.copy(to, slopes.by_torque.lane(k + TORSO_NV, 0, nt))
