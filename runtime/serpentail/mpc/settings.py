"""MpcSettings of ``Mpc``, checked one by one."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..basics.checks import none_of, number, refusal, shown, whole_number
from ..basics.errors import PlanningError
from ..model.model import Model
from ..planning.goal import Bounds
from ..planning.magnitudes import checked_bounds
from ..planning.result.plan import Plan, refuse_unfit
from .kernel import FUNCTIONS

NEEDED = dict(
    zip(FUNCTIONS, ("airborne_rates", "airborne_rates_derivatives", "momentum"), strict=True)
)
DEFAULTS: dict[str, Any] = {"intervals": 6, "delay": 0.0, "iterations": 2, "step": 1e-2}
DEFAULTS |= {"rest": None, "bounds": None, "ignore_path": False}
NAMES = ("rate", "horizon", *DEFAULTS)
MOST = 100  # intervals, Gauss-Newton steps
MOST_STEPS = 1000  # of Runge-Kutta, in an interval
MOST_TICKS = 100_000


@dataclass(frozen=True)
class MpcSettings:
    """Checked settings of ``Mpc``; horizon: s, inf for the rest of the plan; bounds: arrays."""

    rate: float
    horizon: float
    intervals: int
    delay: float
    iterations: int
    step: float
    rest: float
    bounds: Bounds


def checked_settings(model: Model, plan: Plan, given: dict[str, Any]) -> MpcSettings:
    """Return the settings, with defaults for those left out; PlanningError if one is wrong."""
    for name in given:
        unknown = none_of("Mpc: setting", name, NAMES)
        if unknown:
            raise PlanningError(unknown)
    given = DEFAULTS | given
    _refuse_path(plan, given["ignore_path"])
    bounds = given["bounds"]
    bounds = plan.problem.bounds if bounds is None else checked_bounds(model, bounds)
    rate = _number("rate", given["rate"], "1/s", above=0)
    if rate * plan.duration > MOST_TICKS:
        needs = f"at most {MOST_TICKS / plan.duration:.3g} Hz: {MOST_TICKS} ticks"
        raise refusal("Mpc: rate", rate, needs, PlanningError)
    delay = _number("delay", given["delay"], "s", least=0)
    if delay > 1 / rate:
        needs = f"at most the time between ticks, {1 / rate:.3g} s: or take a lower rate"
        raise refusal("Mpc: delay", delay, needs, PlanningError)
    horizon = np.inf
    if given["horizon"] is not None:
        horizon = _number("horizon", given["horizon"], "s", above=0)
    rest = 1 / rate if given["rest"] is None else _number("rest", given["rest"], "s", least=0)
    if rest + delay >= plan.duration:
        needs = f"to be less than the plan's {plan.duration:.4g} s, together with the delay"
        raise refusal("Mpc: rest", rest, needs, PlanningError)
    step = _number("step", given["step"], "s", above=0)
    intervals = _count("intervals", given["intervals"])
    if max(min(horizon, plan.duration) / intervals, delay) / step > MOST_STEPS:
        needs = f"at most {MOST_STEPS} steps in an interval: make it longer"
        raise refusal("Mpc: step", step, needs, PlanningError)
    iterations = _count("iterations", given["iterations"])
    return MpcSettings(rate, horizon, intervals, delay, iterations, step, rest, bounds)


def refuse_unable(model: Model, plan: Plan) -> None:
    """PlanningError if the model or the plan cannot be controlled."""
    if not isinstance(plan, Plan):
        raise PlanningError(f"Mpc: plan: value {shown(plan)}: needs what st.plan returns")
    refuse_unfit("Mpc", model, plan, NEEDED.values())


def _refuse_path(plan: Plan, ignored: Any) -> None:
    """PlanningError if the plan has constraints that corrections do not know of, unless ignored."""
    if not isinstance(ignored, bool):
        raise refusal("Mpc: ignore_path", ignored, "True or False", PlanningError)
    if plan.problem.path and not ignored:
        raise PlanningError(
            f"Mpc: the plan has {len(plan.problem.path)} constraints of path or clearance, which "
            "its corrections do not keep: give ignore_path=True to fly without them, or plan with "
            "bounds of angles and rates in their place"
        )


def _number(name: str, value: Any, unit: str, **bounds: float) -> float:
    return float(number(f"Mpc: {name}", value, PlanningError, unit=unit, **bounds))


def _count(name: str, value: Any) -> int:
    return whole_number(f"Mpc: {name}", value, PlanningError, least=1, most=MOST)
