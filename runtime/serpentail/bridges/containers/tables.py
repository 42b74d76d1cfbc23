"""Motions as tables of one row a sample: of pandas, and as CSV files."""

import os
from itertools import chain, product
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ...basics.extras import needed
from ...basics.files import write_csv
from .contents import Contents, Variable

if TYPE_CHECKING:
    import pandas

BARE = ("q", "v")  # whose labels are names enough
Column = tuple[str, np.ndarray]  # its unit, and its numbers (rows,)


def columns(held: Contents) -> dict[str, Column]:
    """Return the columns, by names such as z, tau_alpha_1, forces_tail_1_x.

    Values with one number for each run, and none for samples, are left out.
    """
    found: dict[str, Column] = {}
    for name, variable in held.variables.items():
        if "time" in variable.dims:
            found |= _columns(name, variable, held)
    return found


def _columns(name: str, variable: Variable, held: Contents) -> dict[str, Column]:
    """The columns of one variable."""
    others = variable.dims[len(held.leading) :]
    names = list(product(*(held.labels[dim] for dim in others)))
    rows = variable.values.reshape(-1, len(names))
    units = [variable.units] * len(names) if isinstance(variable.units, str) else variable.units
    prefix = () if name in BARE else (name,)
    return {
        "_".join((*prefix, *labels)): (unit, rows[:, k])
        for k, (labels, unit) in enumerate(zip(names, units, strict=True))
    }


def frame(held: Contents) -> "pandas.DataFrame":
    """Return the table, its index time or (run, time); ``attrs["units"]`` has the units.

    ExtraMissing without pandas.
    """
    pandas = needed("pandas", "pandas")
    index = pandas.MultiIndex.from_product(
        [held.labels[name] for name in held.leading], names=list(held.leading)
    )
    found = columns(held)
    if len(held.leading) == 1:
        index = pandas.Index(held.labels["time"], name="time")
    table = pandas.DataFrame({name: numbers for name, (_, numbers) in found.items()}, index=index)
    table.attrs["units"] = {"time": "s"} | {name: unit for name, (unit, _) in found.items()}
    return table


def write(held: Contents, path: str | os.PathLike[str]) -> Path:
    """Write a CSV file, whole or not at all, and return its path.

    NotWritten if it cannot be written. Its header has names and units, such as "time [s]"; numbers
    have all their digits.
    """
    found = columns(held)
    heads = {"run": "run", "time": "time [s]"}
    header = [heads[name] for name in held.leading]
    header += [f"{name} [{unit}]" for name, (unit, _) in found.items()]
    places = product(*(np.asarray(held.labels[name]).tolist() for name in held.leading))
    rows = np.stack([numbers for _, numbers in found.values()], axis=1)
    lines = ((*place, *row.tolist()) for place, row in zip(places, rows, strict=True))
    return write_csv(path, chain([header], lines))
