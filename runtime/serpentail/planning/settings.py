"""How to search for a plan: the settings of rule, mesh, solver and guesses, and their checks."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..checks import number, one_of, refusal, shown
from ..errors import PlanningError
from ..motion.trajectory import Trajectory
from .problem import HUGE

WHOLE_NUMBERS = {  # least and most of each; beyond the most a search would not end
    "intervals": (1, 10_000),
    "rounds": (0, 1000),
    "most_intervals": (1, 10_000),
    "multi_start": (1, 10_000),
    "retries": (0, 10_000),
    "seed": (0, 2**63 - 1),
}


@dataclass(frozen=True)
class PlanSettings:
    """How to find a plan: collocation rule, mesh, tolerance of the truth, solver, guesses."""

    rule: str = "radau"
    degree: int | None = None
    intervals: int = 12
    tolerance: float | None = 0.01  # deg; None: no demand
    rounds: int = 6
    most_intervals: int = 200
    solver: str = "ipopt"
    options: dict[str, Any] = field(default_factory=dict)
    guess: Any = None  # a Plan or a Trajectory
    guess_damping: float = 1e-3  # N m s
    multi_start: int = 1
    retries: int = 4
    seed: int = 0
    dynamics: str = "auto"
    time_limit: float | None = None  # s
    track: bool = True


def checked_settings(model, **settings) -> PlanSettings:
    """Return the settings; PlanningError names the first that is wrong, and the remedy."""
    checked = PlanSettings(**settings)
    for name, (least, most) in WHOLE_NUMBERS.items():
        value = getattr(checked, name)
        whole = isinstance(value, int | np.integer) and not isinstance(value, bool)
        if not whole or not least <= value <= most:
            raise refusal(name, value, f"a whole number from {least} to {most}", PlanningError)
    for name in ("tolerance", "time_limit"):
        if getattr(checked, name) is not None:
            number(name, getattr(checked, name), PlanningError, above=0)
    if not isinstance(checked.options, dict):
        raise PlanningError(
            f"options: value {shown(checked.options)}: needs a dict, such as "
            "{'ipopt.max_iter': 500}"
        )
    _check_guess(model, checked.guess)
    number("guess_damping", checked.guess_damping, PlanningError, least=0, most=HUGE)
    if not isinstance(checked.track, bool | np.bool_):
        raise refusal("track", checked.track, "True or False", PlanningError)
    one_of("dynamics", checked.dynamics, ("auto", "compiled", "symbolic"), PlanningError)
    return checked


def _check_guess(model, guess) -> None:
    """PlanningError unless a guess is None, or a motion of such a model."""
    if guess is None:
        return
    motion = getattr(guess, "trajectory", guess)
    if not isinstance(motion, Trajectory):
        raise PlanningError(f"guess: value {shown(guess)}: needs a Plan or a Trajectory")
    if motion.q.shape[1] != model.nq or len(motion.t) < 2:
        raise PlanningError(
            f"guess: q has shape {motion.q.shape}: needs at least two samples of {model.nq}"
        )
