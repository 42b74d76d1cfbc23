"""The sweep that a scene file's table [sweep] asks for."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ...basics.checks import Refusals, none_of, refusal
from ...basics.errors import SweepError
from ...scenes.file import read_scene, subtable
from ...scenes.keys import SWEEP, read
from .axis import Grid, Spread, grid, latin, random, sobol
from .runs import RUNS

SPREADS = {"random": random, "latin": latin, "sobol": sobol}


def arguments_of(path: str) -> dict[str, Any]:
    """Return the arguments of ``sweep`` from the table [sweep] of a scene file.

    By default its store is next to the file. SweepError has a line for each wrong key.
    """
    tables, place = read_scene(path, SweepError)
    table = subtable(tables, "sweep", place, SweepError)
    refused = Refusals(SweepError)
    table = read(table, SWEEP, "sweep", refused)
    run = table.get("run", "simulate")
    wrong = none_of("sweep.run", run, RUNS)
    if wrong:
        refused.add("run", f"{wrong}; programs can run functions, by serpentail.sweep")
    over = table.get("over")
    if not isinstance(over, Mapping) or not over:
        refused.add("over", "sweep.over: needs a table of axes, under a line [sweep.over]")
        over = {}
    axes = {
        name: refused.attempt(f"over.{name}", axis_of, f"sweep.over.{name}", axis)
        for name, axis in over.items()
    }
    refused.tell()
    store = place.parent / table.get("store", f"{place.stem}.rows")
    others = {name: table[name] for name in ("points", "seed", "outputs", "limit") if name in table}
    return {"model": str(place), "over": axes, "run": run, "store": Path(store)} | others


def axis_of(where: str, value: Any) -> Grid | Spread:
    """Return an axis of a table: {grid = [...]}, {random = [low, high]} and so on, or a list."""
    if isinstance(value, list):
        return grid(value)
    if not isinstance(value, Mapping):
        raise refusal(
            where, value, "a list of values, or a table such as {random = [0, 1]}", SweepError
        )
    kinds = [name for name in value if name != "law"]
    if len(kinds) != 1 or kinds[0] not in ("grid", *SPREADS):
        raise refusal(where, dict(value), "one of grid, random, latin and sobol", SweepError)
    (kind,) = kinds
    if kind == "grid":
        return grid(value[kind])
    bounds = value[kind]
    if not isinstance(bounds, list) or len(bounds) != 2:
        raise refusal(f"{where}.{kind}", bounds, "two bounds, [low, high]", SweepError)
    low, high = bounds
    return SPREADS[kind](low, high, value.get("law", "uniform"))
