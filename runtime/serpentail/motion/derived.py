"""Fields of a motion that are derived when somebody first asks for them."""

from collections.abc import Callable, Iterable, Mapping
from typing import Any, TypeVar

T = TypeVar("T")

LATER = "later"  # attribute of a motion that holds the function deriving its fields
AGAIN = "again"  # that of a run: what makes it again
# the name of a field -> this field and related ones, by name
Later = Callable[[str], dict[str, Any]]


def made(kind: type[T], fields: Mapping[str, Any], later: Later) -> T:
    """Return a motion with these fields; all others are derived later."""
    motion = object.__new__(kind)
    vars(motion).update(fields, **{LATER: later})
    return motion


def settled(motion: Any, names: Iterable[str]) -> dict[str, Any]:
    """Return the state of a motion after deriving the fields of these names."""
    state = vars(motion) | {name: getattr(motion, name) for name in names}
    return {name: value for name, value in state.items() if name not in (LATER, AGAIN)}


class Derived:
    """A field that its motion derives once and keeps: if threads race, the first one's values."""

    def __init__(self, name: str):
        self.name = name

    def __get__(self, motion: Any, owner: type | None = None) -> Any:
        known = {} if motion is None else vars(motion)
        if LATER not in known:
            raise AttributeError(f"no {self.name!r}: it was not given")
        for name, value in known[LATER](self.name).items():
            known.setdefault(name, value)
        return known[self.name]
