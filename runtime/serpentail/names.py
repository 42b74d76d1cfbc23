"""Names: one that was given, and those that are known, go in; an error with the nearest comes out where it is none."""

from collections.abc import Collection
from difflib import get_close_matches


def known(field: str, value, names: Collection[str], error: type[Exception]) -> None:
    """Raise ``error``, with the nearest of the names, where a value is none of them."""
    if not isinstance(value, str) or value not in names:
        near = get_close_matches(value, names, 1) if isinstance(value, str) else []
        remedy = f"did you mean {near[0]!r}?" if near else f"needs {' or '.join(map(repr, names))}"
        raise error(f"{field}: value {value!r}: {remedy}")
