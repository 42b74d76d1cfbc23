"""Which rows of an earlier sweep are rows of a new one: more samples, or other values in a grid."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from .shards import Shard


class Mapped:
    """The numbers that points of an old sweep have in a new one, from what is told of both.

    Each tells of its "grids" ([names, values] each), "spreads", "points", "seed", of the "models"
    and of the dimensions "varied" whose places, raveled, tell a point's model.
    """

    def __init__(self, old: Mapping[str, Any], new: Mapping[str, Any]):
        self.old, self.new = old, new
        self.old_sizes, self.new_sizes = _sizes(old), _sizes(new)
        self.old_total = int(np.prod(self.old_sizes))
        names = [tuple(names) for names, _ in old["grids"]]
        self.steps: list[tuple[int, np.ndarray]] = []  # for each new axis: the old one, places
        wanted = [tuple(names) for names, _ in new["grids"]]
        self.possible = sorted(names) == sorted(wanted) and _same_draws(old, new)
        if not self.possible:
            return
        for key, (_, values) in zip(wanted, new["grids"], strict=True):
            k = names.index(key)
            places = {value: place for place, value in enumerate(values)}
            self.steps.append((k, np.array([places.get(x, -1) for x in old["grids"][k][1]])))
        if new["spreads"]:
            both = np.arange(old["points"])
            self.steps.append((len(names), np.where(both < new["points"], both, -1)))

    def __call__(self, shard: Shard) -> np.ndarray:
        """Return the new numbers of a shard's rows; -1 for those that have none."""
        rows = shard.numbers()
        numbers = np.arange(rows.start, rows.stop) if isinstance(rows, slice) else rows
        lost = np.full(len(numbers), -1)
        if not self.possible:
            return lost
        olds = np.unravel_index(numbers, self.old_sizes)
        news = [places[olds[k]] for k, places in self.steps]
        there = np.all([each >= 0 for each in news], axis=0)
        clipped = tuple(np.maximum(each, 0) for each in news)
        same = _models(self.old, olds) == _models(self.new, clipped)
        return np.where(there & same, np.ravel_multi_index(clipped, self.new_sizes), lost)


def _same_draws(old: Mapping[str, Any], new: Mapping[str, Any]) -> bool:
    """Tell if equal places among the samples of both have equal numbers."""
    names = ("spreads", "seed") if new["spreads"] else ("spreads",)
    latin = any(way == "latin" for _, (way, *_) in new["spreads"])
    return all(old[name] == new[name] for name in (*names, *(["points"] if latin else [])))


def _sizes(told: Mapping[str, Any]) -> tuple[int, ...]:
    grids = (len(values) for _, values in told["grids"])
    return (*grids, told["points"]) if told["spreads"] else tuple(grids)


def _models(told: Mapping[str, Any], places: tuple) -> np.ndarray:
    """Return the models at places on the axes."""
    models = np.array(told["models"])
    varied = told["varied"]
    if not varied:
        return np.broadcast_to(models[0], len(places[0]))
    sizes = _sizes(told)
    own = [places[k] for k in varied]
    return models[np.ravel_multi_index(tuple(own), [sizes[k] for k in varied])]
