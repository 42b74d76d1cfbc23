"""The sweep of a long articulated tail that gives H without translation and C at once.

All momentum columns and the bias wrench are columns of one wide wrench, which is swept from the tip
to the base. So the links need no pose, and no two columns have to be multiplied. It pays off if
vectors hold several numbers: a column is a lane.
"""

from collections.abc import Callable

from serpentail_scene.layout import OMEGA, VELOCITY

from ...ir.program import Array, Ref
from ...mechanics import link_columns, mount, torso, translation
from ..draft import Draft
from ..layout import block, coordinate
from ..scope import Motion, Vectors
from ..tails.mechanism import Segments, Wrenches
from .inertia import column_of, columns_of
from .pieces import across, each_piece, mechanism
from .wrenches import add_torso_drag, forward_wrenches


def factored_dynamics_by_columns(
    draft: Draft, arrays: dict[str, Array], entry: Callable[..., Ref], u: Ref | None
) -> None:
    """Fill ``A`` (by ``entry(row, column)``, lower triangle), ``columns``, ``bias`` and the
    quantities that elimination needs. ``u``: velocity of B against the air.
    """
    nt, columns, bias = draft.tail.nt, arrays["columns"], arrays["bias"]
    state = draft.state(arrays["q"], arrays["v"])
    segments = mechanism(draft).prepare(draft, state, True)
    zero = draft.zero(3)
    motion = Motion(state.omega, zero, zero, u)

    # from the torso to the tip, and back with all columns
    wrenches = forward_wrenches(draft, segments, motion, None)
    F_columns, rows = draft.wide("F_lanes", 6, nt + 1)[0], draft.wide("H_rows", nt, nt + 1)
    composite, own_joints = _gather(draft, segments, wrenches, F_columns, rows)
    across(draft, mount.composite_at_mount, composite.only("h", "I").named)
    across(draft, mount.lanes_at_mount, F_lanes=F_columns)
    draft.step(torso.torso_composite, composite, **composite)
    draft.copy(arrays["first_moment"].part(0, 3), composite["h"])
    draft.step(link_columns.lanes_at_torso, {"F_lanes": F_columns}, F_lanes=F_columns)

    # the last column is the bias, the others are momenta
    total = draft.vector("F_tail", 6)
    for r in range(6):
        draft.copy(total.array.part(r, 1), F_columns.array.lane(r, nt))
    reads = {"w": motion.w, "a": motion.a, "F": total}
    writes = {"force": block(bias, VELOCITY), "moment": block(bias, OMEGA)}
    draft.step(link_columns.torso_bias, reads, **writes)
    add_torso_drag(draft, motion, Vectors(writes))
    with draft.loop("k", nt) as k:
        draft.copy(draft.tail.coordinate_v(bias, k), rows.lane(k, nt))
        for r in range(6):
            draft.copy(columns.part(6 * k + r, 1), F_columns.array.lane(r, k))

    # H without translation
    names = ("inverse_mass", "com")
    center = Vectors({name: arrays[name].part(0, arrays[name].length) for name in names})
    base = {f"A_{r}": entry(r, 0, r + 1) for r in range(3)}
    draft.step(translation.without_translation, composite, **center, **base)
    _without_translation(draft, center, F_columns, rows, columns, entry)
    _own_blocks(draft, center, own_joints, rows, columns, entry)


def _gather(
    draft: Draft, segments: Segments, wrenches: Wrenches, F_columns: Ref, rows: Array
) -> tuple[Vectors, Array]:
    """Sweep to the mount; return ``mass, h, I``, and what joints add to their own blocks."""
    tail, lanes = draft.tail, rows.lanes
    at, own_joints = draft.wide("at", lanes, lanes), draft.array("own", 2, tail.segments)
    draft.unit(at.part(0, lanes), 0)
    for ref in (F_columns, rows.part(0, tail.nt), own_joints.part(0, tail.nt)):
        draft.fill(ref, 0)
    composite = draft.vectors(mass=1, h=3, I=6)
    for ref in composite.named.values():
        draft.fill(ref, 0)
    joint = Vectors({name: draft.vector(f"{name}_link", 6) for name in ("pitch", "yaw")})
    for i, g in each_piece(draft, downward=True):
        pitch, yaw = coordinate(i), coordinate(i, 1)
        places = {
            "at_bias": at.part(tail.nt, 1),
            "at_pitch": at.part(pitch, 1),
            "at_yaw": at.part(yaw, 1),
        }
        piece, lanes_of = segments.at(i, g), {"F_lanes": F_columns}
        gather = link_columns.gather_composite
        draft.step(gather, piece, composite, **composite, **joint, own_=own_joints[i])
        draft.step(
            link_columns.gather_lanes,
            *(piece, joint, places, wrenches.at(i, g), lanes_of),
            H_pitch_=rows.part(pitch, 1),
            H_yaw_=rows.part(yaw, 1),
            **lanes_of,
        )
    return composite, own_joints


def _without_translation(
    draft: Draft,
    center: Vectors,
    F_columns: Ref,
    rows: Array,
    columns: Array,
    entry: Callable[..., Ref],
) -> None:
    """Eliminate translation from all rows; the coupling with omega goes to ``A``."""
    coupling, reads = draft.wide("coupling", 3, rows.lanes), {"F_lanes": F_columns}
    parts = {f"A_{r}": coupling.part(r, 1) for r in range(3)}
    draft.step(link_columns.lanes_without_translation, center, reads, **parts)
    with draft.loop("k", draft.tail.nt) as k:
        column = {"column": column_of(columns, k)}
        step = link_columns.row_without_translation
        draft.step(step, center, reads, column, H_row_=rows.part(k, 1))
        for r in range(3):
            draft.copy(entry(3 + k, r), coupling.lane(r, k))


def _own_blocks(
    draft: Draft,
    center: Vectors,
    own_joints: Array,
    rows: Array,
    columns: Array,
    entry: Callable[..., Ref],
) -> None:
    """Store the rows in ``A``; blocks of one segment are completed."""
    with draft.loop("i", draft.tail.segments) as i:
        pitch, yaw = coordinate(i), coordinate(i, 1)
        reads = {"own": own_joints[i], "columns": columns_of(draft.tail, columns, i)}
        reads |= {"H_pp": rows.lane(pitch, pitch), "H_py": rows.lane(pitch, yaw)}
        reads |= {"H_yp": rows.lane(yaw, pitch), "H_yy": rows.lane(yaw, yaw)}
        writes = {
            "A_pp": entry(3 + pitch, 3 + pitch),
            "A_yp": entry(3 + yaw, 3 + pitch),
            "A_yy": entry(3 + yaw, 3 + yaw),
        }
        draft.step(link_columns.segment_block, center, reads, **writes)
        with draft.loop("k", pitch) as k:
            for row in (pitch, yaw):
                draft.copy(entry(3 + row, 3 + k), rows.lane(k, row))
