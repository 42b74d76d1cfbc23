"""Errors about names that do not exist: they tell the nearest three."""

from collections.abc import Iterable
from difflib import SequenceMatcher
from heapq import nlargest
from typing import TYPE_CHECKING, Any


def nearest_three(name: str, known: Iterable[str]) -> str:
    """Return the three known names that are most like one."""

    def likeness(other: str) -> float:
        return SequenceMatcher(None, name.lower()[:64], other.lower()).ratio()

    near = nlargest(3, (other for other in known if not other.startswith("_")), likeness)
    return f"the nearest are {', '.join(near)}"


def no_attribute(whose: str, name: str, known: Iterable[str]) -> AttributeError:
    """Return the error about a name that is not among the known ones."""
    return AttributeError(f"{whose} has no attribute {name!r}: {nearest_three(name, known)}")


class NearNames:
    """Objects whose errors about a missing attribute tell the nearest names."""

    if not TYPE_CHECKING:  # to which each name would exist

        def __getattr__(self, name: str) -> Any:
            if name.startswith("_") or name in dir(type(self)):  # then a property raised
                return object.__getattribute__(self, name)
            whose, known = f"{type(self).__name__!r} object", dir(self)
            if "parameters" in known and name in self.parameters:
                raise AttributeError(f"{whose} has no {name!r}: take .parameters[{name!r}]")
            if vars(self) and "__getitem__" in known and "names" in known:  # a motion, a state
                array, _ = self.names.place(name) or ("", 0)
                if array in known:
                    raise AttributeError(f"{whose} has no {name!r}: take [{name!r}]")
            raise no_attribute(whose, name, known)
