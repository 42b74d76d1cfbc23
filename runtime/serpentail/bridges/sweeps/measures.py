"""The units of what a sweep goes over: of parameters, and of keys of scenes."""

from collections.abc import Collection, Mapping, Sequence
from typing import Any

from serpentail_scene.keys import Key

Units = dict[str, str | Sequence[str] | None]  # by name; None: any unit, in SI


def units_of(manifest: Mapping[str, Any], names: Collection[str]) -> Units:
    """Return the units of those names that are parameters of a model."""
    known = {entry["name"]: entry["unit"] for entry in manifest["parameters"]}
    return {name: known[name] for name in names if name in known}


def unit_at(key: Key, name: str) -> str | Sequence[str]:
    """Return the unit of a name such as "start.pitch" below a table's key; "" where it has none."""
    for part in name.split("."):
        if part.isdecimal():
            key = key.each or key  # a table in an array, or a number in one
            continue
        tables = [key, *key.kinds.values()]
        key = next((each.keys[part] for each in tables if part in each.keys), Key())
    return key.unit
