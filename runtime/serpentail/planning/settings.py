"""How to search for a plan: settings of rule, mesh, solver and guesses, and their checks."""

import re
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from ..basics.checks import Refusals, needed, number, one_of, shown, whole_number
from ..basics.errors import PlanningError
from ..model.model import Model
from ..motion.trajectory import Trajectory
from ..optimal.rules import collocation_rule
from .magnitudes import HUGE

WHOLE_NUMBERS = {  # least and most of each; beyond the most a search would not end
    "rounds": (0, 1000),
    "multi_start": (1, 10_000),
    "retries": (0, 10_000),
    "seed": (0, 2**63 - 1),
}
# None: the planner chooses
CHOSEN = dict.fromkeys(("intervals", "most_intervals", "controls"), (1, 10_000))
ROUGHLY = 10.0  # times the tolerances
SOLVERS = ("auto", "fatrop", "ipopt")


@dataclass(frozen=True)
class PlanSettings:
    """How to search for a plan: collocation rule, mesh, tolerances, solver, guesses."""

    degree: int | None
    intervals: int | None
    most_intervals: int | None
    controls: int | None
    rounds: int
    tolerance: float | None  # deg; None: no demand at all
    tail_tolerance: float | None  # deg; None: no demand
    rate_tolerance: float | None  # rad/s; None: no demand
    solver: str
    options: dict[str, Any]
    time_limit: float | None  # s
    guess: Any  # a Plan, a Trajectory, or Plans of which one may help
    guess_damping: float  # N m s
    multi_start: int
    retries: int
    seed: int
    track: bool
    through_torso: bool

    def roughly(self, guess: Any) -> "PlanSettings":
        """Return settings of a search that shows whether a problem has a plan, from a guess."""
        rougher = [
            None if most is None else ROUGHLY * most
            for most in (self.tolerance, self.tail_tolerance, self.rate_tolerance)
        ]
        return replace(
            self,
            guess=guess,
            retries=0,
            multi_start=1,
            track=False,
            tolerance=rougher[0],
            tail_tolerance=rougher[1],
            rate_tolerance=rougher[2],
        )

    @property
    def first_solver(self) -> str:
        """The solver that is tried first."""
        return "ipopt" if self.solver == "ipopt" else "fatrop"

    def options_of(self, solver: str) -> dict[str, Any]:
        """Options whose names begin with a solver's."""
        return {k: v for k, v in self.options.items() if str(k).startswith(f"{solver}.")}

    @property
    def allowed(self) -> dict[str, float]:
        """Largest true errors at the end: attitude and tail (deg), rates (rad/s)."""
        named = {
            "attitude": self.tolerance,
            "tail": self.tail_tolerance,
            "rate": self.rate_tolerance,
        }
        return {name: most for name, most in named.items() if most is not None}


def check_settings(model: Model, settings: PlanSettings, refused: Refusals) -> None:
    """Add each wrong setting, with its remedy, to ``refused``."""
    for name, bounds in WHOLE_NUMBERS.items():
        refused.attempt(name, _check_whole, name, getattr(settings, name), *bounds)
    for name, bounds in CHOSEN.items():
        if getattr(settings, name) is not None:
            refused.attempt(name, _check_whole, name, getattr(settings, name), *bounds)
    for name in ("tolerance", "tail_tolerance", "rate_tolerance", "time_limit"):
        if getattr(settings, name) is not None:
            refused.attempt(name, _check_positive, name, getattr(settings, name))
    refused.attempt("options", _check_options, settings.options)
    refused.attempt("guess", _check_guess, model, settings.guess)
    damping = partial(number, error=PlanningError, least=0, most=HUGE)
    refused.attempt("guess_damping", damping, "guess_damping", settings.guess_damping)
    for name in ("track", "through_torso"):
        if not isinstance(getattr(settings, name), bool | np.bool_):
            refused.add(name, needed(name, getattr(settings, name), "True or False"))
    refused.attempt("solver", one_of, "solver", settings.solver, SOLVERS, PlanningError)
    refused.attempt("degree", collocation_rule, settings.degree)


def _check_whole(name: str, value: Any, least: int, most: int) -> None:
    """PlanningError unless a value is a whole number within bounds."""
    whole_number(name, value, PlanningError, least=least, most=most)


def _check_positive(name: str, value: Any) -> None:
    """PlanningError unless a value is a number above 0."""
    number(name, value, PlanningError, above=0)


def _check_options(options: Any) -> None:
    """PlanningError unless options are a dict of settings of FATROP and IPOPT."""
    needs = "a dict, such as {'fatrop.max_iter': 500, 'ipopt.max_iter': 500}"
    if not isinstance(options, dict):
        raise PlanningError(needed("options", options, needs))
    for name in options:
        if not re.fullmatch(r"(ipopt|fatrop)\.\w+", str(name)):
            raise PlanningError(
                f"options: {shown(name)}: needs a name that begins with 'fatrop.' or 'ipopt.'"
            )


def _check_guess(model: Model, guess: Any) -> None:
    """PlanningError unless the guess is None, or a motion of such a model."""
    if guess is None:
        return
    if isinstance(guess, tuple | list):
        for k, each in enumerate(guess):
            if not hasattr(each, "trajectory"):
                raise PlanningError(f"guess[{k}]: value {shown(each)}: needs a Plan")
            _check_guess(model, each)
        return
    motion = getattr(guess, "trajectory", guess)
    if not isinstance(motion, Trajectory):
        raise PlanningError(f"guess: value {shown(guess)}: needs a Plan or a Trajectory")
    if motion.q.shape[1] != model.nq or len(motion.t) < 2:
        raise PlanningError(
            f"guess: q has shape {motion.q.shape}: needs at least two samples of {model.nq}"
        )
