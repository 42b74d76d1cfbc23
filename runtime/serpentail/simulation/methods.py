"""Integration methods: a name and settings go in; a checked choice, and why it was made, come
out.
"""

from dataclasses import dataclass

import numpy as np

from ..checks import number, one_of
from ..errors import SimulationError

FIXED = ("rk4", "implicit_euler")
ADAPTIVE = ("tsit5", "ros34pw2")
SCIPY = ("dop853", "lsoda")
SETTINGS = {
    **dict.fromkeys(FIXED, ("step",)),
    **dict.fromkeys(
        ADAPTIVE, ("rtol", "atol", "first_step", "least_step", "most_step", "most_steps")
    ),
    **dict.fromkeys(SCIPY, ("rtol", "atol")),
}
# 1/s: a fastest decay beyond this limits the steps of an explicit method, not their accuracy
STIFF = 5e3
LEAST = 100  # roundings that a relative tolerance must allow, as SciPy's methods ask
SINGLE = {"tsit5": 1e-4, "ros34pw2": 1e-3}  # tolerances in single precision


@dataclass(frozen=True)
class IntegrationMethod:
    """A method, why it was chosen, and its settings."""

    name: str
    reason: str
    settings: dict

    @property
    def info(self) -> dict:
        """What a trajectory's info says of it."""
        finite = {name: x for name, x in self.settings.items() if x is not np.inf}
        return finite | {"method": self.name, "reason": self.reason}


def checked_method(name: str, settings: dict, available, single: bool) -> IntegrationMethod:
    """Return a method by its name with settings checked and filled in; SimulationError names what
    is wrong.
    """
    known = [each for each in SETTINGS if each in available or each in SCIPY]
    one_of("method", name, ("auto", *known), SimulationError)
    unknown = [key for key in settings if key not in SETTINGS[name]]
    if unknown:
        has = ", ".join((*SETTINGS[name], "output_step"))
        raise SimulationError(
            f"{name} has no setting {', '.join(map(repr, unknown))}; it has {has}"
        )
    checked = {key: number(key, value, SimulationError, above=0) for key, value in settings.items()}
    least = LEAST * np.finfo(np.float32 if single and name not in SCIPY else float).eps
    if checked.get("rtol", 1.0) < least:
        raise SimulationError(
            f"rtol {checked['rtol']:.3g}: too near to rounding: give {least:.2g} or more"
        )
    return IntegrationMethod(name, "", _defaults(name, single, checked))


def _defaults(name: str, single: bool, given: dict) -> dict:
    """Return settings with defaults: tolerances that suit a method and a precision, a step of 0.1
    ms.
    """
    if name in FIXED:
        return {"step": 1e-4} | given
    if name in SCIPY:
        return ({"rtol": 1e-6, "atol": 1e-6} if single else {"rtol": 1e-10, "atol": 1e-12}) | given
    rtol = given.get("rtol", SINGLE[name] if single else 1e-4 if name == "ros34pw2" else 1e-8)
    return {
        "rtol": rtol,
        "atol": given.get("atol", rtol),
        "most_step": np.inf,
        "most_steps": 10**6,
    } | given


def chosen(settings: dict, available, decay: float | None) -> tuple[str, str]:
    """Return the method of "auto" and why; ``decay`` (1/s) is the fastest by joint damping, None on
    the ground.
    """
    if "step" in settings:
        fixed = (
            "rk4" if decay is not None or "implicit_euler" not in available else "implicit_euler"
        )
        return fixed, "a step of a fixed length was asked for"
    if decay is None and "ros34pw2" in available:
        return "ros34pw2", "contact with the ground: stiff"
    if decay is None:
        return (
            "tsit5",
            "contact with the ground, but the scene has no `implicit` for a method that suits it",
        )
    if decay > STIFF and "ros34pw2" in available:
        return "ros34pw2", f"joint damping decays at {decay:.2g} 1/s: stiff"
    return "tsit5", "flight" + (f", joint damping decays at {decay:.2g} 1/s" if decay else "")
