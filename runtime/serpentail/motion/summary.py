"""``summary``: the numbers of a motion by name, for JSON, as text or as a table; their errors.

For the errors the motion is made twice again, less exactly: at higher tolerances, or with longer
steps, the error is larger than the motion's own, so the change is an estimate on the safe side. Two
runs do not both hit a number by chance.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from serpentail_scene.layout import POSITION

from ..basics.errors import SimulationError
from ..basics.near_names import none_such
from ..model.model import Model
from .body import semi_axes
from .derived import AGAIN
from .numbers import NUMBERS, UNITS, numbers_of
from .text import as_error, as_markdown, as_text, as_word
from .trajectory import Trajectory

ALLOWED = 0.01  # of the animal's length that B may be off at the end, without a warning
# what says how the motion was made, and not what it is
OF_THE_RUN = {"model", "method", "reason", "steps", "rejected", "evaluations", "cpu_s"}
OF_THE_RUN |= {"real_time_factor", "imbalance", "warnings"}
COARSE = 2  # runs that are made to estimate errors
UNCERTAIN = "uncertain"  # the error of what is no number, or exists in one of both motions only


class Summary(dict[str, Any]):
    """The numbers of a motion by name, ready for JSON; printed, they have their units.

    ``errors``: their estimated errors by name, in the same units; empty if nobody asked.
    """

    def __init__(self, numbers: dict[str, Any]):
        super().__init__(numbers)
        self.errors: dict[str, Any] = {}

    def __str__(self) -> str:
        return as_text(self, UNITS, self.errors)

    def __missing__(self, name: object) -> Any:
        raise KeyError(none_such("number: value", name, self))

    def described(self) -> dict[str, dict[str, Any]]:
        """Return value, error, unit and meaning of each number by name, ready for JSON."""
        return {
            name: {
                "value": self[name],
                "error": self.errors.get(name),
                "unit": unit,
                "meaning": meaning,
            }
            for name, unit, meaning, _ in NUMBERS
        }

    def markdown(self) -> str:
        """Return a Markdown table of name, value, error if it is known, unit and meaning."""
        heads, rows = ("number", "value", "error", "unit", "meaning"), []
        for name, unit, meaning, _ in NUMBERS:
            error = as_error(self.errors.get(name)).removeprefix("+- ")
            rows.append((name, as_word(self[name]), error, unit, meaning))
        keep = [0, 1, 2, 3, 4] if self.errors else [0, 1, 3, 4]
        return as_markdown([heads[k] for k in keep], ([row[k] for k in keep] for row in rows))


def summary(model: Model, motion: Trajectory, errors: bool = False) -> Summary:
    """Return the numbers of a motion, such as apex, landing, forces and work.

    Parameters
    ----------
    model : Model
        The model that moved.
    motion : Trajectory
        The motion.
    errors : bool, default False
        Whether to estimate the numerical error of each number. The motion is then made again at
        four and ten times its tolerances, or with steps of two and three times the length, which
        takes about as long as one and a half motions; what changes most is the estimate.

    Returns
    -------
    Summary
        A dict of numbers by name, SI unless the name gives a unit; None if a number does not
        exist. ``errors`` has their errors by name. ``described()`` adds errors, units and
        meanings, ``markdown()`` gives a table.

    Notes
    -----
    docs/simulation.md lists all names, units and meanings. A motion that cannot be made again,
    because it was read from a file, for example, has no errors, and a warning says so.
    """
    result = Summary(numbers_of(model, motion))
    if errors:
        again = _made_again(motion)
        if isinstance(again, str):
            result["warnings"] = [*result["warnings"], again]
            return result
        others = [numbers_of(model, other) for other in again]
        result.errors = {
            name: _error(value, [numbers[name] for numbers in others])
            for name, value in result.items()
            if name not in OF_THE_RUN and value is not None
        }
        result["warnings"] = [*result["warnings"], *_strays(model, motion, again)]
    return result


def _made_again(motion: Trajectory) -> list[Trajectory] | str:
    """The motion made again, less and less exactly, or in one line why there is none."""
    again = vars(motion).get(AGAIN)
    if again is None:
        return (
            "errors: no estimate: only what simulate or a sequence made can be made again, not what"
            " was read, resampled or taken from Rollouts, failed, or was controlled by st.Sampled"
        )
    motions: list[Trajectory] = []
    for coarse in range(COARSE):
        try:
            motions.append(again.coarser(coarse))
        except SimulationError as error:
            if not motions:
                return f"errors: no estimate: made less exactly, the run fails: {error}"
    return motions


def _error(value: Any, others: Sequence[Any]) -> Any:
    """How far a value and others of its kind are apart at most."""
    if not all(isinstance(other, type(value)) for other in others):
        return UNCERTAIN
    if isinstance(value, dict):
        return {name: _error(x, [other.get(name) for other in others]) for name, x in value.items()}
    if isinstance(value, list):
        return [_error(x, list(rest)) for x, *rest in zip(value, *others, strict=True)]
    if isinstance(value, float):
        return max(abs(value - other) for other in others)
    return UNCERTAIN if any(other != value for other in others) else None


def _strays(model: Model, motion: Trajectory, again: Sequence[Trajectory]) -> list[str]:
    """A warning if B is far off at the end, by the motion made again."""
    end = motion.pose[-1, POSITION]
    off = max(float(np.linalg.norm(end - other.pose[-1, POSITION])) for other in again)
    allowed = ALLOWED * float(2 * semi_axes(model).max() + model.parameters["tail_length"])
    if not off > allowed:
        return []
    remedy = "take a smaller rtol" if "rtol" in motion.info else "take a shorter step"
    return [
        f"errors: B is off by an estimated {1e3 * off:.2g} mm at the end, more than "
        f"{1e3 * allowed:.2g} mm: {remedy}"
    ]
