"""Second derivatives: the Hessian of lambda^T (H v_dot + C)."""

from collections.abc import Mapping
from types import MappingProxyType

from serpentail_scene.layout import OMEGA, TORSO_NV, VELOCITY

from ...autodiff.forward import Lanes, tangent_program, tangents_together
from ...autodiff.reverse import adjoint_program
from ...ir.program import Array, Index, Ref, padded
from ...mechanics import rotation_derivatives as turns
from ...mechanics import rotations
from ..air import in_air, move_in_air
from ..draft import Draft
from ..function import Function, assemble
from ..layout import block
from ..scope import Vectors
from ..tail import Tail
from .differentiated import MOMENT, VIRTUAL_POWER
from .directions import Directions
from .hessian_blocks import HessianBlocks
from .torso_axes import TorsoAxes, torso_axes

BY_Q = ("q", "v", "v_dot", "a", "u")
BY_V = ("v", "u")  # the other blocks are transposes of those by q, or zero

Wanted = tuple[Directions, tuple[str, ...]]  # directions, and which gradients along them


def assemble_inverse_dynamics_hessian(draft: Draft, arrays: dict[str, Array]) -> None:
    """Tangents of the gradient of lambda^T (H v_dot + C) in torso axes, by tail coordinates and by
    v.

    All terms with rotations of the torso follow from these.
    """
    of_q, of_v = split_directions(draft.tail)
    axes = torso_axes(draft, arrays["q"], arrays["v_dot"], arrays["multiplier"])
    gradient = {name: draft.array(f"b_{name}", 3) for name in ("a", "u")}
    given = {name: arrays[name] for name in ("q", "v_dot", "multiplier")} | axes.arrays()
    given["v"] = in_air(draft, arrays["q"], arrays["v"], axes.R)
    given["b_power"] = draft.fixed("one", [1]).array
    d_q, d_v = of_q.tangents(draft), of_v.tangents(draft)
    given |= d_q | {"dv_v": d_v["d_v"]}
    wanted = (of_q, BY_Q), (of_v, BY_V)
    by_q, by_v = tangents_of_gradient(draft, VIRTUAL_POWER, *wanted, given, gradient)
    blocks = HessianBlocks(draft, of_q, of_v, arrays)
    blocks.clear()
    blocks.of_motion(by_q["q"], by_q["v"], by_v["v"])

    # tangents of H lambda, its force in world axes
    force, rows = {"R": axes.R, "vector": by_q["a"][0]}, by_q["v_dot"]
    draft.step(rotations.world_vector, force, vector=block(rows, VELOCITY))
    blocks.of_inertia(rows)

    # tangents of the gradient by a rotation of the torso
    turn_q, turn_v = (draft.wide(f"turn_{d.label}", 3, d.count) for d in (of_q, of_v))
    changes = {f"b_{name}": by_q[name][0] for name in ("a", "u")}
    draft.step(turns.power_by_turn, axes.vectors(), changes, turn=turn_q[0])
    change = {"gradient": by_v["u"][0], "vector": axes.u[0]}
    draft.step(turns.term_by_turn, change, turn=turn_v[0])
    blocks.of_turn(turn_q, turn_v)
    turned_twice(draft, d_q, axes, gradient, blocks)
    if draft.tail.widths:
        add_drift(draft, axes, given, arrays)


def split_directions(tail: Tail) -> tuple[Directions, Directions]:
    """Return the directions of the coordinates, and of omega and the rates; some of omega go with
    the coordinates where that fills whole vectors.
    """
    nt, axes = tail.nt, OMEGA.stop - OMEGA.start
    moved = min(range(axes), key=lambda k: padded(nt + k) + padded(nt + axes - k))
    of_q = Directions(tail, ("omega",) if moved else (), rates=False, axes=range(moved))
    return of_q, Directions(tail, ("omega",), coordinates=False, axes=range(moved, axes))


def tangents_of_gradient(
    draft: Draft,
    function: Function,
    by_q: Wanted,
    by_v: Wanted,
    arguments: dict[str, Array],
    gradients: Mapping[str, Array] = MappingProxyType({}),
) -> tuple[dict[str, Array], dict[str, Array]]:
    """Return the tangents of the wanted gradients of ``power``, along coordinates and along
    velocities, as wide rows, and store some of the gradients.

    Arguments: those of the function, the directions ``d_q`` and ``dv_v``, and ``b_power``, the
    weight of the power.
    """
    sizes = {a.name: a.length(draft.tail) for a in function.inputs}
    kept = {f"b_{name}": array for name, array in gradients.items()}
    outputs: dict[str, Array] = {}
    lanes, found = [], []
    # what moves along coordinates reads most of the values, so it shares a step with them
    for prefix, (directions, names) in (("dv", by_v), ("d", by_q)):
        active = [name for name in ("q", "v") if f"{prefix}_{name}" in arguments]
        count, label = directions.count, directions.label
        given = [f"b_{name}" for name in names]
        lanes.append(Lanes(active, count, directions.outward, prefix, given))
        rows = {name: draft.wide(f"d_b_{name}_{label}", sizes[name], count) for name in names}
        outputs |= {f"{prefix}_b_{name}": array for name, array in rows.items()}
        found.append(rows)

    inner = adjoint_program(assemble(function, draft.tail), by_q[1], ("power",))
    draft.call(tangents_together(inner, lanes, kept), **arguments, **outputs, **kept)
    return found[1], found[0]


def turned_twice(
    draft: Draft,
    d_q: dict[str, Array],
    axes: TorsoAxes,
    gradient: dict[str, Array],
    blocks: HessianBlocks,
) -> None:
    """Store second derivatives by rotations of the torso, and how H lambda changes with a
    rotation.
    """
    of_q = blocks.of_q
    inner = tangent_program(
        assemble(MOMENT, draft.tail), ("q",), of_q.count, of_q.outward, ("moment",)
    )
    h, d_h = draft.array("h", 3), draft.wide("d_h", 3, of_q.count)
    draft.call(inner, q=blocks.arrays["q"], moment=h, d_moment=d_h, d_q=d_q["d_q"])

    gradients = {f"b_{name}": array[0] for name, array in gradient.items()}
    turned = Vectors({**axes.vectors(), **gradients, "h": h[0], "R": axes.R})
    own = own_tail_mass(draft)
    draft.step(turns.turn_curvature, turned, own, **blocks.columns_of_turns("qq", OMEGA.start, 3))
    draft.step(turns.turned_momentum, turned, own, **blocks.columns_of_turns("aq", 0, TORSO_NV))
    by_turn = draft.wide("by_turn", 3, of_q.count)
    change = {"gradient": d_h[0], "vector": axes.u[0]}
    draft.step(turns.term_by_turn, change, turn=by_turn[0])
    blocks.of_turned_inertia(by_turn)


def add_drift(
    draft: Draft, axes: TorsoAxes, given: dict[str, Array], arrays: dict[str, Array]
) -> None:
    """Add what the velocity of B against the air gives: second derivatives by p_dot, and by a turn
    of the torso, in whose axes it turns back.
    """
    tail, nv, first = draft.tail, draft.tail.nv, OMEGA.start
    directions = Directions(tail, ("turn", "p_dot"), coordinates=False, rates=False)
    turn, d_v = directions.turn(draft), directions.tangents(draft)["d_v"]
    move_in_air(draft, given["v"], d_v, axes.R, turn)
    sizes = {"q": tail.nq, "v": nv, "u": 3}
    by = {name: draft.wide(f"drift_{name}", size, directions.count) for name, size in sizes.items()}
    b_v = draft.array("b_v", nv)
    inner = adjoint_program(assemble(VIRTUAL_POWER, tail), tuple(sizes), ("power",))
    inner = tangent_program(inner, ("v",), directions.count, kept=("b_v",))
    arguments = {
        name: given[name] for name in ("q", "v", "v_dot", "multiplier", "a", "u", "b_power")
    }
    outputs = {f"d_b_{name}": array for name, array in by.items()}
    draft.call(inner, **arguments, d_v=d_v, b_v=b_v, **outputs)

    # by a turn twice: of both velocities, and of that against the air alone
    both, other = (draft.wide(name, 3, directions.count) for name in ("by_turns", "by_u_turned"))
    flow = {"gradient": block(by["v"], VELOCITY), "vector": block(given["v"], VELOCITY)}
    draft.step(turns.term_by_turn, {"gradient": by["u"][0], "vector": axes.u[0]}, turn=other[0])
    draft.copy(both.whole(), other.whole())
    draft.step(turns.term_by_turn, flow, turn_=both[0])
    rows = {
        f"row_{r}_": arrays["qq"].part(nv * (OMEGA.start + r) + OMEGA.start, 3) for r in range(3)
    }
    reads = {"gradient": block(b_v, VELOCITY), "vector": flow["vector"]}
    draft.step(turns.term_curvature, reads, **rows)

    # the gradient by p_dot is in world axes
    change = flow["gradient"]
    reads = {"R": axes.R, "force": block(b_v, VELOCITY), "turn": turn, "change": change}
    draft.step(turns.turning_force, reads, change=change)

    def add(
        name: str, row: Index | int, column: Index | int, lanes: Ref, down: bool = False
    ) -> None:
        to = arrays[name].part(nv * row + column, 3, nv if down else 1)
        draft.copy(to, lanes, adds=True)

    with draft.loop("k", 3) as k:
        add("qq", first + k, first, both.lane(k, 0, 3))
        add("qq", first, first + k, other.lane(k, 0, 3), down=True)
        add("qv", first + k, 0, other.lane(k, 3, 3))
        add("qv", first, k, by["v"].lane(k, 0, 3), down=True)
        add("vv", k, 0, by["v"].lane(k, 3, 3))
    with draft.loop("k", nv - first) as number:
        k = number + first
        add("qv", first, k, by["v"].lane(k, 0, 3), down=True)
        add("vv", k, 0, by["v"].lane(k, 3, 3))
        add("vv", 0, k, by["v"].lane(k, 3, 3), down=True)
    with draft.loop("k", tail.nt) as number:
        k = number + TORSO_NV
        add("qq", k, first, by["q"].lane(number + tail.torso_nq, 0, 3))
        add("qq", first, k, by["q"].lane(number + tail.torso_nq, 0, 3), down=True)
        add("qv", k, 0, by["q"].lane(number + tail.torso_nq, 3, 3))

    # the same numbers on both sides of the diagonal
    for name, at in (("qq", first), ("vv", 0)):
        with draft.loop("k", 3) as k, draft.loop("l", k) as other:
            H, row, column = arrays[name], k + at, other + at
            draft.copy(H.part(nv * column + row, 1), H.part(nv * row + column, 1))


def own_tail_mass(draft: Draft) -> dict[str, Ref]:
    """Return the mass of a tail whose links or arcs have their own masses; else nothing."""
    if not draft.tail.shape.own:
        return {}
    mass = draft.vector("tail_mass", 1)
    draft.fill(mass, 0)
    for name in [name for name in ("link_masses", "arc_masses") if name in draft.parameters]:
        with draft.loop("g", draft.parameters[name].size) as g:
            draft.copy(mass, draft.entry(name, g, 1), adds=True)
    return {"tail_mass": mass}


ASSEMBLIES = {"inverse_dynamics_hessian": assemble_inverse_dynamics_hessian}
