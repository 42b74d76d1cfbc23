"""Changes: texts such as "mu=0.5", or values by dotted names, and nested tables go in; changed
tables come out.
"""

import tomllib
from collections.abc import Iterable, Mapping

from ..errors import SimulationError


def parsed(texts: Iterable[str]) -> dict:
    """Return name -> value of texts NAME=VALUE, values as in a scene file; a plain word stands for
    a text.
    """
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
    """Return a copy of a table with new values: "start.pitch", or "legs.moves.0.rate" in an array
    of tables.
    """
    for name, value in changes.items():
        table = _with(table, name.split("."), value, name)
    return dict(table)


def _with(part, path: list[str], value, name: str):
    first, *rest = path
    if isinstance(part, Mapping) and (first in part or not (rest and rest[0].isdigit())):
        inner = _with(part.get(first, {}), rest, value, name) if rest else value
        return dict(part) | {first: inner}
    if isinstance(part, list) and first.isdigit() and int(first) < len(part):
        k = int(first)
        return [*part[:k], _with(part[k], rest, value, name) if rest else value, *part[k + 1 :]]
    raise SimulationError(
        f"change {name!r}: {first!r} is not in {part!r}: name a key, or a place from 0"
    )
