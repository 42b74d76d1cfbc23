"""What a REPL shows of a dataclass that holds arrays: their shapes, in place of their numbers."""

from collections.abc import Mapping
from dataclasses import fields
from typing import Any

import numpy as np

from serpentail_scene.messages import one_line, shown

MOST = 90  # characters of a field's value
FEW = 7  # numbers that are shown as they are: an attitude, a vector, a small row of bounds


def brief(thing: Any) -> str:
    """Return a dataclass on one line, such as ``Contact(points=(1201, 6, 3), ...)``.

    It serves as ``__repr__``: arrays of more than FEW numbers are shown by their shapes, and long
    values are cut.
    """
    entries = [f"{each.name}={_value(getattr(thing, each.name))}" for each in fields(thing)]
    return f"{type(thing).__name__}({', '.join(entries)})"


def _value(value: Any) -> str:
    """A field's value."""
    if isinstance(value, Mapping):
        entries = [f"{name}: {_value(entry)}" for name, entry in value.items()]
        return one_line(f"{{{', '.join(entries)}}}", MOST)
    if isinstance(value, np.ndarray) and value.size > FEW:
        return f"array of {' x '.join(map(str, value.shape))}"
    return shown(value.tolist() if isinstance(value, np.ndarray) else value, MOST)
