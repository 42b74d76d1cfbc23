"""Numbers of coordinates by the names of chains and joints, in bounds and goals of plans."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from serpentail_scene.layout import Layout

from ..basics.checks import none_of
from ..basics.errors import PlanningError


def numbers_by_name(
    field: str,
    layout: Layout,
    values: Mapping[str, Any],
    usual: np.ndarray,
    read: Callable[[str, Any, int], np.ndarray],
) -> np.ndarray:
    """Return a number for each tail coordinate (nt,) from values by name; later ones win.

    A name is that of a chain, of a pair of chains, of a coordinate, or of one of a pair. usual
    (nt,): of coordinates without a name. read: (field, value, size) to numbers (size,).
    PlanningError if there is no such name.
    """
    found, places = usual.copy(), _places(layout)
    for name, value in values.items():
        if unknown := none_of(f"{field}: key", name, places):
            raise PlanningError(unknown)
        for own in places[name]:
            found[own] = read(f"{field}.{name}", value, len(own))
    return found


def _places(layout: Layout) -> dict[str, list[list[int]]]:
    """Return the coordinates that each name means, chain by chain."""
    found: dict[str, list[list[int]]] = {}
    for chain in layout.chains:
        owner, own = chain.owner or chain.name, [*range(chain.tau.start, chain.tau.stop)]
        names = {chain.name: own} | {n: [k] for n, k in zip(chain.names, own, strict=True)}
        for name, coordinates in names.items():
            for each in {name, name.replace(chain.name, owner, 1)}:
                found.setdefault(each, []).append(coordinates)
    return found
