"""The JSON Schema of scene files, from the tables that scenes are checked against.

The tables [plan] and [simulate] are any tables here: the runtime knows what belongs in them.
"""

from collections.abc import Mapping
from typing import Any

from .checks import plain as as_data
from .parameters import PARAMETERS, Parameter
from .scene import KEYS, ONLY
from .signatures.table import ALL
from .units import MEASURES, choices, pattern, plain

DRAFT = "http://json-schema.org/draft-07/schema#"


def scene_schema() -> dict[str, Any]:
    """Return the schema of a whole scene file."""
    keys = {name: dict(rule.schema) for name, (_, rule) in KEYS.items()}
    keys["bend_range"] = _numbers(keys["bend_range"], "rad")
    names = {"type": "array", "items": {"enum": list(ALL)}, "uniqueItems": True, "minItems": 1}
    keys["functions"] = {"anyOf": [{"const": "all"}, names]}
    coordinates = [name for only in ONLY.values() for name in only.coordinates]
    keys["coordinates"] = {"enum": coordinates}
    keys["parameters"] = _table({p.name: _parameter(p) for p in PARAMETERS}, [])
    for name, (_, rule) in KEYS.items():
        keys[name] |= {"description": rule.text} if rule.text else {}
    of_kinds = [_of_kind(kind) for kind in ONLY]
    head = {"$schema": DRAFT, "title": "A scene of serpentail"}
    return head | _table(keys, ["kind", "segments"]) | {"allOf": of_kinds}


def _table(keys: Mapping[str, Any], required: list[str]) -> dict[str, Any]:
    """Return the schema of a table that has no other keys."""
    table = {"type": "object", "properties": dict(keys), "additionalProperties": False}
    return table | {"required": required}


def _of_kind(kind: str) -> dict[str, Any]:
    """Return what a tail of a kind needs, and what it has not."""
    foreign = [key for other, only in ONLY.items() if other != kind for key in only.keys]
    has_not = [name for other, only in ONLY.items() if other != kind for name in only.parameters]
    keys: dict[str, Any] = dict.fromkeys(foreign, False)
    keys["coordinates"] = {"enum": list(ONLY[kind].coordinates)}
    keys["parameters"] = {"properties": dict.fromkeys(has_not, False)}
    then = {"required": list(ONLY[kind].required), "properties": keys}
    return {"if": {"properties": {"kind": {"const": kind}}}, "then": then}


def _parameter(parameter: Parameter) -> dict[str, Any]:
    """Return the schema of a parameter: numbers, or texts with units."""
    one = _numbers(parameter.check.schema, parameter.unit)
    meaning: dict[str, Any] = {"description": f"{parameter.meaning} ({parameter.unit})"}
    if parameter.default is not None:
        meaning["default"] = as_data(parameter.default)
    if parameter.size == 1:
        return one | meaning
    size = {"minItems": parameter.size, "maxItems": parameter.size}
    forms: list[dict[str, Any]] = [{"type": "array", "items": one} | size]
    if plain(parameter.unit) in MEASURES:
        forms.append(_text(parameter.unit, parameter.size))
    return {"anyOf": forms} | meaning


def _numbers(bounds: Mapping[str, Any], unit: str) -> dict[str, Any]:
    """Return the schema of a number in a unit, or of a text with a unit."""
    number = {"type": "number", **bounds}
    return {"anyOf": [number, _text(unit)]} if plain(unit) in MEASURES else number


def _text(unit: str, size: int = 1) -> dict[str, Any]:
    """Return the schema of a text of numbers with a unit."""
    return {
        "type": "string",
        "pattern": pattern(unit, f"{{{size - 1}}}"),
        "description": choices(unit),
    }
