"""Second derivatives: the Hessian of lambda^T (H v_dot + C)."""

from dataclasses import dataclass

from ...autodiff.forward import tangent_program
from ...autodiff.reverse import adjoint_program
from ...ir.program import Array, Index, Ref, as_index
from ...mechanics import rotations, torso
from ..draft import Draft
from ..function import assemble
from ..layout import OMEGA, QUATERNION, TORSO_NQ, TORSO_NV, VELOCITY, block, coordinate
from ..scope import State
from ..sweeps.pieces import attitude
from .differentiated import INERTIA, VIRTUAL_POWER
from .directions import TORSO, Directions
from .jacobians import with_unit_quaternion


def assemble_inverse_dynamics_hessian(draft: Draft, arrays: dict[str, Array]) -> None:
    """Tangents of the gradient of lambda^T (H v_dot + C) with respect to q and v; its mixed block
    by those of H lambda.

    Only the lower triangle is computed: rows of segment i in the lanes of segments up to i.
    """
    tail, nv = draft.tail, draft.tail.nv
    directions = Directions(tail, ("turn", "omega"))
    lanes = directions.count
    inner = adjoint_program(assemble(VIRTUAL_POWER, tail), ("q", "v", "v_dot"), ("power",))
    inner = tangent_program(inner, ("q", "v"), lanes, directions.up_to)

    # tangents of the gradient
    b_q, b_v = draft.wide("d_b_q", tail.nq, lanes), draft.wide("d_b_v", nv, lanes)
    b_v_dot = draft.wide("d_b_v_dot", nv, lanes)
    q = with_unit_quaternion(draft, arrays["q"])
    arguments = {"q": q} | {name: arrays[name] for name in ("v", "v_dot", "multiplier")}
    d_q = directions.tangents(draft, q)
    outputs = {"d_b_q": b_q, "d_b_v": b_v, "d_b_v_dot": b_v_dot}
    draft.call(inner, b_power=draft.constant("one", [1]), **outputs, **arguments, **d_q)
    turn = draft.wide("d_b_turn", 3, lanes)[0]
    reads = {"quaternion": block(q, QUATERNION), "gradient": block(b_q, QUATERNION)}
    draft.step(rotations.turn_gradient, reads, turn=turn)

    # to the blocks of the Hessian
    rows = {"turn": turn, "omega": block(b_v, OMEGA)}
    Mirror(draft, directions, arrays).copy(rows, b_q, b_v)
    mixed_block(draft, q, arrays["multiplier"], arrays["aq"])
    with draft.loop("row", nv) as row:
        draft.copy(arrays["aq"].part(nv * row + OMEGA.start, 3), b_v_dot.lane(row, 0, 3))


@dataclass(frozen=True)
class Place:
    """A row or column of the Hessian: its number, and whether it is of q or of v."""

    number: Index
    is_q: bool


@dataclass(frozen=True)
class Mirror:
    """Copies the lower triangle of the Hessian to the blocks qq, qv and vv, and mirrors it."""

    draft: Draft
    directions: Directions
    blocks: dict[str, Array]

    def copy(self, torso: dict[str, Ref], of_q: Array, of_v: Array) -> None:
        """Copy the rows of the torso, then those of the tail."""
        draft, nv = self.draft, self.draft.tail.nv
        for name in ("qq", "qv", "vv"):
            draft.fill(self.blocks[name].part(0, nv * nv), 0)
        for name in self.directions.torso:
            where, is_q = TORSO[name]
            with draft.loop("k", 3) as k:
                row = torso[name].array.part(torso[name].offset + k, 1)
                self._row(row, Place(k + where.start, is_q), None)
        with draft.loop("i", draft.tail.segments) as i, draft.loop("k", 2) as k:
            number = coordinate(i) + k
            self._row(of_q.part(number + TORSO_NQ, 1), Place(number + TORSO_NV, True), i + 1)
            self._row(of_v.part(number + TORSO_NV, 1), Place(number + TORSO_NV, False), i + 1)

    def _row(self, row: Ref, place: Place, segments: Index | None) -> None:
        """Copy one row: lanes of the torso, and of so many segments."""
        directions = self.directions
        for lane, name in enumerate(directions.torso):
            where, is_q = TORSO[name]
            self._entries(row, place, as_index(3 * lane), Place(as_index(where.start), is_q), 3)
        if segments is None:
            return
        with self.draft.loop("l", segments) as other:
            column = coordinate(other) + TORSO_NV
            self._entries(row, place, directions.of_q(other), Place(column, True), 2)
            self._entries(row, place, directions.of_v(other), Place(column, False), 2)

    def _entries(self, row: Ref, place: Place, lane: Index, column: Place, size: int) -> None:
        """Copy lanes of one row to the block they belong to, and to the mirrored place."""
        nv, source = self.draft.tail.nv, row.array.lane(row.offset, lane, size)
        name = "qv"
        if place.is_q == column.is_q:
            name = "qq" if place.is_q else "vv"
        block = self.blocks[name]
        if place.is_q or not column.is_q:
            self.draft.copy(block.part(nv * place.number + column.number, size), source)
        if column.is_q or not place.is_q:
            self.draft.copy(block.part(nv * column.number + place.number, size, nv), source)


def mixed_block(draft: Draft, q: Array, multiplier: Array, aq: Array) -> None:
    """d(H lambda)/d(q_t): tangents of the inertia's force for the acceleration lambda, then brought
    to world axes.
    """
    tail, nv = draft.tail, draft.tail.nv
    directions = Directions(tail, (), rates=False)
    inner = tangent_program(assemble(INERTIA, tail), ("q",), directions.count, directions.outward)
    rows = draft.wide("inertial_rows", nv, directions.count)
    body = draft.array("multiplier_in_torso_axes", nv)
    R = {"R": attitude(draft, State(q))}
    p_dot = {"p_dot": block(multiplier, VELOCITY)}
    draft.step(torso.torso_velocity, R, p_dot, u=block(body, VELOCITY))
    rest = slice(OMEGA.start, nv)
    draft.copy(block(body, rest), block(multiplier, rest))
    draft.call(inner, q=q, v_dot=body, d_force=rows, **directions.tangents(draft, q))
    force = block(rows, VELOCITY)
    draft.step(rotations.world_vector, R, {"vector": force}, vector=force)
    directions.spread(draft, rows, aq)


ASSEMBLIES = {"inverse_dynamics_hessian": assemble_inverse_dynamics_hessian}
