"""Second derivatives: the Hessian of lambda^T (H v_dot + C)."""

from serpentail_scene.layout import OMEGA, QUATERNION, TORSO_NV, VELOCITY

from ...autodiff.forward import Lanes, tangent_program, tangents_together
from ...autodiff.reverse import adjoint_program
from ...ir.program import Array, Ref, padded
from ...mechanics import rotation_derivatives as turns
from ...mechanics import rotations
from ..draft import Draft
from ..function import assemble
from ..layout import block
from ..scope import Vectors
from ..tail import Tail
from .differentiated import MOMENT, VIRTUAL_POWER, WORLD_POWER
from .directions import Directions
from .hessian_blocks import HessianBlocks
from .jacobians import with_unit_quaternion
from .torso_axes import TorsoAxes, torso_axes

BY_Q = ("q", "v", "v_dot", "a", "u")
BY_V = ("v", "u")  # the other blocks are transposes of those by q, or zero

Wanted = tuple[Directions, tuple[str, ...]]  # directions, and which gradients along them


def assemble_inverse_dynamics_hessian(draft: Draft, arrays: dict[str, Array]) -> None:
    """Tangents of the gradient of lambda^T (H v_dot + C) in torso axes, by tail coordinates and by
    v.

    All terms with rotations of the torso follow from these.
    """
    if draft.tail.widths:
        hessian_by_numbers(draft, arrays)
        return
    of_q, of_v = split_directions(draft.tail)
    axes = torso_axes(draft, arrays["q"], arrays["v_dot"], arrays["multiplier"])
    gradient = {name: draft.array(f"b_{name}", 3) for name in ("a", "u")}
    given = {name: arrays[name] for name in ("q", "v", "v_dot", "multiplier")} | axes.arrays()
    given["b_power"] = draft.fixed("one", [1]).array
    d_q, d_v = of_q.tangents(draft), of_v.tangents(draft)
    given |= d_q | {"dv_v": d_v["d_v"]}
    wanted = (of_q, BY_Q), (of_v, BY_V)
    by_q, by_v = tangents_of_gradient(draft, *wanted, given, gradient)
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


def hessian_by_numbers(draft: Draft, arrays: dict[str, Array]) -> None:
    """Tangents of the gradient by all numbers of q and by v, in air, where all forces depend on
    the attitude and the velocity of B. Along a unit quaternion nothing changes, so that its turns
    are those of the exponential map.
    """
    tail, directions = draft.tail, Directions(draft.tail, ("turn", "p_dot", "omega"))
    inner = adjoint_program(assemble(WORLD_POWER, tail), ("q", "v", "v_dot"), ("power",))
    inner = tangent_program(inner, ("q", "v"), directions.count)
    q, sizes = (
        with_unit_quaternion(draft, arrays["q"]),
        {"q": tail.nq, "v": tail.nv, "v_dot": tail.nv},
    )
    by = {n: draft.wide(f"d_b_{n}", size, directions.count) for n, size in sizes.items()}
    given = {name: arrays[name] for name in ("v", "v_dot", "multiplier")}
    given |= {"q": q, "b_power": draft.fixed("one", [1]).array} | directions.tangents(draft, q)
    draft.call(inner, **given, **{f"d_b_{name}": rows for name, rows in by.items()})

    # in the tangent space of q
    rows, others = draft.wide("rows", tail.nv, directions.count), draft.array("others", tail.nv**2)
    draft.fill(block(rows, VELOCITY), 0)
    reads = {"quaternion": block(q, QUATERNION), "gradient": block(by["q"], QUATERNION)}
    draft.step(rotations.turn_gradient, reads, turn=block(rows, OMEGA))
    draft.copy(tail.all_v(rows), tail.all_q(by["q"]))
    directions.spread(draft, rows, arrays["qq"], arrays["qv"])
    directions.spread(draft, by["v"], others, arrays["vv"])
    directions.spread(draft, by["v_dot"], arrays["aq"], others)
    for H in (arrays["qq"], arrays["vv"]):
        with draft.loop("k", tail.nv) as k, draft.loop("l", k) as other:
            draft.copy(H.part(tail.nv * other + k, 1), H.part(tail.nv * k + other, 1))


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
    by_q: Wanted,
    by_v: Wanted,
    arguments: dict[str, Array],
    gradients: dict[str, Array],
) -> tuple[dict[str, Array], dict[str, Array]]:
    """Return the tangents of the wanted gradients of ``power``, along coordinates and along
    velocities, as wide rows, and store some of the gradients.

    Arguments: those of VIRTUAL_POWER, the directions ``d_q`` and ``dv_v``, and ``b_power``, the
    weight of the power.
    """
    sizes = {a.name: a.length(draft.tail) for a in VIRTUAL_POWER.inputs}
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

    inner = adjoint_program(assemble(VIRTUAL_POWER, draft.tail), by_q[1], ("power",))
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
