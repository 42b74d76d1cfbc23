"""How exact the numbers of a motion are: it is made twice again, less exactly, and what changes is
told.

At higher tolerances, or with longer steps, the error is larger than the motion's own, so the change
is an estimate on the safe side. Two runs do not both hit a number by chance.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from serpentail_scene.layout import POSITION

from ..basics.errors import SimulationError
from ..model.model import Model
from .body import semi_axes
from .derived import AGAIN
from .trajectory import Trajectory

ALLOWED = 0.01  # of the animal's length that B may be off at the end, without a warning
# what says how the motion was made, and not what it is
OF_THE_RUN = {"model", "method", "reason", "steps", "rejected", "evaluations", "cpu_s"}
OF_THE_RUN |= {"real_time_factor", "imbalance", "warnings"}
COARSE = 2  # runs that are made to estimate errors
UNCERTAIN = "uncertain"  # the error of what is no number, or exists in one of both motions only


def made_again(motion: Trajectory) -> list[Trajectory] | str:
    """Return the motion made again, less and less exactly, or in one line why there is none."""
    again = vars(motion).get(AGAIN)
    if again is None:
        return (
            "errors: no estimate: only what simulate or a sequence made can be made again, not what"
            " was read, resampled or taken from Rollouts, failed, or was controlled by st.Sampled"
        )
    found: list[Trajectory] = []
    for coarse in range(COARSE):
        try:
            found.append(again(coarse))
        except SimulationError as error:
            if not found:
                return f"errors: no estimate: made less exactly, the run fails: {error}"
    return found


def errors_of(numbers: Mapping[str, Any], others: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Return the estimated errors of numbers by name, from those of the motion made again."""
    return {
        name: _error(value, [each[name] for each in others])
        for name, value in numbers.items()
        if name not in OF_THE_RUN and value is not None
    }


def _error(one: Any, others: Sequence[Any]) -> Any:
    """Return how far a value and others of its kind are apart at most."""
    if not all(isinstance(each, type(one)) for each in others):
        return UNCERTAIN
    if isinstance(one, dict):
        return {name: _error(each, [o.get(name) for o in others]) for name, each in one.items()}
    if isinstance(one, list):
        return [_error(each, list(rest)) for each, *rest in zip(one, *others, strict=True)]
    if isinstance(one, float):
        return max(abs(one - each) for each in others)
    return UNCERTAIN if any(each != one for each in others) else None


def strays(model: Model, motion: Trajectory, again: Sequence[Trajectory]) -> list[str]:
    """Return a warning if B is far off at the end, by the motion made again."""
    end = motion.pose[-1, POSITION]
    off = max(float(np.linalg.norm(end - each.pose[-1, POSITION])) for each in again)
    allowed = ALLOWED * float(2 * semi_axes(model).max() + model.parameters["tail_length"])
    if not off > allowed:
        return []
    remedy = "take a smaller rtol" if "rtol" in motion.info else "take a shorter step"
    return [
        f"errors: B is off by an estimated {1e3 * off:.2g} mm at the end, more than "
        f"{1e3 * allowed:.2g} mm: {remedy}"
    ]
