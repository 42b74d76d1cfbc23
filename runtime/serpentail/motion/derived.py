"""Fields of a motion that are derived when somebody first asks for them."""

from collections.abc import Callable
from typing import Any

LATER = "later"  # what derives them, in a motion that has it
# the name of a field -> that one, and what else comes with it, by name
Later = Callable[[str], dict[str, Any]]


class Derived:
    """A field that its motion derives once and keeps; where it was given, this is not asked.

    In a race of threads the first one's values stay.
    """

    def __init__(self, name: str):
        self.name = name

    def __get__(self, motion: Any, owner: type | None = None) -> Any:
        known = {} if motion is None else vars(motion)
        if LATER not in known:
            raise AttributeError(f"no {self.name!r}: it was not given")
        for name, value in known[LATER](self.name).items():
            known.setdefault(name, value)
        return known[self.name]
