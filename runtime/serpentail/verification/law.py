"""What a law is, and the numerical derivatives along motions that laws use."""

import warnings
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from serpentail_scene.layout import OMEGA
from serpentail_scene.parameters import PARTS

from ..basics.errors import UnusualSize
from ..model.model import Model
from ..model.passive import idle
from .errors import rounding
from .states import Case

# limits in roundings (eps of the model's real type)
VALUE_LIMIT = 450  # 1e-13 in double
SLOPE_LIMIT = 10 * VALUE_LIMIT  # a slope divides rounding by its step
# their forces have no slopes by wide differences: stops are piecewise, the air's drag almost
PIECEWISE = ("stops", "air")
ACTING = (*PARTS, "air")  # all that acts beside gravity and torques
FEW_LINKS = 8  # in a segment: with more of them, rounding grows

Errors = float | dict[str, float]  # one error, or one for each place
LawFunction = Callable[[Model, Case], Errors]


@dataclass(frozen=True)
class Law:
    """A law: how to find its error at a state, how large that may be, and what it needs."""

    name: str
    text: str
    error: LawFunction
    needs: tuple[str, ...] = ()  # functions of the model
    units: float = 0.0  # limit, in roundings (eps) of the model's real type
    floor: float = 0.0  # limit of errors with other causes than rounding
    only: str = ""  # real type or kind of tail of the models that it holds for; "free" torsos
    casadi: bool = False  # whether it evaluates CasADi functions
    without: tuple[str, ...] = ()  # parts of the passive tail, or "air", that it holds without

    def limit(self, model: Model) -> float:
        """Return the limit, which grows with the links of a segment.

        An entry of H sums n^2 pairs of links, which cancel if the tail is folded.
        """
        units, pieces = self.units, int(max(model.joints_each)) if model.links else model.samples
        if units and pieces and pieces > FEW_LINKS:
            units = max(units, model.segments * pieces**2)
        return self.floor + units * rounding(model)


def law(needs: str = "", units: float = 0.0, **limits: Any) -> Callable[[LawFunction], Law]:
    """Return a decorator: a function of a model and a state that returns errors becomes a law.

    The function's name and docstring are the law's. needs: names of functions, between spaces.
    """

    def made(error: LawFunction) -> Law:
        name = error.__name__.replace("_", " ")
        text = " ".join((error.__doc__ or "").split())
        return Law(name, text, error, tuple(needs.split()), units, **limits)

    return made


def rid_of(model: Model, parts: tuple[str, ...]) -> Model:
    """Return a model without these parts of a passive tail."""
    changes = idle(model.parameters, parts)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UnusualSize)  # move stops out of reach
        return model.with_parameters(**changes) if changes else model


# Motions and derivatives

STENCIL = (6 / 7, -15 / 56, 5 / 63, -1 / 56, 1 / 385, -1 / 5544)  # central differences of order 12


def slope(f: Callable[[float], np.ndarray], rate: float) -> tuple[np.ndarray, np.ndarray]:
    """Return df/dt at t = 0, and the largest |f| used.

    f is made of sines and cosines of up to ``rate`` (rad/s).  Relative to rate |f| the truncation
    is 8e-5 (rate step)^12 = 8e-17, and a rounding of f counts 1 / (rate step).
    """
    step = 0.1 / rate
    samples = [(w, f(k * step), f(-k * step)) for k, w in enumerate(STENCIL, 1)]
    largest = np.max([np.maximum(abs(ahead), abs(behind)) for _, ahead, behind in samples], axis=0)
    return sum(w * (ahead - behind) for w, ahead, behind in samples) / step, largest


def fastest(model: Model, v: np.ndarray) -> float:
    """Return a bound on the angular velocity of every link (rad/s)."""
    joints = model.joints_each * np.max(np.abs(model.parameters.get("joint_ratios", 1.0)))
    turning = np.repeat(joints, model.layout.widths) * abs(v[model.layout.tail_v])
    of_torso = 0.0 if model.fixed else np.linalg.norm(v[OMEGA])
    return float(of_torso + np.sum(turning))
