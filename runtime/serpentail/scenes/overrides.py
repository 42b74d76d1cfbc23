"""Changes of a scene's values by their names, such as "mu=0.5" on the command line."""

import tomllib
from collections.abc import Iterable, Mapping
from typing import Any

from ..checks import shown
from ..errors import SimulationError


def parsed(texts: Iterable[str]) -> dict:
    """Return name -> value of texts NAME=VALUE, values as in a scene file; a word is a text."""
    values = {}
    for text in texts:
        name, sign, value = text.partition("=")
        if not (sign and name.strip() and value.strip()):
            raise SimulationError(f"--set {text}: needs NAME=VALUE, such as mu=0.5")
        try:
            values[name.strip()] = tomllib.loads(f"value = {value}")["value"]
        except tomllib.TOMLDecodeError:
            values[name.strip()] = value.strip()
    return values


def changed(table: Mapping, changes: Mapping) -> dict:
    """Return a copy of a table with new values by name.

    Names are such as "start.pitch", or "legs.moves.0.rate" in an array of tables.
    """
    for name, value in changes.items():
        table = _with(table, name.split("."), value, name)
    return dict(table)


def _with(part: Any, path: list[str], value: Any, name: str) -> Any:
    """Return a copy of a table or an array with a new value at a path; missing tables are made."""
    if not path:
        return value
    first, *rest = path
    in_missing_array = rest and rest[0].isdigit()
    if isinstance(part, Mapping) and (first in part or not in_missing_array):
        return dict(part) | {first: _with(part.get(first, {}), rest, value, name)}
    if isinstance(part, list) and first.isdigit() and int(first) < len(part):
        k = int(first)
        return [*part[:k], _with(part[k], rest, value, name), *part[k + 1 :]]
    raise SimulationError(
        f"change {shown(name)}: {shown(first)} is not in {shown(part)}: name a key, or a place "
        "from 0"
    )
