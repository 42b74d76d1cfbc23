"""Changes of a scene's values by their names, such as "mu=0.5" on the command line."""

import re
from collections.abc import Iterable, Mapping
from typing import Any

from serpentail_scene.messages import did_you_mean, one_line, shown
from serpentail_scene.source import tables_in

from ..basics.checks import Refusals, refusal
from ..basics.errors import SerpentailError, SimulationError

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


def split_changes(
    changes: Any, tables: Mapping[str, Iterable[str]], error: type[SerpentailError]
) -> dict[str, dict[str, Any]]:
    """Return changes by their table and name, the rest as those of "parameters".

    tables: the first key of changes of each table; names may begin with that of the first table.
    ``error`` if changes are no mapping, or a name can be none of these.
    """
    if not isinstance(changes or {}, Mapping):
        raise refusal("changes", changes, 'new values by name, such as {"duration": 0.5}', error)
    parts: dict[str, dict[str, Any]] = {name: {} for name in (*tables, "parameters")}
    homes = {key: name for name, keys in tables.items() for key in keys}
    where = next(iter(tables))
    refused = Refusals(error)
    for given, value in (changes or {}).items():
        name = str(given).removeprefix(f"{where}.")
        first = name.split(".")[0]
        parts[homes.get(first, "parameters")][name] = value

        # no parameter is called like a key
        near = first not in homes and did_you_mean(first, homes)
        if near or (first not in homes and "." in str(given)):
            remedy = near or f"needs a parameter, or a key below [{where}]"
            refused.add(name, f"change {shown(given)}: unknown; {remedy}")
    refused.tell()
    return parts


def changed(table: Mapping, changes: Mapping) -> dict:
    """Return a copy of a table with new values by name.

    Names are such as "start.pitch", or "legs.moves.0.rate" in an array of tables, whose place may
    also be a table's own name: "phase.push.duration".
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
    tables = part if isinstance(part, list) else ()
    names = [each.get("name") for each in tables if isinstance(each, Mapping)]
    if first in names:
        first = str(names.index(first))
    in_missing_array = rest and PLACE.fullmatch(rest[0])
    if isinstance(part, Mapping) and (first in part or not in_missing_array):
        return dict(part) | {first: _with(part.get(first, {}), rest, value, name)}
    if isinstance(part, list) and PLACE.fullmatch(first) and int(first) < len(part):
        k = int(first)
        return [*part[:k], _with(part[k], rest, value, name), *part[k + 1 :]]
    needed = f"a place from 0 to {len(part) - 1}" if isinstance(part, list) else "a name in a table"
    needed += f", or one of {', '.join(map(str, names))}" if any(names) else ""
    raise SimulationError(
        f"change {shown(name)}: {shown(first)} is not in {shown(part, 70)}: needs {needed}"
    )
