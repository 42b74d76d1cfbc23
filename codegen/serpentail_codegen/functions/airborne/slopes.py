"""First derivatives of the rates of an airborne state.

Lanes are directions: the angular momentum in torso axes, then coordinates and rates of segment
after segment. The quaternion acts only through that momentum.
"""

from dataclasses import dataclass

from serpentail_scene.layout import OMEGA, PER_SEGMENT, TORSO_NV, VELOCITY

from ...autodiff.forward import tangent_program
from ...ir.program import Array, Index, Ref
from ...mechanics import airborne, rotations
from ..derivatives.differentiated import CORE
from ..derivatives.directions import Directions
from ..draft import Draft
from ..function import assemble
from ..layout import block, coordinate
from ..sweeps.inertia import column_of
from .balance import (
    TURN,
    Accelerations,
    Balance,
    assemble_rates,
    at_coordinates,
    at_rates,
)


@dataclass(frozen=True)
class AirborneSlopes:
    """Derivatives of an airborne state's unknowns, row by row, along all directions.

    ``omega`` (3 rows); ``tail``: q_t_ddot (nt rows); ``loads``: net and turn_load (3 rows each).
    ``by_omega`` (nv x 3): C along omega alone.
    ``by_torque``: q_t_ddot along torques (nt rows).
    ``turns`` (4 x 3): the momentum along the numbers of the quaternion.
    ``a``: acceleration of B.
    """

    directions: Directions
    omega: Array
    tail: Array
    loads: Array
    by_omega: Array
    by_torque: Array
    turns: Array
    a: Array

    def turn(self) -> dict[str, Ref]:
        """Return how the momentum in torso axes changes with the numbers of the quaternion."""
        return {f"turn_{k}": self.turns[k] for k in range(4)}


def assemble_derivatives(
    draft: Draft, arrays: dict[str, Array]
) -> tuple[Balance, Accelerations, AirborneSlopes]:
    """Rates of an airborne state with their Jacobian."""
    b, motion = assemble_rates(draft, arrays)
    slopes = store_slopes(b, motion)
    store_jacobian(b, slopes, arrays["J"])
    return b, motion, slopes


def store_slopes(b: Balance, motion: Accelerations) -> AirborneSlopes:
    """Differentiate the inertial forces at fixed accelerations, then solve."""
    draft, tail, directions = b.draft, b.draft.tail, Directions(b.draft.tail, ("omega",))
    lanes = directions.count

    # accelerations of the torso, which the rows of the tail do not need
    a = draft.array("a", 3)
    draft.solve(b.inertia, block(motion.v_dot, OMEGA))
    b.follow(motion.v_dot, block(motion.v_dot, OMEGA), a[0], motion.net)

    # tangents of H v_dot + C in torso axes
    inner = tangent_program(assemble(CORE, tail), ("q", "v"), lanes, directions.outward)
    rows, arguments = (
        draft.wide("rows", tail.nv, lanes),
        {"q": b.q, "v": b.v, "v_dot": motion.v_dot, "a": a},
    )
    draft.call(inner, d_force=rows, **arguments, **directions.tangents(draft))

    omega = draft.wide("omega_slopes", TURN, lanes)
    store_omega(b, directions, rows, omega)
    by_omega = chain(draft, rows, omega)

    # loads of these changes, and accelerations that balance them
    loads, tail_slopes = draft.wide("loads", 6, lanes), draft.wide("tail_slopes", tail.nt, lanes)
    net, turn_load = loads.part(0, 3), loads.part(3, 3)
    reads = {"force": block(rows, VELOCITY), "moment": block(rows, OMEGA)}
    draft.step(airborne.torso_load, b.center.only("com"), reads, net=net, turn_load=turn_load)
    with draft.loop("k", tail.nt) as k:
        reads = b.of_tail(k) | {
            "inertial": tail.coordinate_v(rows, k),
            "net": net,
            "turn_load": turn_load,
        }
        target = tail_slopes.part(k, 1)
        step = airborne.torque_without_torso
        draft.step(step, b.center.only("inverse_mass"), reads, load=target)
    draft.solve(b.M, tail_slopes.part(0, tail.nt))
    by_torque = draft.wide("torque_slopes", tail.nt, tail.nt)
    draft.unit(by_torque.part(0, tail.nt), 0)
    draft.solve(b.M, by_torque.part(0, tail.nt))

    turns = draft.array("turns", 3, 4)
    columns = {f"column_{k}": turns[k] for k in range(4)}
    reads = {"quaternion": b.quaternion, "momentum": b.momentum}
    draft.step(airborne.turn_of_quaternion, reads, **columns)
    return AirborneSlopes(directions, omega, tail_slopes, loads, by_omega, by_torque, turns, a)


def store_omega(b: Balance, directions: Directions, rows: Array, omega: Array) -> None:
    """Store the derivatives of omega: by the momentum, and by the momentum that the tail takes from
    the torso.
    """
    draft, tail = b.draft, b.draft.tail
    draft.unit(omega.part(0, TURN), 0)
    forces = {f"row_{axis}": rows.lane(k, 0, TURN) for k, axis in enumerate("xyz")}
    with draft.loop("i", tail.segments) as i, draft.loop("k", PER_SEGMENT) as k:
        number, rate = coordinate(i) + k, directions.of_v(i) + k
        reads = {"column": column_of(b.columns, number), "coupling": b.coupling[number]}
        reads |= {
            "w": b.omega,
            "force": rows.down(VELOCITY.start, rate, 3),
            "moment": rows.down(OMEGA.start, rate, 3),
            "row": rows.lane(number + TORSO_NV, 0, TURN),
        }
        target = omega.down(0, directions.of_q(i) + k, TURN)
        draft.step(airborne.momentum_slope, b.center, reads, forces, momentum=target)
        one = {"gain": b.coupling[number], "rate": draft.fixed("one", [1])}
        draft.step(airborne.taken_back, one, part=omega.down(0, rate, TURN))
    draft.solve(b.inertia, omega.part(0, TURN))


def chain(draft: Draft, rows: Array, omega: Array) -> Array:
    """Turn slopes at fixed omega into slopes at fixed momentum; return the slopes along omega."""
    by_omega = draft.array("by_omega", TURN, draft.tail.nv)
    turning = {f"omega_{k}": omega.part(k, 1) for k in range(TURN)}
    with draft.loop("row", draft.tail.nv) as r:
        draft.copy(by_omega[r], rows.lane(r, 0, TURN))
        draft.fill(rows.lane(r, 0, TURN), 0)
        draft.step(airborne.chained_row, turning, {"by_omega": by_omega[r]}, row_=rows.part(r, 1))
    return by_omega


def store_jacobian(b: Balance, slopes: AirborneSlopes, J: Array) -> None:
    """Store d(y)/d(x, tau), row by row."""
    draft, tail, directions = b.draft, b.draft.tail, slopes.directions
    size, nt = tail.airborne_arguments, tail.nt
    q, v, tau = at_coordinates(tail), at_rates(tail), tail.airborne_state

    def spread(row: Index, source: Array, number: Index) -> None:
        reads = {"row": source.lane(number, 0, TURN)}
        first = row * size
        draft.step(airborne.by_quaternion, slopes.turn(), reads, row=J.part(first, 4))
        with draft.loop("i", tail.segments) as i:
            for start, lane in ((q, directions.of_q(i)), (v, directions.of_v(i))):
                to = J.part(first + coordinate(i) + start, PER_SEGMENT)
                draft.copy(to, source.lane(number, lane, PER_SEGMENT))

    # of the rates of coordinates, of q_t_ddot, of omega
    draft.fill(J.whole(), 0)
    with draft.loop("k", nt) as k:
        draft.fill(J.part(size * q + v + (size + 1) * k, 1), 1)
        spread(k + v, slopes.tail, k)
        to = J.part(size * k + (size * v + tau), nt)
        draft.copy(to, slopes.by_torque.lane(k, 0, nt))
    with draft.loop("k", TURN) as k:
        spread(k + tau, slopes.omega, k)

    # of the quaternion's rate
    turning = {"quaternion": b.quaternion}
    with draft.loop("k", tau) as k:
        reads = turning | {"turn": J.part(k + size * tau, TURN, size)}
        draft.step(rotations.turned_quaternion, reads, rate=J.part(k, 4, size))
    rows = {f"row_{k}_": J.part(k * size, 4) for k in range(4)}
    draft.step(airborne.turning_by_quaternion, {"omega": b.omega}, **rows)
