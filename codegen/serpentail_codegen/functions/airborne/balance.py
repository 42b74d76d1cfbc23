"""Rates of an airborne state: omega from the angular momentum, q_t_ddot from the equations of the
tail.
"""

from dataclasses import dataclass

from serpentail_scene.layout import OMEGA, VELOCITY

from ...ir.program import Array, Index, Ref, padded
from ...mechanics import airborne, rotations, translation
from ..draft import Draft
from ..layout import block
from ..passive import add_passive_forces
from ..scope import Vectors
from ..sweeps.inertia import animal_inertia, column_of
from ..sweeps.wrenches import core_bias
from ..tail import Tail

QUATERNION = slice(0, 4)  # in x
TURN = 3  # numbers of omega, of a moment


def at_coordinates(tail: Tail) -> int:
    """Position of the tail's coordinates in x."""
    return QUATERNION.stop


def at_rates(tail: Tail) -> int:
    """Position of the tail's rates in x."""
    return QUATERNION.stop + tail.nt


@dataclass(frozen=True)
class Balance:
    """An airborne state, and the quantities with which its accelerations are solved.

    ``inertia``: about the COM, factored.
    ``M``: of the tail while the torso follows, factored.
    ``columns``, ``coupling``, ``gain``: for each tail coordinate its momentum at B, its momentum
    about the COM, and how its rate turns the torso.
    ``center``: ``inverse_mass, com``.
    ``bias``: C and the forces of passive parts.
    """

    draft: Draft
    q: Array
    v: Array
    quaternion: Ref
    momentum: Ref
    inertia: Array
    M: Array
    columns: Array
    coupling: Array
    gain: Array
    center: Vectors
    bias: Array

    @property
    def omega(self) -> Ref:
        """Angular velocity of the torso."""
        return block(self.v, OMEGA)

    def of_tail(self, k: Index) -> dict[str, Ref]:
        """Return ``column`` and ``gain`` of a tail coordinate."""
        return {"column": column_of(self.columns, k), "gain": self.gain[k]}

    def follow(self, rates: Array, turn: Ref, shift: Ref, net: Ref | None = None) -> None:
        """Add to ``turn`` how the torso follows the tail's rates, or its second derivatives.

        ``turn`` initially holds the motion of the torso by itself; ``shift`` is the motion of B,
        which a net force moves, too.
        """
        with self.draft.loop("k", self.draft.tail.nt) as k:
            reads = {"gain": self.gain[k], "rate": self.draft.tail.coordinate_v(rates, k)}
            self.draft.step(airborne.taken_back, reads, part_=turn)
        self.shift(turn, shift, rates)
        if net:
            mass = self.center.only("inverse_mass")
            self.draft.step(airborne.pushed, mass, {"net": net}, shift_=shift)

    def shift(self, turn: Ref, shift: Ref, rates: Array | None = None) -> None:
        """Compute how B moves if the COM rests while the torso turns and the tail has rates."""
        com, mass = self.center.only("com"), self.center.only("inverse_mass")
        self.draft.step(airborne.drift_of_turn, com, {"turn": turn}, shift=shift)
        if rates is None:
            return
        tail = self.draft.tail
        with self.draft.loop("k", tail.nt) as k:
            reads = {"column": column_of(self.columns, k), "rate": tail.coordinate_v(rates, k)}
            self.draft.step(airborne.moved_back_by, mass, reads, shift_=shift)


@dataclass(frozen=True)
class Accelerations:
    """Accelerations of an airborne state: ``v_dot``, and ``a`` of B less gravity, torso axes."""

    v_dot: Array
    net: Ref


def balance(draft: Draft, arrays: dict[str, Array]) -> Balance:
    """Store the state with omega, the quantities that its accelerations are solved with, and their
    bias.
    """
    tail, x = draft.tail, arrays["x"]
    q, v = draft.array("q", tail.nq), draft.array("v", tail.nv)
    draft.copy(tail.all_q(q), x.part(at_coordinates(tail), tail.nt))
    draft.copy(tail.all_v(v), x.part(at_rates(tail), tail.nt))
    quaternion = block(x, QUATERNION)

    # the total angular momentum, in torso axes
    R = draft.store(rotations.quaternion_rotation, {"quaternion": quaternion}, R=9)
    momentum = draft.vector("momentum", 3)
    draft.step(airborne.momentum_in_torso, R, {"angular": arrays["angular"][0]}, momentum=momentum)

    # inertia of the tail, and of all without translation
    row, nt = padded(tail.nt), tail.nt
    M, inertia = draft.array("M", row * nt), draft.array("I_com", padded(TURN) * TURN)

    def M_tail(k: Index, other: Index, entries: int = 1) -> Ref:
        return M.part(row * k + other, entries)

    columns = draft.array("columns", 6, nt)
    segments, composite = animal_inertia(draft, draft.state(q, v), M_tail, columns)
    center = draft.vectors(inverse_mass=1, com=3)
    rows = {f"A_{r}": inertia.part(padded(TURN) * r, r + 1) for r in range(TURN)}
    draft.step(translation.without_translation, composite, **center, **rows)
    draft.factor(inertia, TURN)

    # without the torso
    coupling, gain = draft.array("coupling", 3, nt), draft.array("gain", 3, nt)
    omega = block(v, OMEGA)
    draft.copy(omega, momentum)
    with draft.loop("k", nt) as k:
        reads = {"column": column_of(columns, k)}
        draft.step(
            translation.column_without_translation, center.only("com"), reads, A_row=coupling[k]
        )
        draft.copy(gain[k], coupling[k])
        draft.solve(inertia, gain[k])
        reads = {"gain": coupling[k], "rate": tail.coordinate_v(v, k)}
        draft.step(airborne.taken_back, reads, part_=omega)
        with draft.loop("l", k + 1) as other:
            reads = {"column": column_of(columns, k), "other": column_of(columns, other)}
            reads |= {"coupling": coupling[k], "gain": gain[other]}
            draft.step(
                airborne.pair_without_torso,
                center.only("inverse_mass"),
                reads,
                entry_=M_tail(k, other),
            )
    draft.solve(inertia, omega)
    draft.factor(M, nt)

    bias = draft.array("bias", tail.nv)
    core_bias(draft, segments, bias)
    add_passive_forces(draft, segments[0].state, lambda i: draft.tail.segment_v(bias, i))
    tail_momenta = columns, coupling, gain
    return Balance(draft, q, v, quaternion, momentum, inertia, M, *tail_momenta, center, bias)


def second_derivatives(b: Balance, arrays: dict[str, Array]) -> Accelerations:
    """Store omega_dot's load, and q_t_ddot."""
    draft, tail = b.draft, b.draft.tail
    v_dot, loads = draft.array("v_dot", tail.nv), draft.vectors(net=3)
    reads = {"force": block(b.bias, VELOCITY), "moment": block(b.bias, OMEGA)}
    turn_load = block(v_dot, OMEGA)
    draft.step(airborne.torso_load, b.center.only("com"), reads, **loads, turn_load=turn_load)
    with draft.loop("k", tail.nt) as k:
        target = tail.coordinate_v(v_dot, k)
        draft.copy(target, arrays["tau"].part(k, 1))
        reads = b.of_tail(k) | {
            "inertial": tail.coordinate_v(b.bias, k),
            "turn_load": turn_load,
        }
        mass = b.center.only("inverse_mass")
        draft.step(airborne.torque_without_torso, mass, loads, reads, load_=target)
    draft.solve(b.M, tail.all_v(v_dot))
    return Accelerations(v_dot, loads["net"])


def store_rates(b: Balance, motion: Accelerations, y: Array) -> None:
    """Store the rates of x, then omega."""
    draft, tail = b.draft, b.draft.tail
    first, second = at_coordinates(tail), at_rates(tail)
    reads = {"quaternion": b.quaternion, "turn": b.omega}
    draft.step(rotations.turned_quaternion, reads, rate=block(y, QUATERNION))
    draft.copy(y.part(first, tail.nt), tail.all_v(b.v))
    draft.copy(y.part(second, tail.nt), tail.all_v(motion.v_dot))
    draft.copy(y.part(second + tail.nt, TURN), b.omega)


def assemble_rates(draft: Draft, arrays: dict[str, Array]) -> tuple[Balance, Accelerations]:
    """Rates of an airborne state, and omega."""
    b = balance(draft, arrays)
    motion = second_derivatives(b, arrays)
    store_rates(b, motion, arrays["y"])
    return b, motion
