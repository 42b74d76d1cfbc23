"""Errors about names that do not exist: they tell the nearest three."""

from collections.abc import Iterable
from difflib import SequenceMatcher
from heapq import nlargest
from typing import TYPE_CHECKING, Any


def no_attribute(whose: str, name: str, known: Iterable[str]) -> AttributeError:
    """Return the error about a name that is not among the known ones."""

    def likeness(other: str) -> float:
        return SequenceMatcher(None, name.lower()[:64], other.lower()).ratio()

    near = nlargest(3, (other for other in known if not other.startswith("_")), likeness)
    return AttributeError(f"{whose} has no attribute {name!r}: the nearest are {', '.join(near)}")


class NearNames:
    """Objects whose errors about a missing attribute tell the nearest names."""

    if not TYPE_CHECKING:  # to which each name would exist

        def __getattr__(self, name: str) -> Any:
            if name.startswith("_") or name in dir(type(self)):  # then a property raised
                return object.__getattribute__(self, name)
            raise no_attribute(f"{type(self).__name__!r} object", name, dir(self))
