"""The tables of docs/benchmarks.md and README.md, written from a report.

Each cell has AVX-512 before AVX2. A peer's figure is how many times as long as ours it takes, with
the span of the runs where they differ.
"""

import re
from collections.abc import Callable
from pathlib import Path

from benchmarks.models import DFD, FD, HESSIAN
from serpentail.basics.errors import SerpentailError

BEGIN, END = "<!-- bench -->\n", "<!-- /bench -->"  # the tables stand between these lines
ROOT = Path(__file__).resolve().parents[1]
MODELS = ("(1, 3)", "(3, 4)", "(6, 6)", "(8, 16)")
MODELS += ("continuum, m = 3", "continuum, m = 64")


def short(value: float) -> str:
    """Return a number of two digits, without an exponent."""
    return f"{float(f'{value:.2g}'):.6g}"


def number(column: str, scale: float = 1.0) -> Callable[[dict], str]:
    """Return a function that shows a column, times a factor."""
    return lambda row: short(row[column] * scale)


def times(column: str) -> Callable[[dict], str]:
    """Return a function that shows how many times as long something takes, as a span."""
    return lambda row: spanned(row, column)


def spanned(row: dict, column: str) -> str:
    """Show a ratio: from its least to its most, if they differ."""
    ends = [short(row[column]), short(row.get(f"{column}, most", row[column]))]
    return "-".join(dict.fromkeys(ends)) + "x"


def batch(row: dict) -> str:
    """Show a state of a batch in us, and how many times as long it takes alone."""
    return f"{short(row['side by side, ns'] * 1e-3)} ({spanned(row, 'ratio')})"


def waited(row: dict) -> str:
    """Show microseconds for the caller, and those outside C."""
    return f"{short(row['for the caller, us'])} ({short(row['outside C, us'])})"


BATCH = "one state of a batch, one core, us (one by one takes)"
PYTHON = "from Python (of it outside C), us"
FLIGHT = ("scene", "flight of 0.6 s")
CONTACT = ("contact_costs", ("contacts", "feet"))
SPEED = number("times real time")
# words, measure, the value that a column must have, contents of a cell
ROWS: tuple[tuple[str, str, tuple[str, str] | None, Callable[[dict], str]], ...] = (
    ("**forward dynamics, one call from C**, us", "forward_dynamics", None, number("ns", 1e-3)),
    (PYTHON, "python_overhead", ("function", FD), waited),
    (
        "Pinocchio, as its documentation shows it",
        "forward_dynamics",
        None,
        times("Pinocchio, ratio"),
    ),
    (
        "Pinocchio's CRBA with all that was found to speed it up",
        *("forward_dynamics", None, times("Pinocchio tuned, ratio")),
    ),
    ("MuJoCo, its full chain reduced", "forward_dynamics", None, times("MuJoCo, ratio")),
    ("C by CasADi", "forward_dynamics", None, times("CasADi, ratio")),
    (BATCH, "batches", ("function", FD), batch),
    ("**Jacobians of v_dot, from C**, us", "jacobians", None, number("ns", 1e-3)),
    (PYTHON, "python_overhead", ("function", DFD), waited),
    ("computeRNEADerivatives, as documented", "jacobians", None, times("Pinocchio, ratio")),
    ("computeRNEADerivatives, tuned", "jacobians", None, times("Pinocchio tuned, ratio")),
    ("C by CasADi, columns of a rotation by hand", "jacobians", None, times("CasADi, ratio")),
    (BATCH, "batches", ("function", DFD), batch),
    ("**Hessian of lambda^T (H v_dot + C), from C**, us", "hessians", None, number("ns", 1e-3)),
    (PYTHON, "python_overhead", ("function", HESSIAN), waited),
    ("C by CasADi, the same numbers", "hessians", None, times("CasADi, ratio")),
    (BATCH, "batches", ("function", HESSIAN), batch),
    (
        "**flight of 0.6 s, off by 1e-6, for the caller**, us",
        *("flights", FLIGHT, number("for the caller, us")),
    ),
    ("times real time", "flights", FLIGHT, number("times real time")),
    (
        "flights of 200 steps a second, 6000 in a call",
        *("rollouts", None, number("6000 in a call, 1/s")),
    ),
    ("**forward dynamics of other tails**, us", "long_tails", None, number("v_dot, ns", 1e-3)),
    ("their Jacobians, us", "long_tails", None, number("Jacobians, ns", 1e-3)),
    ("SoRoMoX, a call from Python", "soromox", None, times("ratio")),
    ("**v_dot with feet**, half of them in the ground, us", *CONTACT, number("v_dot, ns", 1e-3)),
    ("matrix of an implicit step, factored, us", *CONTACT, number("implicit, ns", 1e-3)),
    *(
        row
        for scene in ("flight", "tracking", "sliding", "impact")
        for row in (
            (f"**{scene}**, times real time", "simulations", ("scene", scene), SPEED),
            ("LSODA on the same C", "simulations", ("scene", scene), times("LSODA, ratio")),
        )
    ),
    ("**generated and compiled from nothing**, s", "generation", None, number("in all, s")),
)


def publish(report: dict) -> None:
    """Write the tables into the page and the README, between their marks."""
    if missing := ({measure for _, measure, *_ in ROWS} | {"planning"}) - {*report}:
        raise SerpentailError(f"the tables need more measures: {', '.join(sorted(missing))}")
    for name, lines in (("docs/benchmarks.md", block(report)), ("README.md", first(report))):
        path, text = ROOT / name, "\n".join([*lines, ""])
        before, after = re.split(f"(?<={BEGIN}).*(?={END})", path.read_text(), flags=re.DOTALL)
        path.write_text(before + text + after)


def block(report: dict) -> list[str]:
    """Return the lines of the page: the machine, and a table without rows that nothing measured."""
    there = list(dict.fromkeys(row["processor"] for row in report["forward_dynamics"]))
    table = [[f"tail (m, n): {' / '.join(there)}", *MODELS], ["---"] * (1 + len(MODELS))]
    for words, measure, where, show in ROWS:
        rows = [row for row in report.get(measure, []) if not where or row[where[0]] == where[1]]
        cells = [cell(rows, model, show) for model in MODELS]
        if any(cells):
            table.append([words, *cells])
    return [f"{'; '.join(map(str, report['machine'].values()))}.", "", *printed(table)]


def cell(rows: list[dict], model: str, show: Callable[[dict], str]) -> str:
    """Return the result of a model on one processor after the other."""
    try:
        return " / ".join(show(row) for row in rows if row["model"] == model)
    except KeyError:  # this one was not measured
        return ""


def first(report: dict) -> list[str]:
    """Return the table of the README: a (3, 4) tail on the first processor."""

    def row(measure: str, key: str, value: str) -> dict:
        return next(row for row in report[measure] if row[key].startswith(value))

    fd, dfd = (row(name, "model", "(3, 4)") for name in ("forward_dynamics", "jacobians"))
    slide = row("simulations", "scene", "sliding")
    beside = [f"{name} {spanned(fd, f'{name}, ratio')}" for name in ("MuJoCo", "CasADi")]
    beside.insert(0, f"Pinocchio's tuned CRBA {spanned(fd, 'Pinocchio tuned, ratio')}")
    slopes = f"Pinocchio's tuned derivatives {spanned(dfd, 'Pinocchio tuned, ratio')}"
    step = row("planning", "figure", "(6, 2), an iteration")
    table = [
        ["what", "serpentail", "peers: times as long"],
        ["---"] * 3,
        ["forward dynamics, one call from C", f"{short(fd['ns'] * 1e-3)} us", ", ".join(beside)],
        [
            "exact Jacobians of the acceleration, from C",
            f"{short(dfd['ns'] * 1e-3)} us",
            f"{slopes}, C by CasADi {spanned(dfd, 'CasADi, ratio')}",
        ],
        [
            "sliding on feet and tail for 0.5 s, error of q below 1e-4",
            f"{short(slide['ms'])} ms",
            f"SciPy's LSODA on the same C {spanned(slide, 'LSODA, ratio')}",
        ],
        [
            "an iteration of the planner, (6, 2), 83 intervals",
            step["about"].split(",")[0].removeprefix("FATROP "),
            f"IPOPT with MUMPS {step['value']}",
        ],
    ]
    return printed(table)


def printed(table: list[list[str]]) -> list[str]:
    """Return a Markdown table."""
    return [f"| {' | '.join(line)} |" for line in table]
