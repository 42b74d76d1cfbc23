"""The closing table: for each figure and processor the values before and after, the best peer, and
the limit.
"""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from benchmarks.batches import DFD, FD, HESSIAN

BEFORE = Path(__file__).parent / "before.json"  # figures.json of a report of the earlier code
PINOCCHIO = ("plain_ns", "tuned_ns", "revolutes_ns", "own_ns")
CASADI = ("casadi_ns", "hand_ns", "mujoco_ns")


class Figure(NamedTuple):
    """A column of a measure, for each of its rows.

    peers: measures and columns of the same quantity, in the same unit; limit: a function whose
    necessary operations, divided by a peak, give a lower bound.
    """

    name: str
    measure: str
    column: str
    unit: str = "ns"
    peers: tuple[tuple[str, tuple[str, ...]], ...] = ()
    limit: tuple[str, str] | None = None
    function: str | None = None  # only rows of this function
    most: bool = False  # more is better


FIGURES = (
    Figure("peak of a core", "peak", "vector_gf", "flops/ns", most=True),
    Figure(
        *("v_dot, from C", "speed", "ns", "ns"),
        (("speed", PINOCCHIO), ("other_peers", CASADI)),
        (FD, "scalar_gf"),
    ),
    Figure(
        *("Jacobians, from C", "jacobian_times", "ns", "ns"),
        (("jacobian_times", PINOCCHIO + CASADI),),
        (DFD, "vector_gf"),
    ),
    Figure(
        *("Hessian, from C", "hessian_times", "ns", "ns"),
        (("hessian_times", ("casadi_ns", "sparse_ns")),),
        (HESSIAN, "vector_gf"),
    ),
    *(
        Figure(
            f"{what}, a state of a batch",
            *("batch_times", "side by side, ns", "ns", (), (function, "vector_gf"), function),
        )
        for what, function in (("v_dot", FD), ("Jacobians", DFD), ("Hessian", HESSIAN))
    ),
    *(
        Figure(f"{what}, a call from Python", "call_times", "caller_us", "us", function=function)
        for what, function in (("v_dot", FD), ("Jacobians", DFD), ("Hessian", HESSIAN))
    ),
    Figure("v_dot, a long tail, from C", "long_times", "v_dot_ns"),
    Figure("Jacobians, a long tail, from C", "long_times", "jacobians_ns"),
    Figure("st.simulate, for the caller", "flight_times", "caller_us", "us"),
    Figure("6000 flights in a call", "rollout_rates", "6000 in a call, 1/s", "1/s", most=True),
)


def closing(report: dict) -> list[dict]:
    """Return the rows of the closing table; before: the same figures from ``before.json``."""
    before = recorded()["figures"] if comparable(report) else {}
    return [
        {key: row[key] for key in row if key != "figure"} | closed(figure, row, report, before)
        for figure, row in present(report)
    ]


def recorded() -> dict:
    """Return the contents of ``before.json``; nothing if the file is missing."""
    return json.loads(BEFORE.read_text()) if BEFORE.exists() else {"machine": "", "figures": {}}


def comparable(report: dict) -> bool:
    """Tell whether the figures before are of the machine of a report."""
    return recorded()["machine"] == report["machine"]["processor"]


def about(report: dict) -> str:
    """Say what the columns of the closing table mean, and from where "before" is."""
    place = recorded()["machine"] or "none"
    told = "" if comparable(report) else f", of another processor ({place}), so not shown"
    return (
        f"Before: the same benchmark of the code before, as benchmarks/before.json has it{told}. "
        "If the peak of a core differs from before, so does its clock: compare ratios then. "
        "Peer's best: of all peers and compilers. Limit: operations that are needed, at the core's "
        "peak of multiply-adds, of scalars for v_dot from C, else of vectors: no code can be "
        "faster, most cannot come near."
    )


def figures(report: dict) -> dict:
    """Return all figures by name, in the form of ``before.json``, and the machine's name."""
    named = {name_of(figure, row): row["value"] for figure, row in present(report)}
    return {"machine": report["machine"]["processor"], "figures": named}


def present(report: dict) -> Iterator[tuple[Figure, dict]]:
    """Yield figures with processor, model and value."""
    for figure in FIGURES:
        for row in report.get(figure.measure, []):
            if figure.function in (None, row.get("function")):
                of = row.get("model", row.get("scene", "any"))
                found = {"processor": row["processor"], "what": figure.name, "of": of}
                yield figure, found | {"figure": figure, "value": float(row[figure.column])}


def name_of(figure: Figure, row: dict) -> str:
    """Return the name of one figure."""
    return f"{row['processor']}: {figure.name}, {row['of']}, {figure.unit}"


def closed(figure: Figure, row: dict, report: dict, before: dict) -> dict:
    """Return the numbers of one row."""
    value, old = row["value"], before.get(name_of(figure, row))
    peer, limit = best_peer(figure, row, report), floor(figure, row, report)
    there = {"before": old or "", "value": value, "unit": figure.unit}
    gain = (value / old if figure.most else old / value) if old else None
    there |= {"times faster": f"{gain:.2f}x" if gain else ""}
    there |= {"peer's best": peer or "", "peer / ours": f"{peer / value:.2f}x" if peer else ""}
    there |= {"limit": limit or "", "left": f"{value / limit:.1f}x" if limit else ""}
    return there | {"of the peak": f"{limit / value:.0%}" if limit else ""}


def best_peer(figure: Figure, row: dict, report: dict) -> float | None:
    """Return the least time of any peer for the same quantity."""
    times = [
        other[column]
        for measure, columns in figure.peers
        for other in report.get(measure, [])
        if (other["processor"], other["model"]) == (row["processor"], row["of"])
        for column in columns
        if column in other
    ]
    return min(times, default=None)


def floor(figure: Figure, row: dict, report: dict) -> float | None:
    """Return the time of the necessary operations at the core's peak."""
    if figure.limit is None:
        return None
    function, peak = figure.limit
    of_size = {"function": function, "model": row["of"]}
    needed = cell(report.get("operation_counts", []), of_size, "needed")
    rate = cell(report.get("peak", []), {"processor": row["processor"]}, peak)
    return needed / rate if needed and rate else None


def cell(rows: list[dict], key: dict, column: str) -> float | None:
    """Return a column of the row with these values; None if there is no such row."""
    return next((row[column] for row in rows if key.items() <= row.items()), None)
