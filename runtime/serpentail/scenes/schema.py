"""The JSON Schema of scene files: the generator's, with the runtime's tables."""

import json
import subprocess
from typing import Any

from serpentail_scene.units import MEASURES, choices, pattern, plain

from ..building.generator import command
from .identify_keys import IDENTIFY
from .keys import Key
from .phase_keys import PHASES
from .plan_keys import PLAN
from .simulate_keys import SIMULATE
from .sweep_keys import SWEEP


def scene_schema() -> dict[str, Any]:
    """Return the schema of scene files; ModelError if the generator is not installed."""
    said = subprocess.run(
        [*command(), "--schema"], capture_output=True, text=True, check=True
    ).stdout
    schema: dict[str, Any] = json.loads(said)
    tables = {
        "simulate": SIMULATE,
        "phase": PHASES,
        "plan": PLAN,
        "identify": IDENTIFY,
        "sweep": SWEEP,
    }
    for name, key in tables.items():
        schema["properties"][name] |= key_schema(key)
    return schema


def key_schema(key: Key) -> dict[str, Any]:
    """Return the schema of a key's values."""
    forms: list[dict[str, Any]] = [{"enum": list(key.words)}] if key.words else []
    if key.form:
        forms.append(dict(key.form))
    if key.unit:
        forms += _numbers(key)
    if key.keys:
        forms.append(_table(key))
    forms += [_table(each) for each in key.kinds.values()]
    if key.each is not None:
        forms.append({"type": "array", "items": key_schema(key.each)})
    return forms[0] if len(forms) == 1 else {"anyOf": forms}


def _table(key: Key) -> dict[str, Any]:
    """Return the schema of a table that has no other keys."""
    keys = {name: key_schema(entry) for name, entry in key.keys.items()}
    table = {"type": "object", "properties": keys, "additionalProperties": False}
    return table | {"required": list(key.needs)}


def _numbers(key: Key) -> list[dict[str, Any]]:
    """Return the schemas of a number, of texts with units, and of arrays of both."""
    units = dict.fromkeys([key.unit] if isinstance(key.unit, str) else key.unit)
    one: list[dict[str, Any]] = [{"type": "number"}]
    for unit in units:
        if plain(unit) in MEASURES:
            text = pattern(unit, "*" if key.depth else "{0}")
            one.append({"type": "string", "pattern": text, "description": choices(unit)})
    forms, inner = list(one), [*one, *([{"enum": list(key.words)}] if key.words else [])]
    for _ in range(key.depth):
        array = {"type": "array", "items": {"anyOf": inner}}
        forms.append(array)
        inner = [*inner, array]
    return forms
