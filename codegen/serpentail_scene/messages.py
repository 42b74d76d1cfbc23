"""What messages about values say: the value on one line, and the name that may have been meant."""

from collections.abc import Collection
from difflib import get_close_matches

# Names that other software and the paper use for the same things: suggested, never accepted.
ALIASES = {
    "crba": "mass_matrix",
    "nle": "bias_force",
    "rnea": "inverse_dynamics",
    "aba": "forward_dynamics",
    "m": "segments",
    "n": "links",
    "tail": "kind",
}


def nearest(value: object, names: Collection[str]) -> str:
    """Return the nearest name; "" if no name is near."""
    text = value[:64] if isinstance(value, str) else ""
    alias = ALIASES.get(text.lower(), "")
    near = [alias] if alias in names else get_close_matches(text, names, 1)
    near = near or get_close_matches(text.lower(), names, 1)
    return near[0] if near else ""


def did_you_mean(value: object, names: Collection[str]) -> str:
    """Return a question with the nearest name; "" if no name is near."""
    near = nearest(value, names)
    return f"did you mean {near!r}?" if near else ""


def shown(value: object, most: int = 200) -> str:
    """Return a value as Python writes it, on one line and shortened if it is long."""
    try:
        text = repr(value)
    except (ValueError, RecursionError):  # repr refuses integers of more than 4300 digits
        return f"of type {type(value).__name__}, too long to show"
    return one_line(text, most)


def one_line(text: str, most: int = 200) -> str:
    """Return a text on one line of at most ``most`` characters."""
    line = text
    if not text.isprintable():
        line = "".join(x if x.isprintable() else repr(x)[1:-1] for x in " ".join(text.split()))
    return line if len(line) <= most else line[: most - 3] + "..."
