"""Rates of an airborne state: omega from the angular momentum, then accelerations as of any state.

Motion is taken in torso axes: ``v`` begins with the velocity of B relative to the COM, ``v_dot``
with its acceleration less gravity. In air no momentum is conserved: x ends with the velocity of B
against the air and omega, which are ``v``.
"""

from dataclasses import dataclass

from serpentail_scene.layout import OMEGA, TORSO_NV, VELOCITY

from ...ir.program import Array, Index, Ref, padded
from ...mechanics import airborne, rotations, translation
from ..air import core_airspeed
from ..derivatives.jacobians import minus
from ..draft import Draft
from ..factored import FactoredDynamics, eliminate_translation
from ..function import assemble
from ..layout import block
from ..passive import add_passive_forces
from ..scope import Vectors
from ..sweeps.inertia import animal_inertia, column_of
from ..sweeps.pieces import IDENTITY
from ..sweeps.wrenches import core_bias
from ..tail import Tail
from .equations import CONSERVED

QUATERNION = slice(0, 4)  # in x, before the tail's coordinates
TURN = 3  # numbers of omega, of a moment


def at_rates(tail: Tail) -> int:
    """Position of the tail's rates in x."""
    return QUATERNION.stop + tail.nt


def at_drift(tail: Tail) -> int:
    """Position of the velocity against the air in x, before omega."""
    return QUATERNION.stop + 2 * tail.nt


@dataclass(frozen=True)
class Balance:
    """An airborne state, its accelerations, and what they are solved with.

    ``inertia``: about the COM, factored; ``factored``: H without translation, in torso axes;
    ``pull``: gravity, world axes, in air.
    """

    q: Array
    v: Array
    v_dot: Array
    quaternion: Array
    inertia: Array
    factored: FactoredDynamics
    pull: Array | None = None


def turn_and_drift(
    draft: Draft, inertia: Array, body: Vectors, given: Ref, linear: Ref, angular: Ref, v: Array
) -> None:
    """Store omega, and the velocity of B, with which the animal has a given angular momentum and no
    linear one, beside momenta at B that it has already.
    """
    zero, omega = draft.zero(3), block(v, OMEGA)
    reads = {"force": linear, "moment": angular, "load_force": zero, "load_moment": given}
    net = draft.wide(f"net_{v.name}", 3, v.lanes)[0]
    draft.step(translation.rotational_load, body, reads, net=net, rhs=omega)
    draft.solve(inertia, omega)
    reads = {"net": net, "w_dot": omega}
    draft.step(translation.free_acceleration, body, reads, a=block(v, VELOCITY))


def assemble_rates(draft: Draft, arrays: dict[str, Array]) -> Balance:
    """Rates of an airborne state, and omega."""
    tail, x, nt = draft.tail, arrays["x"], draft.tail.nt
    q, v, v_dot = (
        draft.array("q", tail.nq),
        draft.array("v", tail.nv),
        draft.array("v_dot", tail.nv),
    )
    draft.copy(tail.all_q(q), x.part(QUATERNION.stop, nt))
    draft.copy(tail.all_v(v), x.part(at_rates(tail), nt))
    quaternion = draft.array("quaternion", 4)
    draft.copy(quaternion[0], block(x, QUATERNION))

    # H without translation
    row, columns = tail.rotational_row, draft.array("columns", 6, nt)
    A, inertia = draft.array("A", row * tail.rotational), draft.array("I_com", padded(TURN) * TURN)

    def entry(r: Index | int, column: Index | int, entries: int = 1) -> Ref:
        return A.part(r * row + column, entries)

    def A_tail(k: Index, other: Index, entries: int = 1) -> Ref:
        return entry(k + TURN, other + TURN, entries)

    segments, composite = animal_inertia(draft, draft.state(q, v), A_tail, columns)
    center = draft.vectors(inverse_mass=1, com=3)
    eliminate_translation(draft, composite, center, columns, entry)
    for r in range(TURN):
        draft.copy(inertia.part(padded(TURN) * r, r + 1), entry(r, 0, r + 1))
    draft.factor(inertia, TURN)
    draft.factor(A, tail.rotational)
    if tail.widths:
        draft.copy(v.part(0, TORSO_NV), x.part(at_drift(tail), TORSO_NV))
    else:
        turn_with_momentum(draft, arrays["angular"], quaternion, (inertia, center, columns), v)

    # accelerations
    bias = draft.array("bias", tail.nv)
    state = segments[0].state
    core_bias(draft, segments, bias, core_airspeed(draft, state))
    add_passive_forces(draft, state, lambda i: draft.tail.segment_v(bias, i))
    axes = {"R": draft.fixed("identity", IDENTITY), "h": composite["h"]}
    factored = FactoredDynamics(draft, A, columns, bias, Vectors({**center, **axes}))
    factored.solve(minus(draft, bias, lambda k: arrays["tau"].part(k, 1)), v_dot)

    # y
    y, second = arrays["y"], at_rates(tail)
    reads = {"quaternion": quaternion[0], "turn": block(v, OMEGA)}
    draft.step(rotations.turned_quaternion, reads, rate=block(y, QUATERNION))
    draft.copy(y.part(QUATERNION.stop, nt), tail.all_v(v))
    draft.copy(y.part(second, nt), tail.all_v(v_dot))
    draft.copy(y.part(tail.airborne_state, TURN), block(v, OMEGA))
    pull = drift_rate(draft, quaternion, v, v_dot, y) if tail.widths else None
    return Balance(q, v, v_dot, quaternion, inertia, factored, pull)


def drift_rate(draft: Draft, quaternion: Array, v: Array, v_dot: Array, y: Array) -> Array:
    """Store the rates of the velocity against the air and of omega; return gravity, world axes."""
    pull, own = draft.array("pull", 3), draft.array("own_pull", 3)
    draft.step(airborne.upward, pull=pull[0])
    draft.call(assemble(CONSERVED, draft.tail), quaternion=quaternion, angular=pull, momentum=own)
    reads = {"a": block(v_dot, VELOCITY), "pull": own[0], "u": block(v, VELOCITY)}
    first = at_drift(draft.tail)
    draft.step(airborne.drift_rate, reads, {"omega": block(v, OMEGA)}, rate=y.part(first, 3))
    draft.copy(y.part(first + 3, TURN), block(v_dot, OMEGA))
    return pull


def turn_with_momentum(
    draft: Draft, given: Array, quaternion: Array, body: tuple[Array, Vectors, Array], v: Array
) -> None:
    """Store omega, and the velocity of B: what the angular momentum leaves to the torso beside the
    tail. ``body``: inertia and COM, and the columns of the tail.
    """
    tail, (inertia, center, columns) = draft.tail, body
    momentum, linear, angular = (draft.array(n, 3) for n in ("momentum", "linear", "own_angular"))
    conserved = {"quaternion": quaternion, "angular": given, "momentum": momentum}
    draft.call(assemble(CONSERVED, tail), **conserved)
    draft.fill(linear[0], 0)
    draft.fill(angular[0], 0)
    with draft.loop("k", tail.nt) as k:
        reads = {"column": column_of(columns, k), "rate": tail.coordinate_v(v, k)}
        draft.step(airborne.tail_momentum, reads, linear_=linear[0], angular_=angular[0])
    turn_and_drift(draft, inertia, center, momentum[0], linear[0], angular[0], v)
