"""The project's performance targets, and which of them a report meets."""

from typing import NamedTuple


class Target(NamedTuple):
    """A column of a measure is to be at least so many times another, in the rows of these models;
    all if none.
    """

    what: str
    measure: str
    slow: str
    least: float
    models: tuple[str, ...] = ()
    fast: str = "ns"


SHORTER = ("(1, 3)", "(3, 4)", "(6, 6)")
TARGETS = (
    Target("v_dot: Pinocchio, coupled, as documented", "speed", "plain_ns", 13, SHORTER),
    Target("v_dot: Pinocchio, coupled, as documented", "speed", "plain_ns", 18, ("(8, 16)",)),
    Target("v_dot: Pinocchio, coupled, tuned", "speed", "tuned_ns", 13, SHORTER),
    Target("v_dot: Pinocchio, coupled, tuned", "speed", "tuned_ns", 18, ("(8, 16)",)),
    Target("v_dot: MuJoCo, reduced", "other_peers", "mujoco_ns", 11),
    Target("v_dot: CasADi's C", "other_peers", "casadi_ns", 1.25, ("(1, 3)",)),
    Target("v_dot: CasADi's C", "other_peers", "casadi_ns", 1.7, ("(3, 4)",)),
    Target("v_dot: SoRoMoX, a call", "continuum_peer", "SoRoMoX, a call, ns", 100),
    Target("v_dot: SoRoMoX, in a compiled loop", "continuum_peer", "in a compiled loop, ns", 100),
    Target("Jacobians: Pinocchio, as documented", "jacobian_times", "plain_ns", 14),
    Target("Jacobians: Pinocchio, tuned", "jacobian_times", "tuned_ns", 14),
    Target("v_dot, batch: one by one", "batch_times", "one by one, ns", 6, fast="side by side, ns"),
)


def judged(report: dict) -> list[dict]:
    """Return for each target and model how many times slower is asked, and was found; of what was
    left out, nothing.
    """
    return [
        judgement(target, row["model"], row[target.slow] / row[target.fast])
        for target in TARGETS
        for row in report[target.measure]
        if target.slow in row and row["model"] in (target.models or (row["model"],))
    ]


def judgement(target: Target, model: str, ratio: float) -> dict:
    """Return one row."""
    verdict = "met" if ratio >= target.least else "MISSED"
    return {
        "slower": target.what,
        "model": model,
        "times, at least": target.least,
        "found": ratio,
        "verdict": verdict,
    }
