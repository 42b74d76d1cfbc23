"""What a law is, and the numerical derivatives that laws use."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..model.model import Model
from .errors import rounding
from .states import State

NEAR = 450  # roundings: 1e-13 in double
FEW = 8  # links in a segment


@dataclass(frozen=True)
class Law:
    """A law: how to find its error at a state, or errors by place, how large they may be, and what
    it needs.
    """

    name: str
    text: str
    error: Callable[[Model, State], float | dict[str, float]]
    needs: tuple[str, ...] = ()  # functions of the model
    units: float = 0.0  # limit, in roundings (eps) of the model's real type
    floor: float = 0.0  # limit of what has other reasons than rounding
    only: str = ""  # real type or kind of tail of the models that it holds for

    def limit(self, model: Model) -> float:
        """Return the limit; beyond a few links, the n^2 pairs that an entry of H sums cancel where
        they are folded.
        """
        units = self.units
        if units and (model.links or model.samples) > FEW:
            units = max(units, model.segments * (model.links or model.samples) ** 2)
        return self.floor + units * rounding(model)


def registry(laws: list[Law]):
    """Return a decorator that adds a function (model, state) -> error, or errors by place, to a
    list of laws.

    Its name and docstring are the law's.
    """

    def law(*needs: str, **limits):
        def register(error):
            laws.append(
                Law(
                    error.__name__.replace("_", " "),
                    " ".join(error.__doc__.split()),
                    error,
                    needs,
                    **limits,
                )
            )
            return error

        return register

    return law


# Motions and derivatives

STENCIL = (6 / 7, -15 / 56, 5 / 63, -1 / 56, 1 / 385, -1 / 5544)  # central differences of order 12


def slope(f: Callable[[float], np.ndarray], rate: float) -> tuple[np.ndarray, np.ndarray]:
    """Return df/dt at t = 0 and the largest |f| used, for f made of sines and cosines of up to
    ``rate`` (rad/s).

    Relative to rate |f| the truncation is 8e-5 (rate step)^12 = 8e-17, and a rounding of f counts 1
    / (rate step).
    """
    step = 0.1 / rate
    samples = [(w, f(k * step), f(-k * step)) for k, w in enumerate(STENCIL, 1)]
    largest = np.max([np.maximum(abs(ahead), abs(behind)) for _, ahead, behind in samples], axis=0)
    return sum(w * (ahead - behind) for w, ahead, behind in samples) / step, largest


def moved(q: np.ndarray, v: np.ndarray, time: float) -> np.ndarray:
    """Return the configuration that the constant velocity v leads to."""
    angle = np.linalg.norm(v[3:6]) * time / 2
    turn = np.concatenate([[np.cos(angle)], np.sinc(angle / np.pi) * time / 2 * v[3:6]])
    return np.concatenate([q[:3] + time * v[:3], product(q[3:7], turn), q[7:] + time * v[6:]])


def product(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return the Hamilton product of two quaternions (w, x, y, z)."""
    vector = a[0] * b[1:] + b[0] * a[1:] + np.cross(a[1:], b[1:])
    return np.concatenate([[a[0] * b[0] - a[1:] @ b[1:]], vector])


def fastest(model: Model, v: np.ndarray) -> float:
    """Return a bound on the angular velocity of every link (rad/s)."""
    return np.linalg.norm(v[3:6]) + (model.links or 1) * np.sum(abs(v[6:]))
