"""Changes of a scene's values by their names, such as "mu=0.5" on the command line."""

import re
from collections.abc import Iterable, Mapping
from typing import Any

from serpentail_scene.messages import one_line, shown
from serpentail_scene.source import tables_in

from ..basics.errors import SimulationError

DEEPEST = 8  # names in a path
PLACE = re.compile("[0-9]{1,9}")  # in an array


def parsed(texts: Iterable[str]) -> dict:
    """Return name -> value of texts NAME=VALUE, values as in a scene file; a word is a text."""
    values = {}
    for text in texts:
        name, sign, value = (part.strip() for part in text.partition("="))
        if not (sign and name and value) or len(text.splitlines()) > 1:
            raise SimulationError(
                f"--set {one_line(text)}: needs NAME=VALUE, on one line, such as mu=0.5"
            )
        try:
            values[name] = tables_in(f"value = {value}")["value"]
        except (ValueError, RecursionError):  # not TOML
            values[name] = value
    return values


def changed(table: Mapping, changes: Mapping) -> dict:
    """Return a copy of a table with new values by name.

    Names are such as "start.pitch", or "legs.moves.0.rate" in an array of tables.
    """
    for name, value in changes.items():
        path = name.split(".")
        if len(path) > DEEPEST:
            raise SimulationError(
                f"change {shown(name)}: {len(path)} names: needs at most {DEEPEST}, with dots"
            )
        table = _with(table, path, value, name)
    return dict(table)


def _with(part: Any, path: list[str], value: Any, name: str) -> Any:
    """Return a copy of a table or an array with a new value at a path; missing tables are made."""
    if not path:
        return value
    first, *rest = path
    in_missing_array = rest and PLACE.fullmatch(rest[0])
    if isinstance(part, Mapping) and (first in part or not in_missing_array):
        return dict(part) | {first: _with(part.get(first, {}), rest, value, name)}
    if isinstance(part, list) and PLACE.fullmatch(first) and int(first) < len(part):
        k = int(first)
        return [*part[:k], _with(part[k], rest, value, name), *part[k + 1 :]]
    needed = f"a place from 0 to {len(part) - 1}" if isinstance(part, list) else "a name in a table"
    raise SimulationError(
        f"change {shown(name)}: {shown(first)} is not in {shown(part, 70)}: needs {needed}"
    )
