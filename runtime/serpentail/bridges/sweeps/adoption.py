"""Which rows of an earlier sweep are rows of a new one: more samples, or other values in a grid."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np


def adopted_numbers(
    old: Mapping[str, Any], new: Mapping[str, Any]
) -> tuple[int, Callable[[np.ndarray], np.ndarray]]:
    """Return how many points an old sweep has, and what finds their numbers in a new one.

    It returns -1 for points that the new sweep does not have. Both sweeps are told by their "spec",
    see ``pose``.
    """
    old_sizes, new_sizes = _sizes(old), _sizes(new)
    old_models, new_models = (
        np.broadcast_to(np.array(spec["models"]), sizes)
        for spec, sizes in ((old, old_sizes), (new, new_sizes))
    )
    old_axes = {tuple(names): k for k, (names, _) in enumerate(old["grids"])}
    possible = {tuple(names) for names, _ in new["grids"]} == old_axes.keys()
    possible = possible and all(old[name] == new[name] for name in _same(new))

    # for each new axis: which old one it was, and the new place of each old place
    axes = []
    for names, rows in new["grids"] if possible else ():
        k = old_axes[tuple(names)]
        places = {row: place for place, row in enumerate(rows)}
        axes.append((k, np.array([places.get(row, -1) for row in old["grids"][k][1]])))
    if new["spreads"]:
        samples = np.arange(old["points"])
        axes.append((-1, np.where(samples < new["points"], samples, -1)))

    def numbers_in_new(numbers: np.ndarray) -> np.ndarray:
        if not possible:
            return np.full(len(numbers), -1)
        places = np.unravel_index(numbers, old_sizes)
        moved = [new_places[places[k]] for k, new_places in axes]
        inside = tuple(np.maximum(x, 0) for x in moved)
        there = np.all([x >= 0 for x in moved], axis=0)
        there &= old_models[places] == new_models[inside]
        return np.where(there, np.ravel_multi_index(inside, new_sizes), -1)

    return int(np.prod(old_sizes)), numbers_in_new


def _sizes(spec: Mapping[str, Any]) -> tuple[int, ...]:
    """Return how many places each axis has."""
    grids = tuple(len(rows) for _, rows in spec["grids"])
    return (*grids, spec["points"]) if spec["spreads"] else grids


def _same(spec: Mapping[str, Any]) -> list[str]:
    """Return what another sweep must have equal so that equal samples have equal numbers."""
    names = ["spreads", "seed"] if spec["spreads"] else ["spreads"]
    latin = any(kind == "latin" for _, (kind, *_) in spec["spreads"])
    return [*names, "points"] if latin else names
