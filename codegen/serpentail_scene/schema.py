"""The JSON Schema of scene files, made from the tables that scenes are checked against."""

from collections.abc import Mapping, Sequence
from typing import Any

from .drives import DRIVE
from .keys import (
    BODY,
    CHAIN,
    JOINT,
    JOINT_WORDS,
    KEYS,
    KINDS,
    ONLY,
    SEGMENT,
    SLOPE,
    TAPER,
    TENDON,
    TENDON_COUNTS,
    TORSOS,
    Key,
    foreign_to,
    one_word,
)
from .parameters import NAMED, Parameter, key_in_chain
from .purposes import ADDED
from .rules import COUNT, FLAG
from .signatures.table import ALL
from .units import MEASURES, choices, pattern, plain

DRAFT = "http://json-schema.org/draft-07/schema#"
Schema = dict[str, Any]


def scene_schema(verbs: Mapping[str, Key]) -> Schema:
    """Return the schema of a whole scene file; verbs: the keys of tables such as [simulate]."""
    keys: dict[str, Schema] = {name: dict(key.rule.schema) for name, key in KEYS.items()}
    keys["bend_range"] = _number(keys["bend_range"], ["rad"])
    listed = {"type": "array", "uniqueItems": True, "minItems": 1}
    sorts = [list(ALL), [f"{ADDED}{name}" for name in ALL]]
    arrays = [listed | {"items": {"enum": names}} for names in sorts]
    keys["functions"] = {"anyOf": [{"const": "all"}, *arrays]}
    keys["coordinates"] = {"enum": [name for kind in KINDS for name in ONLY[kind].coordinates]}
    keys["parameters"] = _table({p.name: _parameter(p) for p in NAMED})
    of_segment: Schema = {"kind": {"enum": ["articulated", "continuum"]}, "links": COUNT.schema}
    of_segment |= {name: key_schema(key) for name, key in SEGMENT.items()}
    tables = {"type": "array", "items": _table(of_segment), "minItems": 1}
    keys["segments"] = {"anyOf": [COUNT.schema, tables]}
    keys["slope"] = key_schema(Key(keys=SLOPE, needs=tuple(SLOPE)))
    keys["taper"] = key_schema(Key(keys=TAPER, needs=("radii",)))
    torsos = {
        shape: Key(keys={"shape": one_word(shape), **lengths}, needs=("shape", *lengths))
        for shape, lengths in TORSOS.items()
    }
    keys["body"] = key_schema(Key(keys={**BODY, "torso": Key(kinds=torsos)}))
    of_chain: Schema = {name: keys[name] for name in CHAIN if name in keys}
    of_chain |= {"on": {"const": "torso"}, "pair": dict(FLAG.schema)}
    of_chain |= {key_in_chain(p.name): _parameter(p) for p in NAMED if p.of_chain}
    of_chain["kind"] = {"enum": [*KINDS, "limb"]}
    joint = Key(keys=JOINT | JOINT_WORDS | {"name": Key(form=KEYS["name"].rule.schema)})
    of_chain |= {"joints": key_schema(Key(each=joint)), "drive": DRIVE.schema}
    of_tendon = {name: key_schema(key) for name, key in TENDON.items()}
    of_tendon |= {name: dict(COUNT.schema) for name in TENDON_COUNTS}
    keys["tendon"] = {"type": "object", "additionalProperties": _table(of_tendon, ["tension"])}
    needed = ["kind", "mount"]
    keys["chain"] = {"type": "object", "additionalProperties": _table(of_chain, needed)}
    for name, key in KEYS.items():
        keys[name] |= {"description": key.rule.text} if key.rule.text else {}
    for name, verb in verbs.items():
        keys[name] |= key_schema(verb)
    of_kinds = [rule for kind in KINDS for rule in _of_kind(kind)]
    head = {"$schema": DRAFT, "title": "A scene of serpentail"}
    return head | _table(keys, ["kind", "segments"]) | {"allOf": of_kinds}


def key_schema(key: Key) -> Schema:
    """Return the schema of a key's values."""
    forms: list[Schema] = [{"enum": list(key.words)}] if key.words else []
    if key.form:
        forms.append(dict(key.form))
    if key.unit:
        forms += _numbers(key)
    for entry in ([key] if key.keys else []) + [*key.kinds.values()]:
        forms.append(_table({n: key_schema(each) for n, each in entry.keys.items()}, entry.needs))
    if key.each is not None:
        forms.append({"type": "array", "items": key_schema(key.each)})
    if key.named is not None:
        forms.append({"type": "object", "additionalProperties": key_schema(key.named)})
    return _any_of(forms)


def _any_of(forms: list[Schema]) -> Schema:
    return forms[0] if len(forms) == 1 else {"anyOf": forms}


def _table(keys: Mapping[str, Any], needs: Sequence[str] = ()) -> Schema:
    """Return the schema of a table that has no other keys."""
    table = {"type": "object", "properties": dict(keys), "additionalProperties": False}
    return table | {"required": list(needs)}


def _numbers(key: Key) -> list[Schema]:
    """Return the schemas of numbers, of texts with units, and of arrays of both."""
    units = [key.unit] if isinstance(key.unit, str) else list(dict.fromkeys(key.unit))
    if key.size > 1 or key.each_link:
        return _array(key.rule.schema, units, None if key.each_link else key.size)
    forms = [{"type": "number", **key.rule.schema}, *_texts(units, None if key.depth else 1)]
    inner = [*forms, *([{"enum": list(key.words)}] if key.words else [])]
    for _ in range(key.depth):
        array = {"type": "array", "items": {"anyOf": inner}}
        forms.append(array)
        inner = [*inner, array]
    return forms


def _number(limits: Mapping[str, Any], units: Sequence[str]) -> Schema:
    """Return the schema of a number within limits, or of a text with a unit."""
    return _any_of([{"type": "number", **limits}, *_texts(units, 1)])


def _array(limits: Mapping[str, Any], units: Sequence[str], size: int | None) -> list[Schema]:
    """Return the schemas of a number of values, or of some for each link."""
    one = _number(limits, units)
    entry = one if size else {"anyOf": [one, {"type": "array", "items": one}]}
    bounds = {"minItems": size, "maxItems": size} if size else {"minItems": 1}
    return [{"type": "array", "items": entry} | bounds, *_texts(units, size)]


def _texts(units: Sequence[str], size: int | None) -> list[Schema]:
    """Return the schemas of texts of so many values with a unit; None: of any number of them."""
    others = "*" if size is None else f"{{{size - 1}}}"
    return [
        {"type": "string", "pattern": pattern(unit, others), "description": choices(unit)}
        for unit in units
        if plain(unit) in MEASURES
    ]


def _parameter(parameter: Parameter) -> Schema:
    """Return the schema of a parameter, with its meaning and its default."""
    limits, units = parameter.rule.schema, [parameter.unit]
    if not parameter.size:  # one number for all tail coordinates or pieces, or one for each
        one = _number(limits, units)
        each = {"type": "array", "items": one, "minItems": 2}
        forms = [one, each, *_texts(units, None)]
    else:
        key = Key(parameter.unit, parameter.rule, parameter.size, parameter.of_pieces)
        forms = _numbers(key)
    default = parameter.default
    meaning: Schema = {"description": f"{parameter.meaning} ({parameter.unit})"}
    if default is not None and parameter.size:
        meaning["default"] = list(default) if isinstance(default, tuple) else default
    return _any_of(forms) | meaning


def _of_kind(kind: str) -> list[Schema]:
    """Return which keys a kind of tail does not have, and which it needs if its segments are
    counted.
    """
    foreign, foreign_parameters = foreign_to(kind)
    keys: Schema = dict.fromkeys(foreign, False)
    keys["coordinates"] = {"enum": list(ONLY[kind].coordinates)}
    keys["parameters"] = {"properties": dict.fromkeys(foreign_parameters, False)}
    of_kind = {"kind": {"const": kind}}
    counted = of_kind | {"segments": {"type": "integer"}}
    return [
        {"if": {"properties": of_kind}, "then": {"properties": keys}},
        {"if": {"properties": counted}, "then": {"required": list(ONLY[kind].required)}},
    ]
