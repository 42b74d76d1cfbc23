"""The first table of docs/benchmarks.md, from a report.

Each cell has AVX-512 before AVX2. A peer's figure is how many times as long as ours it takes.
"""

from collections.abc import Callable

from benchmarks.models import DFD, FD, HESSIAN

MODELS = ("(1, 3)", "(3, 4)", "(6, 6)", "(8, 16)")


def short(value: float) -> str:
    """Return a number of two digits, without an exponent."""
    return f"{float(f'{value:.2g}'):.6g}"


def number(column: str, scale: float = 1.0) -> Callable[[dict], str]:
    """Return a function that shows a column, times a factor."""
    return lambda row: short(row[column] * scale)


def times(peer: str) -> Callable[[dict], str]:
    """Return a function that shows how many times as long a peer takes."""
    return lambda row: f"{short(row[f'{peer}, ratio'])}x"


def batch(row: dict) -> str:
    """Show a state of a batch in us, and how many times as long it takes alone."""
    return f"{short(row['side by side, ns'] * 1e-3)} ({short(row['ratio'])}x)"


def waited(row: dict) -> str:
    """Show microseconds for the caller, and those outside C."""
    return f"{short(row['for the caller, us'])} ({short(row['outside C, us'])})"


BATCH = "one state of a batch, one core, us (one by one takes)"
PYTHON = "from Python (of it outside C), us"
FLIGHT = ("scene", "flight of 0.6 s")
# words, measure, the value that a column must have, contents of a cell
ROWS: tuple[tuple[str, str, tuple[str, str] | None, Callable[[dict], str]], ...] = (
    ("**forward dynamics, one call from C**, us", "forward_dynamics", None, number("ns", 1e-3)),
    (PYTHON, "python_overhead", ("function", FD), waited),
    ("Pinocchio, as its documentation shows it", "forward_dynamics", None, times("Pinocchio")),
    (
        "Pinocchio's CRBA with all that was found to speed it up",
        *("forward_dynamics", None, times("Pinocchio tuned")),
    ),
    ("MuJoCo, its full chain reduced", "forward_dynamics", None, times("MuJoCo")),
    ("C by CasADi", "forward_dynamics", None, times("CasADi")),
    (BATCH, "batches", ("function", FD), batch),
    ("**Jacobians of v_dot, from C**, us", "jacobians", None, number("ns", 1e-3)),
    (PYTHON, "python_overhead", ("function", DFD), waited),
    ("computeRNEADerivatives, as documented", "jacobians", None, times("Pinocchio")),
    ("computeRNEADerivatives, tuned", "jacobians", None, times("Pinocchio tuned")),
    ("C by CasADi, columns of a rotation by hand", "jacobians", None, times("CasADi")),
    (BATCH, "batches", ("function", DFD), batch),
    ("**Hessian of lambda^T (H v_dot + C), from C**, us", "hessians", None, number("ns", 1e-3)),
    (PYTHON, "python_overhead", ("function", HESSIAN), waited),
    ("C by CasADi, the same numbers", "hessians", None, times("CasADi")),
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
)


def block(report: dict) -> list[str]:
    """Return the lines of the table; a row without a measurement is left out."""
    there = list(dict.fromkeys(row["processor"] for row in report.get("forward_dynamics", [])))
    if not there:
        return []
    lines = [[f"articulated tail (m, n): {' / '.join(there)}", *MODELS], ["---"] * 5]
    for words, measure, where, show in ROWS:
        rows = report.get(measure, [])
        if where:
            rows = [row for row in rows if row.get(where[0]) == where[1]]
        cells = [cell(rows, model, there, show) for model in MODELS]
        if any(cells):
            lines.append([words, *cells])
    return [f"| {' | '.join(line)} |" for line in lines]


def cell(rows: list[dict], model: str, there: list[str], show: Callable[[dict], str]) -> str:
    """Return the result of a model on one processor after the other; "" if one is missing."""
    of = {row["processor"]: row for row in rows if row.get("model") == model}
    try:
        return " / ".join(show(of[processor]) for processor in there)
    except KeyError:  # this one was not measured
        return ""
