"""Errors about names that do not exist: they tell the nearest three."""

from collections.abc import Iterable
from difflib import SequenceMatcher
from heapq import nlargest
from typing import TYPE_CHECKING, Any


def none_such(whose: str, name: object, known: Iterable[str]) -> str:
    """Return the line about a name that is not among the known ones."""

    def likeness(other: str) -> float:
        return SequenceMatcher(None, str(name).lower()[:64], other.lower()).ratio()

    near = nlargest(3, (other for other in known if not other.startswith("_")), likeness)
    return f"{whose} {name!r}: the nearest are {', '.join(near)}"


class NearNames:
    """Objects whose errors about a missing attribute tell the nearest names."""

    if not TYPE_CHECKING:  # to which each name would exist

        def __getattr__(self, name: str) -> Any:
            if name.startswith("_") or name in dir(type(self)):  # then a property raised
                return object.__getattribute__(self, name)
            whose, known = f"{type(self).__name__!r} object has no attribute", dir(self)
            if "parameters" in known and name in self.parameters:
                raise AttributeError(f"{whose} {name!r}: take .parameters[{name!r}]")
            if vars(self) and "__getitem__" in known and "names" in known:  # a motion, a state
                array, _ = self.names.place(name) or ("", 0)
                if array in known:
                    raise AttributeError(f"{whose} {name!r}: take [{name!r}]")
            raise AttributeError(none_such(whose, name, known))
