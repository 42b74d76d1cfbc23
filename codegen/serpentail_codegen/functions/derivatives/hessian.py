"""Second derivatives: a tail's sizes go in, the loop nest of the Hessian of lambda^T (H v_dot + C)
comes out.
"""

from ...autodiff.forward import tangent_program
from ...autodiff.reverse import adjoint_program
from ...ir.program import Array, Index, Ref, as_index
from ...mechanics import rotations, torso
from ..draft import Draft
from ..function import assemble
from .directions import TORSO, Directions
from .jacobians import INERTIA, VIRTUAL_POWER, with_unit_quaternion


def assemble_inverse_dynamics_hessian(d: Draft, arrays: dict[str, Array]) -> None:
    """Tangents of the gradient of lambda^T (H v_dot + C) with respect to q and v; its mixed block
    by those of H lambda.

    Only the lower triangle is computed: rows of segment i in the lanes of segments up to i.
    """
    tail, nv = d.tail, d.tail.nv
    directions = Directions(tail, ("turn", "omega"))
    inner = adjoint_program(assemble(VIRTUAL_POWER, tail), ("q", "v", "v_dot"), ("power",))
    inner = tangent_program(inner, ("q", "v"), directions.count, directions.up_to)
    b_q, b_v = d.wide("d_b_q", tail.nq, directions.count), d.wide("d_b_v", nv, directions.count)
    b_v_dot = d.wide("d_b_v_dot", nv, directions.count)
    q = with_unit_quaternion(d, arrays["q"])
    given = {"q": q} | {name: arrays[name] for name in ("v", "v_dot", "multiplier")}
    d_q = directions.tangents(d)
    d.call(
        inner,
        b_power=d.constant("one", [1]),
        d_b_q=b_q,
        d_b_v=b_v,
        d_b_v_dot=b_v_dot,
        **given,
        **d_q,
    )
    turn = d.wide("d_b_turn", 3, directions.count)
    d.step(rotations.turn_gradient, {"gradient": b_q.part(3, 4)}, turn=turn[0])
    mirror(d, directions, {"turn": turn[0], "omega": b_v.part(3, 3)}, (b_q, b_v), arrays)
    mixed_block(d, q, arrays["multiplier"], arrays["aq"])
    with d.loop("row", nv) as row:
        d.copy(arrays["aq"].part(nv * row + 3, 3), b_v_dot.lane(row, 0, 3))


def mirror(
    d: Draft, directions: Directions, torso: dict[str, Ref], rows: tuple[Array, Array], out: dict
) -> None:
    """Copy the lower triangle of the Hessian to the blocks qq, qv and vv, and mirror it."""
    nv, m = d.tail.nv, d.tail.segments
    for name in ("qq", "qv", "vv"):
        d.fill(out[name].part(0, nv * nv), 0)

    def place(
        row: Ref, of_row: tuple[Index, bool], lane: Index, of_lane: tuple[Index, bool], size: int
    ) -> None:
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


def mixed_block(d: Draft, q: Array, multiplier: Array, aq: Array) -> None:
    """d(H lambda)/d(q_t): tangents of the inertia's force for the acceleration lambda, then turned
    to world axes.
    """
    nv, directions = d.tail.nv, Directions(d.tail, (), rates=False)
    inner = tangent_program(assemble(INERTIA, d.tail), ("q",), directions.count, directions.outward)
    rows, body = (
        d.wide("inertial_rows", nv, directions.count),
        d.array("multiplier_in_torso_axes", nv),
    )
    d.store(rotations.quaternion_rotation, R=9)
    d.step(torso.torso_velocity, {"p_dot": multiplier.part(0, 3)}, u=body.part(0, 3))
    d.copy(body.part(3, nv - 3), multiplier.part(3, nv - 3))
    d.call(inner, q=q, v_dot=body, d_force=rows, **directions.tangents(d))
    d.step(rotations.world_vector, {"vector": rows.part(0, 3)}, vector=rows.part(0, 3))
    directions.spread(d, rows, aq)


ASSEMBLIES = {"inverse_dynamics_hessian": assemble_inverse_dynamics_hessian}
