"""Writes tables as the text of a scene file, in TOML."""

import json
import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from ..basics.checks import shown
from ..basics.errors import ModelError


def scene_text(tables: Mapping[str, Any]) -> str:
    """Return the text of a scene file with these tables; ModelError if TOML cannot say it."""
    try:
        text = "".join(f"{_key(name)} = {literal(name, tables[name])}\n" for name in tables)
        text.encode()
    except RecursionError:
        raise ModelError("scene: tables are nested too deeply: needs tables of numbers") from None
    except UnicodeEncodeError as error:
        raise ModelError(f"scene: a text has no UTF-8 ({error.reason}): needs letters") from None
    return text


def literal(name: str, value: Any) -> str:
    """Return a value as TOML writes it; ModelError if TOML has no such value."""
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if isinstance(value, bool | str):
        return _quoted(value)
    if isinstance(value, int) and abs(value) < 2**63:
        return str(value)
    if isinstance(value, float):
        return repr(value) if math.isfinite(value) else str(value)
    if isinstance(value, list | tuple):
        return f"[{', '.join(literal(name, each) for each in value)}]"
    if isinstance(value, Mapping):
        pairs = [f"{_key(key)} = {literal(f'{name}.{key}', value[key])}" for key in value]
        return f"{{{', '.join(pairs)}}}"
    raise ModelError(
        f"{name}: value {shown(value)}: needs a text, numbers of 64 bits, or tables of these"
    )


def _key(name: object) -> str:
    """Return the name of a key; in quotes, any text may be one."""
    return _quoted(str(name))


def _quoted(value: bool | str) -> str:
    """Return a text as JSON and TOML write it; JSON leaves DEL as it is, TOML does not take it."""
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
