"""Reads the tables of a scene by their keys, with all numbers in the keys' units."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from serpentail_scene.keys import Key
from serpentail_scene.units import dimensions, in_unit

from ..basics.checks import Refusals, needed, none_of, shown
from ..basics.plausible_values import warn_of_unusual

SWEEP = Key(  # of a scene's table [sweep]
    keys={
        "run": Key(form={"enum": ["simulate", "plan", "identify"]}),
        "over": Key(form={"type": "object"}),
        "points": Key(form={"type": "integer", "minimum": 1}),
        "seed": Key(form={"type": "integer", "minimum": 0}),
        "outputs": Key(form={"type": "array", "items": {"type": "string"}}),
        "limit": Key(form={"type": "number", "exclusiveMinimum": 0}),
        "store": Key(form={"type": "string"}),
    },
    needs=("over",),
)


def read(table: Mapping, key: Key, where: str, refused: Refusals, part: str = "") -> dict:
    """Return a table with all numbers in the units of their keys; refuse unknown keys.

    part: the part to which errors belong; by default the key of this table.
    """
    found = {}
    for name, value in table.items():
        belongs, unknown = part or name, none_of(f"{where}: key", name, key.keys)
        if unknown:
            refused.add(belongs, unknown)
        else:
            found[name] = _read(value, key.keys[name], f"{where}.{name}", (refused, belongs))
    return found


TYPES: Mapping[Any, tuple[Any, str]] = {  # of a form: in Python, and in words
    "boolean": (bool, "true or false, without quotes"),
    "integer": (int, "a whole number"),
    "number": (int | float, "a number"),
    "string": (str, 'a text, in "quotes"'),
    "array": (list, "a list"),
    "object": (Mapping, "a table"),
}
Part = tuple[
    Refusals, str
]  # where errors about a value are collected, and the part that they belong to


def _read(value: Any, key: Key, where: str, part: Part) -> Any:
    """Return a value with all numbers in the units of their keys."""
    if isinstance(value, str) and value in key.words:
        return value
    if key.each and isinstance(value, list):
        return [_read(x, key.each, f"{where}[{k}]", part) for k, x in enumerate(value)]
    if key.named and isinstance(value, Mapping):
        return {n: _read(x, key.named, f"{where}.{n}", part) for n, x in value.items()}
    if isinstance(value, Mapping) and not key.form:
        return _read_table(value, key, where, part)
    if key.is_table and key.each is None:
        needs = ", or ".join([f"a table, under a line [{where}]", *map(repr, key.words)])
        part[0].add(part[1], needed(where, value, needs))
    if key.unit:
        return _read_numbers(value, key, where, part)
    types, needs = TYPES.get(key.form.get("type"), (object, ""))
    if not isinstance(value, types) or (isinstance(value, bool) and types not in (bool, object)):
        part[0].add(part[1], needed(where, value, needs))
    return value


def _read_table(table: Mapping, key: Key, where: str, part: Part) -> Mapping:
    """Return a table with numbers in the units of its keys; unchanged if its kind is unknown."""
    kind = table.get("kind")
    if key.kinds:
        key = key.kinds.get(kind, Key()) if isinstance(kind, str) else Key()
    return read(table, key, where, *part) if key.keys else table


def _read_numbers(value: Any, key: Key, where: str, part: Part) -> Any:
    """Return numbers in the unit of their key."""
    refused, name = part
    try:
        numbers = in_unit(value, key.unit)
    except ValueError as error:
        refused.add(name, f"{where}: value {shown(value)}: {error}")
        return value
    if key.usual:
        warn_of_unusual(where, numbers, key.unit)
    return numbers


def sized(value: Any, key: Key, size: Mapping[str, float]) -> Any:
    """Return the value of a key with all numbers scaled to the size of a body.

    size: factors of each "kg", "m" and "s", as in a manifest; empty: 1.
    """
    if not size:
        return value
    if key.named and isinstance(value, Mapping):
        return {n: sized(x, key.named, size) for n, x in value.items()}
    if isinstance(value, Mapping):
        key = key.kinds.get(value.get("kind", ""), key)
        return {k: sized(x, key.keys[k], size) if k in key.keys else x for k, x in value.items()}
    if key.each and isinstance(value, list):
        return [sized(x, key.each, size) for x in value]
    return _in_size(value, key.unit, size) if key.unit else value


def _in_size(value: Any, unit: str | Sequence[str], size: Mapping[str, float]) -> Any:
    """Return numbers of a unit, or of one each, in the size of a body."""
    if isinstance(value, list | tuple):
        units = [unit] if isinstance(unit, str) else unit
        each = [units[min(k, len(units) - 1)] for k in range(len(value))]
        return [_in_size(x, u, size) for x, u in zip(value, each, strict=True)]
    if isinstance(value, bool) or not isinstance(value, int | float):
        return value
    powers = zip(
        ("kg", "m", "s"), dimensions(unit if isinstance(unit, str) else unit[0]), strict=True
    )
    return value * math.prod(size[base] ** power for base, power in powers)
