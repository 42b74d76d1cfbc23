"""When each foot touches, by the forces at a motion's samples; events know both feet together."""

import numpy as np
from numpy.typing import NDArray

from .forces import feet
from .trajectory import Trajectory


def feet_touching(motion: Trajectory) -> dict[str, float]:
    """Return for how long (s) each foot touches: intervals that begin with a force."""
    steps = np.diff(motion.t)
    return {name: float(steps @ touching[:-1]) for name, touching in _touching(motion).items()}


def feet_times(motion: Trajectory, kind: str, which: int) -> dict[str, float | None]:
    """Return the first sample (s) of each foot's touch or flight of a kind, by its place."""
    sign = 1 if kind == "touch_down" else -1
    found = {}
    for name, touching in _touching(motion).items():
        times = motion.t[1:][np.diff(touching.astype(int)) == sign].tolist()
        found[name] = times[which] if times else None
    return found


def _touching(motion: Trajectory) -> dict[str, NDArray[np.bool_]]:
    """Return for each foot the samples (K,) at which the ground pushes it."""
    pushes = {name: forces[..., 2] > 0 for name, forces in feet(motion).items()}
    return {name: np.asarray(pushed.any(axis=1)) for name, pushed in pushes.items()}
