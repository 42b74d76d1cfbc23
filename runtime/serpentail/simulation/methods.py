"""Integration methods, their settings, and the choice of "auto"."""

from collections.abc import Collection
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..basics.checks import number, one_of
from ..basics.errors import SimulationError

FIXED = ("rk4", "implicit_euler")
ADAPTIVE = ("tsit5", "ros34pw2", "switching", "dp8")
SCIPY = ("dop853", "lsoda")
SETTINGS = {
    **dict.fromkeys(FIXED, ("step",)),
    **dict.fromkeys(
        ADAPTIVE, ("rtol", "atol", "first_step", "least_step", "most_step", "most_steps")
    ),
    **dict.fromkeys(SCIPY, ("rtol", "atol", "most_steps")),
}
# times the tolerances, times the steps, of runs that are made again to estimate errors
LOOSER, LONGER = (4.0, 10.0), (2, 3)
# 1/s: a decay beyond this limits the steps of tsit5 at rtol 1e-4 to less than those of ros34pw2,
# whose lengths are as the third root of the tolerance
STIFF_DECAY = 3e3
LONG = 10.0  # s: in shorter flights the drift of tsit5 is seldom seen
MIN_ROUNDINGS = 100  # rounding errors that a relative tolerance must allow, as in SciPy's methods
# default tolerances
SINGLE_RTOL = {"tsit5": 1e-4, "ros34pw2": 1e-3, "switching": 1e-3, "dp8": 2e-5}
DOUBLE_RTOL = {"tsit5": 1e-8, "ros34pw2": 1e-4, "switching": 1e-4, "dp8": 1e-12}


@dataclass(frozen=True)
class IntegrationMethod:
    """A method, why it was chosen, and its settings."""

    name: str
    reason: str
    settings: dict[str, float]

    @property
    def info(self) -> dict[str, Any]:
        """What a trajectory's info says of it."""
        finite = {name: x for name, x in self.settings.items() if x is not np.inf}
        return finite | {"method": self.name, "reason": self.reason}

    def coarser(self, coarse: int, interval: float) -> "IntegrationMethod":
        """Return this method at some times its error, for samples so far apart (s).

        Where so few steps fill an interval that they cannot be longer, there is one more.
        """
        settings = dict(self.settings)
        for name in ("rtol", "atol", "least_step", "most_step"):
            if np.isfinite(settings.get(name, np.inf)):
                settings[name] *= LOOSER[coarse]
        if "step" in settings:
            steps = round(interval / settings["step"])
            settings["step"] = interval / (steps // LONGER[coarse] or steps + 1)
        return replace(self, settings=settings)


def checked_method(
    name: str, settings: dict[str, Any], available: Collection[str], single: bool
) -> IntegrationMethod:
    """Return a method with checked settings and defaults; SimulationError names what is wrong."""
    known = [each for each in SETTINGS if each in available or each in SCIPY]
    one_of("method", name, ("auto", *known), SimulationError)
    unknown = [key for key in settings if key not in SETTINGS[name]]
    if unknown:
        has = ", ".join((*SETTINGS[name], "output_step"))
        raise SimulationError(
            f"{name} has no setting {', '.join(map(repr, unknown))}; it has {has}"
        )
    checked = {
        key: number(key, value, SimulationError, unit="s" if key.endswith("step") else "", above=0)
        for key, value in settings.items()
    }
    if "rtol" in checked:
        least = MIN_ROUNDINGS * np.finfo(np.float32 if single and name not in SCIPY else float).eps
        if checked["rtol"] < least:
            raise SimulationError(
                f"rtol {checked['rtol']:.3g}: too close to rounding errors: give {least:.2g} or "
                "more"
            )
    return IntegrationMethod(name, "", _defaults(name, single, checked))


def default_rtol(name: str, single: bool) -> float:
    """Return the relative tolerance of an adaptive method of the generated C, if none is given."""
    return (SINGLE_RTOL if single else DOUBLE_RTOL)[name]


def usual_most_steps(span: float) -> int:
    """Return the largest number of steps of a run over a time (s), if none is given: some seconds
    of work for short runs, a minute for long ones.
    """
    return int(min(max(3e5 * span, 3e5), 1e6))


def _defaults(name: str, single: bool, chosen: dict[str, float]) -> dict[str, float]:
    """Return settings with defaults: tolerances that suit method and precision, steps of 0.1 ms."""
    if name in FIXED:
        return {"step": 1e-4} | chosen
    if name in SCIPY:
        tolerances = {"rtol": 1e-6, "atol": 1e-6} if single else {"rtol": 1e-10, "atol": 1e-12}
        return tolerances | chosen
    rtol = chosen.get("rtol", default_rtol(name, single))
    return {"rtol": rtol, "atol": rtol, "most_step": np.inf} | chosen


def chosen(
    settings: dict[str, Any], available: Collection[str], decay: float, place: str, drifts: bool
) -> tuple[str, str]:
    """Return the method of "auto" and the reason.

    decay (1/s): fastest one of damping. place: "flight", "fixed base" or "ground".
    drifts: a long run, moved by nothing that could hide a drift of its energy.
    """
    if "step" in settings:
        implicit = place == "ground" and "implicit_euler" in available
        name = "implicit_euler" if implicit else "rk4"
        return name, "a step of a fixed length was asked for"
    if place == "ground" and "switching" not in available:
        lack = "the scene lacks `implicit`, which suitable methods need"
        return "tsit5", f"contact with the ground, but {lack}"
    damped = f"damping acts at {decay:.2g} 1/s"
    if decay > STIFF_DECAY * (1e-4 / settings["rtol"]) ** (1 / 3) and "ros34pw2" in available:
        return "ros34pw2", f"{damped}: stiff"
    if place == "ground":
        return "switching", "tsit5 in flight, ros34pw2 in contact with the ground: stiff"
    if drifts:
        return "dp8", f"{place}, long and without damping and torques: order 8 conserves best"
    return "tsit5", f"{place}, {damped}" if decay else place
