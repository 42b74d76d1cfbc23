"""The first table of docs/benchmarks.md, from a report.

Each cell has AVX-512 before AVX2. A peer's figure is how many times as long as ours it takes.
"""

from collections.abc import Callable

from benchmarks.batches import DFD, FD, HESSIAN

MODELS = ("(1, 3)", "(3, 4)", "(6, 6)", "(8, 16)")


def short(value: float) -> str:
    """Return a number of two digits, without an exponent."""
    return f"{float(f'{value:.2g}'):.6g}"


def us(column: str, scale: float = 1e-3) -> Callable[[dict], str]:
    """Return a function that shows nanoseconds in us."""
    return lambda row: short(row[column] * scale)


def times(column: str) -> Callable[[dict], str]:
    """Return a function that shows how many times slower a peer is."""
    return lambda row: f"{short(row[f'{column}_ns'] / row['ns'])}x"


def alone(row: dict) -> str:
    """Show a state of a batch in us, and how many times as long it takes alone."""
    return f"{short(row['side by side, ns'] * 1e-3)} ({short(row['ratio'])}x)"


def waited(row: dict) -> str:
    """Show microseconds for the caller, and those outside C."""
    return f"{short(row['caller_us'])} ({short(row['overhead_us'])})"


# words, measure, function or scene, contents of a cell
ROWS: tuple[tuple[str, str, str | None, Callable[[dict], str]], ...] = (
    ("**forward dynamics, one call from C**, us", "speed", None, us("ns")),
    ("from Python (of it outside C), us", "call_times", FD, waited),
    ("Pinocchio, as its documentation shows it", "speed", None, times("plain")),
    ("Pinocchio's CRBA with all that was found to speed it up", "speed", None, times("tuned")),
    ("Pinocchio's data types, coupled joints summed by hand", "speed", None, times("own")),
    ("MuJoCo, its full chain reduced", "other_peers", None, times("mujoco")),
    ("C by CasADi", "other_peers", None, times("casadi")),
    ("**one state of a batch**, one core, us (one by one takes)", "batch_times", FD, alone),
    ("**Jacobians of v_dot, from C**, us", "jacobian_times", None, us("ns")),
    ("from Python (of it outside C), us", "call_times", DFD, waited),
    ("computeRNEADerivatives, as documented", "jacobian_times", None, times("plain")),
    ("computeRNEADerivatives, tuned", "jacobian_times", None, times("revolutes")),
    ("the same, coupled joints summed by hand", "jacobian_times", None, times("own")),
    ("C by CasADi, columns of a rotation by hand", "jacobian_times", None, times("hand")),
    ("one state of a batch, one core, us (one by one takes)", "batch_times", DFD, alone),
    ("**Hessian of lambda^T (H v_dot + C), from C**, us", "hessian_times", None, us("ns")),
    ("from Python (of it outside C), us", "call_times", HESSIAN, waited),
    ("C by CasADi, the same numbers", "hessian_times", None, times("casadi")),
    ("C by CasADi, nonzeros of one triangle", "hessian_times", None, times("sparse")),
    ("one state of a batch, one core, us (one by one takes)", "batch_times", HESSIAN, alone),
    ("**flight of 0.6 s, off by 1e-6, for the caller**, us", "flights", None, us("caller_us", 1)),
    ("times real time", "flights", None, us("real_time_factor", 1)),
    (
        "flights of 200 steps a second, 6000 in a call",
        "rollout_rates",
        None,
        us("6000 in a call, 1/s", 1),
    ),
)


def block(report: dict) -> list[str]:
    """Return the lines of the table; a row without a measurement is left out."""
    there = list(dict.fromkeys(row["processor"] for row in report.get("speed", [])))
    if not there:
        return []
    report = report | {"flights": by_model(report.get("flight_times", []))}
    lines = [[f"articulated tail (m, n): {' / '.join(there)}", *MODELS], ["---"] * 5]
    for words, measure, function, show in ROWS:
        rows = [r for r in report.get(measure, []) if function in (None, r.get("function"))]
        cells = [cell(rows, model, there, show) for model in MODELS]
        if any(cells):
            lines.append([words, *cells])
    return [f"| {' | '.join(line)} |" for line in lines]


def cell(rows: list[dict], model: str, there: list[str], show: Callable[[dict], str]) -> str:
    """Return the result of a model on one processor after the other."""
    of = {row["processor"]: row for row in rows if row.get("model") == model}
    shown = []
    for processor in there:
        try:
            shown.append(show(of[processor]))
        except KeyError:  # this one was not measured
            return ""
    return " / ".join(shown)


def by_model(rows: list[dict]) -> list[dict]:
    """Return the rows of flights of 0.6 s, with the model that their scene names."""
    end = ", flight of 0.6 s"
    flights = (row for row in rows if row["scene"].endswith(end))
    return [row | {"model": row["scene"].removesuffix(end)} for row in flights]
