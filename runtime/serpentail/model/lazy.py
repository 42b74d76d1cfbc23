"""Properties that are made when they are first asked for."""

from collections.abc import Callable
from typing import Any


def lazy_property(make: Callable[[Any], Any]) -> property:
    """Return a property that is made once and kept; in a race of threads, the first one's.

    ``functools.cached_property`` of Python 3.11 has a lock for all objects of a class: a child
    forked while another thread holds it would wait for ever.
    """
    name = make.__name__

    def value(self: Any) -> Any:
        known = vars(self)
        return known[name] if name in known else known.setdefault(name, make(self))

    return property(value, doc=make.__doc__)
