"""``summary``: the numbers of a motion by name, for JSON, as text or as a table."""

import math
from typing import Any

import numpy as np

from ..model.model import Model
from .errors import errors_of, made_again, strays
from .numbers import NUMBERS, UNITS
from .table import as_error, as_markdown, as_text, as_word
from .trajectory import Trajectory


class Summary(dict[str, Any]):
    """The numbers of a motion by name, ready for JSON; printed, they have their units.

    ``errors``: their estimated errors by name, in the same units; empty if nobody asked.
    """

    def __init__(self, numbers: dict[str, Any]):
        super().__init__(numbers)
        self.errors: dict[str, Any] = {}

    def __str__(self) -> str:
        return as_text(self, UNITS, self.errors)

    def described(self) -> dict[str, dict[str, Any]]:
        """Return value, error, unit and meaning of each number by name, ready for JSON."""
        return {
            each.name: {
                "value": self[each.name],
                "error": self.errors.get(each.name),
                "unit": each.unit,
                "meaning": each.meaning,
            }
            for each in NUMBERS
        }

    def markdown(self) -> str:
        """Return a Markdown table of name, value, error if it is known, unit and meaning."""
        heads, rows = ("number", "value", "error", "unit", "meaning"), []
        for each in NUMBERS:
            error = as_error(self.errors.get(each.name)).removeprefix("+- ")
            rows.append((each.name, as_word(self[each.name]), error, each.unit, each.meaning))
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
    found = Summary(_numbers(model, motion))
    if errors:
        again = made_again(motion)
        if isinstance(again, str):
            found["warnings"] = [*found["warnings"], again]
        else:
            found.errors = errors_of(found, [_numbers(model, each) for each in again])
            found["warnings"] = [*found["warnings"], *strays(model, motion, again)]
    return found


def _numbers(model: Model, motion: Trajectory) -> dict[str, Any]:
    """Return the numbers by name."""
    with np.errstate(over="ignore", invalid="ignore"):  # of a run that blows up
        return {each.name: _ready(each.of(model, motion)) for each in NUMBERS}


def _ready(value: Any) -> Any:
    """Return a value for JSON: None for a number that is not finite."""
    if isinstance(value, dict):
        return {name: _ready(each) for name, each in value.items()}
    return None if isinstance(value, float) and not math.isfinite(value) else value
