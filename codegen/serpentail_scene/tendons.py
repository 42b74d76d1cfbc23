"""The names of tendons: a table `[tendon.NAME]` is one, or a ring of several."""

from collections.abc import Mapping
from typing import Any


def names_of_tendons(tables: Mapping[str, Any]) -> list[str]:
    """Return the name of each tendon of checked tables; a ring numbers its own from 1."""
    return [
        f"{name}_{k + 1}" if "count" in table else name
        for name, table in tables.items()
        for k in range(table.get("count", 1))
    ]
