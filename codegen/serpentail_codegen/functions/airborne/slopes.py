"""First derivatives of the rates of an airborne state, a lane for each number of the state."""

from dataclasses import dataclass

from serpentail_scene.layout import OMEGA, TORSO_NV, VELOCITY

from ...autodiff.forward import tangent_program
from ...ir.program import Array, as_index
from ...mechanics import airborne, rotations
from ..derivatives.differentiated import CORE
from ..derivatives.jacobians import minus, weightless
from ..draft import Draft
from ..function import assemble
from ..layout import block
from ..sweeps.inertia import column_of
from ..tail import Tail
from .balance import (
    QUATERNION,
    TURN,
    Balance,
    assemble_rates,
    at_drift,
    at_rates,
    turn_and_drift,
)
from .equations import AT_BASE, CONSERVED


@dataclass(frozen=True)
class AirborneSlopes:
    """Derivatives of an airborne motion, a lane for each number of x as ``placed`` tells;
    ``by_torque``: of v_dot, a lane for each torque.  ``a``: acceleration of B.
    """

    d_quaternion: Array
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


def placed(tail: Tail) -> tuple[tuple[int, int, int], ...]:
    """Return runs of lanes: their first lane, its position in x, and how many they are.

    Coordinates come first, because only they move momenta at fixed velocities.
    """
    moved = tail.airborne_state - QUATERNION.stop
    return (0, QUATERNION.stop, moved), (moved, QUATERNION.start, QUATERNION.stop)


def store_slopes(draft: Draft, b: Balance, conserved: Array) -> AirborneSlopes:
    """Differentiate the equations of momenta, then those of forces at fixed accelerations."""
    tail, lanes = draft.tail, draft.tail.airborne_state

    def wide(name: str, size: int) -> Array:
        return draft.wide(name, size, lanes)

    # what each lane moves
    d_quaternion, d_q, d_v = wide("d_quaternion", 4), wide("d_q", tail.nq), wide("d_v", tail.nv)
    draft.unit(tail.all_q(d_q), 0)
    draft.fill(d_v.whole(), 0)
    draft.unit(tail.all_v(d_v), tail.nt)
    draft.unit(d_quaternion[0], lanes - QUATERNION.stop)
    if tail.widths:
        draft.unit(d_v.part(0, TORSO_NV), 2 * tail.nt)
    else:
        turn_slopes(draft, b, conserved, (d_quaternion, d_q, d_v))

    # accelerations
    a, rows, d_v_dot = draft.array("a", 3), wide("rows", tail.nv), wide("d_v_dot", tail.nv)
    draft.copy(a[0], block(b.v_dot, VELOCITY))
    inner = tangent_program(assemble(CORE, tail), ("q", "v"), lanes)
    draft.call(inner, q=b.q, v=b.v, v_dot=b.v_dot, a=a, d_q=d_q, d_v=d_v, d_force=rows)
    b.factored.solve(minus(draft, rows), d_v_dot)
    unit = draft.wide("unit_torque", tail.nt, tail.nt)
    by_torque = draft.wide("by_torque", tail.nv, tail.nt)
    draft.unit(unit.whole(), 0)
    b.factored.solve(weightless(draft, lambda k: unit.part(k, 1)), by_torque)
    return AirborneSlopes(d_quaternion, d_v, d_v_dot, by_torque, a)


def turn_slopes(draft: Draft, b: Balance, conserved: Array, moved: tuple[Array, ...]) -> None:
    """Store how omega and the velocity of B change with all numbers of x.

    moved: directions of the quaternion, q and v; they are completed.
    """
    tail, lanes, (d_quaternion, d_q, d_v) = draft.tail, draft.tail.airborne_state, moved
    names = ("d_momentum", "d_linear", "d_angular")
    given, linear, angular = (draft.wide(name, 3, lanes) for name in names)
    inner = tangent_program(assemble(CONSERVED, tail), ("quaternion",), lanes)
    turned = {"quaternion": b.quaternion, "angular": conserved, "d_quaternion": d_quaternion}
    draft.call(inner, d_momentum=given, **turned)
    first = as_index(tail.nt)  # lanes
    inner = tangent_program(assemble(AT_BASE, tail), ("q",), lanes, lambda loops: first)
    draft.call(inner, q=b.q, v=b.v, d_q=d_q, d_linear=linear, d_angular=angular)
    columns = b.factored.columns
    with draft.loop("k", tail.nt) as k:
        reads = {"column": column_of(columns, k), "rate": tail.coordinate_v(d_v, k)}
        draft.step(airborne.tail_momentum, reads, linear_=linear[0], angular_=angular[0])
    body = b.factored.body
    turn_and_drift(draft, b.inertia, body, given[0], linear[0], angular[0], d_v)


def drift_slopes(draft: Draft, b: Balance, slopes: AirborneSlopes) -> Array:
    """Return how the rate of the velocity against the air changes with all numbers of x."""
    lanes = draft.tail.airborne_state
    rate, own = draft.wide("d_drift_rate", 3, lanes), draft.wide("d_own_pull", 3, lanes)
    inner = tangent_program(assemble(CONSERVED, draft.tail), ("quaternion",), lanes)
    assert b.pull is not None  # as it is in air
    reads = {"quaternion": b.quaternion, "angular": b.pull, "d_quaternion": slopes.d_quaternion}
    draft.call(inner, d_momentum=own, **reads)
    changes = {"a": block(slopes.d_v_dot, VELOCITY), "pull": own[0]}
    changes |= {"turn": block(slopes.d_v, OMEGA), "drift": block(slopes.d_v, VELOCITY)}
    motion = {"omega": block(b.v, OMEGA), "u": block(b.v, VELOCITY)}
    draft.step(airborne.drift_change, changes, motion, rate=rate[0])
    return rate


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
    sources = [
        (rate, 0, 0, 4),
        (slopes.d_v_dot, TORSO_NV, second, nt),
        (slopes.d_v, OMEGA.start, count, TURN),
    ]
    if tail.widths:
        first = at_drift(tail)
        sources.append((drift_slopes(draft, b, slopes), 0, first, 3))
        sources.append((slopes.d_v_dot, OMEGA.start, first + 3, TURN))
    for source, first, row, rows in sources:
        with draft.loop("row", rows) as r:
            for lane, at, some in placed(tail):
                draft.copy(J.part((r + row) * size + at, some), source.lane(r + first, lane, some))
    with draft.loop("k", nt) as k:
        draft.fill(J.part((k + QUATERNION.stop) * size + k + second, 1), 1)
        to = J.part((k + second) * size + count, nt)
        draft.copy(to, slopes.by_torque.lane(k + TORSO_NV, 0, nt))
    with draft.loop("row", TORSO_NV if tail.widths else 0) as r:
        to = J.part((r + at_drift(tail)) * size + count, nt)
        draft.copy(to, slopes.by_torque.lane(r, 0, nt))
