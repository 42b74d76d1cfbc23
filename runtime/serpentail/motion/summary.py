"""``summary``: the numbers of a motion by name, for JSON, as text or as a table."""

import math
from typing import Any

import numpy as np

from ..model.model import Model
from .numbers import NUMBERS, UNITS
from .table import as_markdown, as_text, as_word
from .trajectory import Trajectory


class Summary(dict[str, Any]):
    """The numbers of a motion by name, ready for JSON; printed, they have their units."""

    def __str__(self) -> str:
        return as_text(self, UNITS)

    def described(self) -> dict[str, dict[str, Any]]:
        """Return value, unit and meaning of each number by name, ready for JSON."""
        return {
            each.name: {"value": self[each.name], "unit": each.unit, "meaning": each.meaning}
            for each in NUMBERS
        }

    def markdown(self) -> str:
        """Return a Markdown table of name, value, unit and meaning."""
        rows = ((each.name, as_word(self[each.name]), each.unit, each.meaning) for each in NUMBERS)
        return as_markdown(("number", "value", "unit", "meaning"), rows)


def summary(model: Model, motion: Trajectory) -> Summary:
    """Return the numbers of a motion, such as apex, landing, forces and work.

    Parameters
    ----------
    model : Model
        The model that moved.
    motion : Trajectory
        The motion.

    Returns
    -------
    Summary
        A dict of numbers by name, SI unless the name gives a unit; None if a number does not
        exist. ``described()`` adds units and meanings, ``markdown()`` gives a table.

    Notes
    -----
    docs/simulation.md lists all names, units and meanings.
    """
    with np.errstate(over="ignore", invalid="ignore"):  # of a run that blows up
        return Summary({each.name: _ready(each.of(model, motion)) for each in NUMBERS})


def _ready(value: Any) -> Any:
    """Return a value for JSON: None for a number that is not finite."""
    if isinstance(value, dict):
        return {name: _ready(each) for name, each in value.items()}
    return None if isinstance(value, float) and not math.isfinite(value) else value
