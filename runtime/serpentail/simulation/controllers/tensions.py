"""What tensions a model's tendons may have."""

import numpy as np

from ...basics.errors import SimulationError
from ...model.model import Model
from .piecewise import Piecewise

ROUNDING = 1e-6  # of a limit, by which tensions of a solver may go beyond it


def refuse_tensions(model: Model, curve: Piecewise) -> None:
    """SimulationError if a model has other tendons, or a tension is below 0 or above its limit."""
    names = model.layout.tendons
    if not names or curve.channels != len(names):
        has = f"{len(names)} tendons" if names else "none: give its scene tables [tendon.NAME]"
        raise SimulationError(f"tensions: {curve.channels} tendons: {model.name} has {has}")
    times, limits = curve.times, np.atleast_1d(model.parameters["tendon_limits"])
    looks = np.linspace(0, 1, max(curve.coefficients.shape[2], 2))
    inner = (times[:-1, None] + np.diff(times)[:, None] * looks[:-1]).ravel()
    found = curve.at(np.append(inner, np.nextafter(times[1:], 0)))[0]
    wrong = (found < -ROUNDING * limits) | (found > (1 + ROUNDING) * limits)
    if wrong.any():
        row, k = np.argwhere(wrong)[0]
        needs = f"tendon {names[k]} needs 0 to {limits[k]:g} N"
        raise SimulationError(f"tensions[:, {k}]: value {found[row, k]:.6g}: {needs}")
