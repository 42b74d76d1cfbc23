"""The project's performance targets, and which of them a report meets."""

from typing import NamedTuple


class Target(NamedTuple):
    """A bound of a column of a measure, or of the ratio of two columns.

    of: only in the rows of these models; on: only on these processors; where: the value that
    another column must have.
    """

    what: str
    measure: str
    slow: str
    bound: float
    of: tuple[str, ...] = ()
    fast: str | None = "ns"
    on: tuple[str, ...] = ()
    where: tuple[str, str] | None = None
    most: bool = False


SHORTER, SHORT, LONG = ("(1, 3)", "(3, 4)", "(6, 6)"), ("(1, 3)", "(3, 4)"), ("(8, 16)",)
ALONE, BESIDE = "one by one, ns", "side by side, ns"
FD = ("function", "forward_dynamics")
DFD = ("function", "forward_dynamics_derivatives")
HESSIAN = ("function", "inverse_dynamics_hessian")
EIGHT, FOUR = ("AVX-512",), ("AVX2",)  # lanes of double


def batch(what: str, bound: float, of: tuple, on: tuple, where: tuple[str, str]) -> Target:
    """Return the target of a batch over single calls."""
    return Target(
        f"{what}, batch over one by one", "batch_times", ALONE, bound, of, BESIDE, on, where
    )


def scene(name: str, column: str, bound: float, most: bool = False) -> Target:
    """Return the target of a run for its caller."""
    return Target(name, "flight_times", column, bound, (), None, (), ("scene", name), most)


TARGETS = (
    Target("v_dot: Pinocchio, coupled, as documented", "speed", "plain_ns", 13, SHORTER),
    Target("v_dot: Pinocchio, coupled, as documented", "speed", "plain_ns", 18, LONG),
    Target("v_dot: Pinocchio, coupled, tuned", "speed", "tuned_ns", 13, SHORTER),
    Target("v_dot: Pinocchio, coupled, tuned", "speed", "tuned_ns", 18, LONG),
    Target("v_dot: MuJoCo, reduced", "other_peers", "mujoco_ns", 11),
    Target("v_dot: CasADi's C", "other_peers", "casadi_ns", 1.25, ("(1, 3)",)),
    Target("v_dot: CasADi's C", "other_peers", "casadi_ns", 1.7, ("(3, 4)",)),
    Target("v_dot: SoRoMoX, a call", "continuum_peer", "SoRoMoX, a call, ns", 100),
    Target("v_dot: SoRoMoX, in a compiled loop", "continuum_peer", "in a compiled loop, ns", 100),
    Target("Jacobians: Pinocchio, as documented", "jacobian_times", "plain_ns", 14),
    Target("Jacobians: Pinocchio, tuned", "jacobian_times", "revolutes_ns", 14),
    Target("Hessian: CasADi's C, in like terms", "hessian_times", "casadi_ns", 1.5, ("(1, 3)",)),
    Target("Hessian: CasADi's C, in like terms", "hessian_times", "casadi_ns", 2, ("(3, 4)",)),
    batch("v_dot", 6, SHORTER, EIGHT, FD),
    batch("v_dot", 2.5, LONG, (), FD),
    batch("Jacobians", 3, SHORT, EIGHT, DFD),
    batch("Jacobians", 2, SHORT, FOUR, DFD),
    batch("Hessian", 4, SHORT, EIGHT, HESSIAN),
    batch("Hessian", 2.5, SHORT, FOUR, HESSIAN),
    Target(
        "operations executed over needed, Jacobians, batch",
        *("operation_counts", "executed", 1.2, SHORT, "needed"),
        where=DFD,
        most=True,
    ),
    Target(
        "operations executed over needed, Hessian, batch",
        *("operation_counts", "executed", 1.2, SHORT, "needed"),
        where=HESSIAN,
        most=True,
    ),
    Target(
        "v_dot, a call from Python, us outside C",
        *("call_times", "overhead_us", 0.6, (), None),
        where=FD,
        most=True,
    ),
    scene("(1, 3), flight of 0.03 s", "overhead_us", 60, most=True),
    scene("(3, 4), flight of 0.03 s", "overhead_us", 60, most=True),
    scene("(1, 3), flight of 0.6 s", "real_time_factor", 5000),
    scene("(3, 4), flight of 0.6 s", "real_time_factor", 1000),
    scene("(3, 4), impact", "real_time_factor", 150),
)


def judged(report: dict) -> list[dict]:
    """Return what is demanded and what was found for each target, processor and model; nothing
    about measures that were left out.
    """
    return [
        judgement(target, row)
        for target in TARGETS
        for row in report.get(target.measure, [])
        if concerns(target, row)
    ]


def concerns(target: Target, row: dict) -> bool:
    """Tell whether a target is about a row."""
    if target.slow not in row or (target.where and row.get(target.where[0]) != target.where[1]):
        return False
    chosen = (("model", target.of), ("processor", target.on))
    return all(not some or row.get(column) in some for column, some in chosen)


def judgement(target: Target, row: dict) -> dict:
    """Return one row."""
    found = row[target.slow] / row[target.fast] if target.fast else row[target.slow]
    met = found <= target.bound if target.most else found >= target.bound
    return {
        "target": target.what,
        "model": row.get("model", ""),
        "processor": row.get("processor", "any"),
        "asked": f"{'at most' if target.most else 'at least'} {target.bound:g}",
        "found": float(found),
        "verdict": "met" if met else "MISSED",
    }
