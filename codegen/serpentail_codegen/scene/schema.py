"""The JSON Schema of scene files, made from the tables that scenes are checked against.

Here the tables [plan], [simulate], [identify] and [[phase]] may hold anything: the runtime knows
their keys.
"""

from collections.abc import Mapping
from typing import Any

from serpentail_scene.signatures.table import ALL
from serpentail_scene.units import MEASURES, choices, pattern, plain

from .checks import plain as as_data
from .parameters import PARAMETERS, Parameter
from .passive import PASSIVE
from .scene import COUNT, KEYS, ONLY, foreign_to
from .segment_tables import TAPER, VALUES, Key

DRAFT = "http://json-schema.org/draft-07/schema#"


def scene_schema() -> dict[str, Any]:
    """Return the schema of a whole scene file."""
    keys = {name: dict(rule.schema) for name, (_, rule) in KEYS.items()}
    keys["bend_range"] = _numbers(keys["bend_range"], "rad")
    names = {"type": "array", "items": {"enum": list(ALL)}, "uniqueItems": True, "minItems": 1}
    keys["functions"] = {"anyOf": [{"const": "all"}, names]}
    coordinates = [name for only in ONLY.values() for name in only.coordinates]
    keys["coordinates"] = {"enum": coordinates}
    keys["parameters"] = _table(
        {p.name: _parameter(p) for p in PARAMETERS}
        | {p.name: _of_each_coordinate(p) for p in PASSIVE},
        [],
    )
    of_segment = {"kind": {"enum": ["articulated", "continuum"]}, "links": dict(COUNT.schema)}
    of_segment |= {name: _key(key) for name, key in VALUES.items()}
    tables = {"type": "array", "items": _table(of_segment, []), "minItems": 1}
    keys["segments"] = {"anyOf": [dict(COUNT.schema), tables]}
    keys["taper"] = _table({name: _key(key) for name, key in TAPER.items()}, ["radii"])
    for name, (_, rule) in KEYS.items():
        keys[name] |= {"description": rule.text} if rule.text else {}
    of_kinds = [rule for kind in ONLY for rule in _of_kind(kind)]
    head = {"$schema": DRAFT, "title": "A scene of serpentail"}
    return head | _table(keys, ["kind", "segments"]) | {"allOf": of_kinds}


def _table(keys: Mapping[str, Any], required: list[str]) -> dict[str, Any]:
    """Return the schema of a table without other keys."""
    table = {"type": "object", "properties": dict(keys), "additionalProperties": False}
    return table | {"required": required}


def _of_kind(kind: str) -> list[dict[str, Any]]:
    """Return which keys a kind of tail does not have, and which it needs if its segments are
    counted.
    """
    foreign, has_not = foreign_to(kind)
    keys: dict[str, Any] = dict.fromkeys(foreign, False)
    keys["coordinates"] = {"enum": list(ONLY[kind].coordinates)}
    keys["parameters"] = {"properties": dict.fromkeys(has_not, False)}
    of_kind = {"kind": {"const": kind}}
    counted = of_kind | {"segments": {"type": "integer"}}
    return [
        {"if": {"properties": of_kind}, "then": {"properties": keys}},
        {"if": {"properties": counted}, "then": {"required": list(ONLY[kind].required)}},
    ]


def _key(key: Key) -> dict[str, Any]:
    """Return the schema of a key of a segment's table: one number, several, or several for each
    link.
    """
    one = _numbers(key.rule.schema, key.unit)
    if key.size == 1 and not key.of_links:
        return one
    return _array(one, key.unit, None if key.of_links else key.size)


def _array(one: dict[str, Any], unit: str, size: int | None) -> dict[str, Any]:
    """Return the schema of a number of values in a unit, or of any number of them."""
    bounds = {"minItems": size, "maxItems": size} if size else {"minItems": 1}
    entry = one if size else {"anyOf": [one, {"type": "array", "items": one}]}
    forms: list[dict[str, Any]] = [{"type": "array", "items": entry} | bounds]
    if plain(unit) in MEASURES:
        forms.append(_text(unit, size))
    return {"anyOf": forms}


def _parameter(parameter: Parameter) -> dict[str, Any]:
    """Return the schema of a parameter: numbers, or texts with units."""
    one = _numbers(parameter.check.schema, parameter.unit)
    meaning: dict[str, Any] = {"description": f"{parameter.meaning} ({parameter.unit})"}
    if parameter.default is not None:
        meaning["default"] = as_data(parameter.default)
    if parameter.tail in ("link", "arc"):
        return _array(one, parameter.unit, None) | meaning
    if parameter.size == 1:
        return one | meaning
    return _array(one, parameter.unit, parameter.size) | meaning


def _of_each_coordinate(parameter: Parameter) -> dict[str, Any]:
    """Return the schema of a parameter of the passive tail: one number, or one for each
    coordinate.
    """
    one = _numbers(parameter.check.schema, parameter.unit)
    forms = [one, {"type": "array", "items": one, "minItems": 2}]
    if plain(parameter.unit) in MEASURES:
        forms.append(_text(parameter.unit, None))
    return {"anyOf": forms, "description": f"{parameter.meaning} ({parameter.unit})"}


def _numbers(bounds: Mapping[str, Any], unit: str) -> dict[str, Any]:
    """Return the schema of a number in a unit, or of a text with a unit."""
    number = {"type": "number", **bounds}
    return {"anyOf": [number, _text(unit)]} if plain(unit) in MEASURES else number


def _text(unit: str, size: int | None = 1) -> dict[str, Any]:
    """Return the schema of a text of a number of values with a unit, or of any number of them."""
    return {
        "type": "string",
        "pattern": pattern(unit, "*" if size is None else f"{{{size - 1}}}"),
        "description": choices(unit),
    }
