"""The sweep of a long articulated tail: a draft goes in, H without translation and C come out of
one sweep in lanes.

All momentum columns and the bias wrench are lanes of one wrench that is swept from the tip to the
base, so that the links need no pose and no column has to meet another one.  It pays where vectors
hold several numbers.
"""

from collections.abc import Callable

from ...ir.program import Array, Ref
from ...mechanics import link_columns as lan
from ...mechanics import torso, translation
from ..draft import Draft
from .sweeps import each_piece, forward_wrenches, mechanism


def balance_in_lanes(d: Draft, arrays: dict[str, Array], entry: Callable[..., Ref]) -> None:
    """Fill ``A`` (by ``entry(row, column)``, lower triangle), ``columns``, ``bias`` and what
    elimination needs.
    """
    nt, columns, bias = d.tail.nt, arrays["columns"], arrays["bias"]
    mechanism(d).prepare(d, True)
    still = d.zero(3)
    d.known |= {"w": d.known["omega"], "w_dot": still, "a": still}
    wrench = forward_wrenches(d, None)
    F_lanes, rows = d.wide("F_lanes", 6, nt + 1)[0], d.wide("H_rows", nt, nt + 1)
    own = _gather(d, wrench, F_lanes, rows)
    d.step(torso.torso_composite, **{name: d.known[name] for name in ("mass", "h", "I")})
    d.copy(arrays["first_moment"].part(0, 3), d.known["h"])
    d.step(lan.lanes_at_torso, {"F_lanes": F_lanes}, F_lanes=F_lanes)
    total = d.array("F_tail", 6)[0]
    for r in range(6):
        d.copy(total.array.part(r, 1), F_lanes.array.lane(r, nt))
    d.step(lan.torso_bias, {"F": total}, force=bias.part(0, 3), moment=bias.part(3, 3))
    with d.loop("k", nt) as k:
        d.copy(bias.part(6 + k, 1), rows.lane(k, nt))
        for r in range(6):
            d.copy(columns.part(6 * k + r, 1), F_lanes.array.lane(r, k))
    d.known |= {name: arrays[name].part(0, arrays[name].length) for name in ("inverse_mass", "com")}
    base = {f"A_{r}": entry(r, 0, r + 1) for r in range(3)}
    d.step(
        translation.without_translation,
        inverse_mass=d.known["inverse_mass"],
        com=d.known["com"],
        **base,
    )
    _without_translation(d, F_lanes, rows, columns, entry)
    _own_blocks(d, own, rows, columns, entry)


def _gather(d: Draft, wrench: Array, F_lanes: Ref, rows: Array) -> Array:
    """Sweep from the tip to the mount; return what each segment's joints contribute to its block by
    themselves.
    """
    tail, lanes = d.tail, rows.lanes
    at, own = d.wide("at", lanes, lanes), d.array("own", 2, tail.segments)
    d.unit(at.part(0, lanes), 0)
    for ref in (F_lanes, rows.part(0, tail.nt), own.part(0, tail.nt)):
        d.fill(ref, 0)
    carried = {name: d.vector(name, size) for name, size in (("mass", 1), ("h", 3), ("I", 6))}
    for ref in carried.values():
        d.fill(ref, 0)
    columns = {name: d.array(f"{name}_link", 6)[0] for name in ("pitch", "yaw")}
    with each_piece(d, downward=True) as (i, g):
        places = {
            "at_bias": at.part(tail.nt, 1),
            "at_pitch": at.part(2 * i, 1),
            "at_yaw": at.part(2 * i + 1, 1),
        }
        d.step(lan.gather_composite, d.piece(i), **carried, **columns, own_=own[i])
        reads = d.piece(i) | columns | places | {"F": wrench[g], "F_lanes": F_lanes}
        d.step(
            lan.gather_lanes,
            reads,
            F_lanes=F_lanes,
            H_pitch_=rows.part(2 * i, 1),
            H_yaw_=rows.part(2 * i + 1, 1),
        )
    return own


def _without_translation(
    d: Draft, F_lanes: Ref, rows: Array, columns: Array, entry: Callable[..., Ref]
) -> None:
    """Eliminate translation from all rows; the coupling with omega goes to ``A``."""
    coupling = d.wide("coupling", 3, rows.lanes)
    d.step(
        lan.lanes_without_translation,
        {"F_lanes": F_lanes},
        **{f"A_{r}": coupling.part(r, 1) for r in range(3)},
    )
    with d.loop("k", d.tail.nt) as k:
        reads = {"column": columns.part(6 * k, 6), "F_lanes": F_lanes}
        d.step(lan.row_without_translation, reads, H_row_=rows.part(k, 1))
        for r in range(3):
            d.copy(entry(3 + k, r), coupling.lane(r, k))


def _own_blocks(
    d: Draft, own: Array, rows: Array, columns: Array, entry: Callable[..., Ref]
) -> None:
    """Put the rows into ``A``: blocks of two segments as they are, those of one segment
    completed.
    """
    with d.loop("i", d.tail.segments) as i:
        pitch, yaw = 2 * i, 2 * i + 1
        reads = {"own": own[i], "columns": columns.part(12 * i, 12)}
        reads |= {"H_pp": rows.lane(pitch, pitch), "H_py": rows.lane(pitch, yaw)}
        reads |= {"H_yp": rows.lane(yaw, pitch), "H_yy": rows.lane(yaw, yaw)}
        writes = {"A_pp": entry(3 + pitch, 3 + pitch), "A_yp": entry(3 + yaw, 3 + pitch)}
        d.step(lan.segment_block, reads, **writes, A_yy=entry(3 + yaw, 3 + yaw))
        with d.loop("k", pitch) as k:
            for own_row in (pitch, yaw):
                d.copy(entry(3 + own_row, 3 + k), rows.lane(k, own_row))
