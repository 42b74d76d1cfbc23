"""The project's performance targets, and which of them a report meets."""

from dataclasses import dataclass

from benchmarks.models import DFD, FD, HESSIAN


@dataclass(frozen=True)
class Target:
    """A bound of a column of a measure: at least, or at most.

    of: only in the rows of these models; on: only on this processor; where: the value that another
    column must have.
    """

    what: str
    measure: str
    column: str
    bound: float
    of: tuple[str, ...] = ()
    on: str = ""
    where: tuple[str, str] | None = None
    at_most: bool = False

    def concerns(self, row: dict) -> bool:
        """Tell whether the target is about a row."""
        if self.column not in row or (self.where and row.get(self.where[0]) != self.where[1]):
            return False
        of_model = not self.of or row.get("model") in self.of
        return of_model and self.on in ("", row.get("processor"))

    def judged(self, row: dict) -> dict:
        """Return what is asked, what a row has, and the verdict."""
        found = row[self.column]
        met = found <= self.bound if self.at_most else found >= self.bound
        return {
            "target": self.what,
            "model": row.get("model", ""),
            "processor": row.get("processor", "any"),
            "asked": f"{'at most' if self.at_most else 'at least'} {self.bound:g}",
            "found": float(found),
            "verdict": "met" if met else "MISSED",
        }


SHORT, SHORTER, LONG = ("(1, 3)", "(3, 4)"), ("(1, 3)", "(3, 4)", "(6, 6)"), ("(8, 16)",)
ARCS = ("continuum, m = 64",)


def batch(what: str, function: str, bound: float, of: tuple[str, ...], on: str = "") -> Target:
    """Return the target of a batch over single calls."""
    where = "function", function
    return Target(f"{what}, batch over one by one", "batches", "ratio", bound, of, on, where)


def operations(what: str, function: str) -> Target:
    """Return the target of operations executed over needed."""
    words, where = f"{what}, operations of a batch over needed", ("function", function)
    return Target(words, "operations", "ratio", 1.2, SHORT, where=where, at_most=True)


def flight(what: str, column: str, bound: float, of: tuple[str, ...], at_most=False) -> Target:
    """Return the target of a run for its caller."""
    return Target(what, "flights", column, bound, of, "", ("scene", what), at_most)


PEERS = "times as long as ours"
TARGETS = (
    Target(f"v_dot: Pinocchio, {PEERS}", "forward_dynamics", "Pinocchio, ratio", 13, SHORTER),
    Target(f"v_dot: Pinocchio, {PEERS}", "forward_dynamics", "Pinocchio, ratio", 18, LONG),
    Target("v_dot: Pinocchio tuned", "forward_dynamics", "Pinocchio tuned, ratio", 13, SHORTER),
    Target("v_dot: Pinocchio tuned", "forward_dynamics", "Pinocchio tuned, ratio", 18, LONG),
    Target("v_dot: MuJoCo, reduced", "forward_dynamics", "MuJoCo, ratio", 11),
    Target("v_dot: CasADi's C", "forward_dynamics", "CasADi, ratio", 1.25, ("(1, 3)",)),
    Target("v_dot: CasADi's C", "forward_dynamics", "CasADi, ratio", 1.7, ("(3, 4)",)),
    Target("v_dot: SoRoMoX, a call", "soromox", "ratio", 100),
    Target("v_dot: SoRoMoX, in a compiled loop", "soromox", "ratio in a loop", 100),
    Target("Jacobians: Pinocchio", "jacobians", "Pinocchio, ratio", 14),
    Target("Jacobians: Pinocchio tuned", "jacobians", "Pinocchio tuned, ratio", 14),
    Target("Hessian: CasADi's C", "hessians", "CasADi, ratio", 1.5, ("(1, 3)",)),
    Target("Hessian: CasADi's C", "hessians", "CasADi, ratio", 2.5, ("(3, 4)",)),
    Target("Jacobians: CasADi's C", "jacobians", "CasADi, ratio", 2.2, ("(3, 4)",)),
    Target("64 arcs: v_dot, ns", "long_tails", "v_dot, ns", 25e3, ARCS, at_most=True),
    Target("64 arcs: Jacobians", "long_tails", "Jacobians, ns", 6e5, ARCS, at_most=True),
    batch("v_dot", FD, 6, SHORT, "AVX-512"),
    batch("v_dot", FD, 4, ("(6, 6)",), "AVX-512"),
    batch("v_dot", FD, 3, LONG, "AVX-512"),
    batch("Jacobians", DFD, 3, SHORT, "AVX-512"),
    batch("Jacobians", DFD, 2, SHORT, "AVX2"),
    batch("Hessian", HESSIAN, 4, SHORT, "AVX-512"),
    batch("Hessian", HESSIAN, 2.5, SHORT, "AVX2"),
    operations("Jacobians", DFD),
    operations("Hessian", HESSIAN),
    Target(
        "v_dot, a call from Python, us outside C",
        *("python_overhead", "outside C, us", 0.6),
        where=("function", FD),
        at_most=True,
    ),
    flight("flight of 0.03 s", "outside C, us", 60, SHORT, at_most=True),
    flight("flight of 0.6 s", "times real time", 5000, ("(1, 3)",)),
    flight("flight of 0.6 s", "times real time", 1000, ("(3, 4)",)),
    flight("impact", "times real time", 150, ("(3, 4)",)),
    Target("sliding", "simulations", "times real time", 600, where=("scene", "sliding")),
)


def judged(report: dict) -> list[dict]:
    """Return what is asked and what was found for each target, processor and model; nothing about
    measures that were left out.
    """
    return [
        target.judged(row)
        for target in TARGETS
        for row in report.get(target.measure, [])
        if target.concerns(row)
    ]
