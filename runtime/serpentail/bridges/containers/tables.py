"""Motions as datasets of xarray, as tables of one row a sample, and as files for other programs."""

import os
from itertools import chain, product
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ...basics.extras import needed
from ...basics.files import write_csv, write_netcdf
from ...motion.trajectory import Trajectory
from ...simulation.rollouts import Rollouts
from .contents import Contents, Quantity, contents

if TYPE_CHECKING:
    import pandas
    import xarray

BARE = ("q", "v")  # whose labels are names enough
WRITERS = {".npz": "save", ".csv": "to_csv", ".nc": "to_netcdf"}
Column = tuple[str, np.ndarray]  # its unit, and its numbers (rows,)


def dataset(motion: Trajectory | Rollouts) -> "xarray.Dataset":
    """Return the dataset; ExtraMissing without xarray."""
    xarray, content = needed("xarray", "xarray"), contents(motion)
    coordinates: dict[str, Any] = {
        name: (name, list(each)) for name, each in content.labels.items()
    }
    coordinates["time"] = ("time", content.labels["time"], {"units": "s", "long_name": "time"})
    if content.groups:
        coordinates["group"] = ("point", list(content.groups))
    variables = {}
    for name, quantity in content.quantities.items():
        units = {"units": quantity.unit} if quantity.unit else {}
        attributes = units | {"long_name": quantity.words}
        variables[name] = (quantity.dims, quantity.values, attributes)
        if not isinstance(quantity.units, str):
            last = quantity.dims[-1]
            coordinates[f"{last}_units"] = (last, list(quantity.units))
    return xarray.Dataset(variables, coordinates, content.facts)


def write_dataset(motion: Trajectory | Rollouts, path: str | os.PathLike[str]) -> Path:
    """Write a NetCDF file, whole or not at all, and return its path.

    ExtraMissing without xarray, NotWritten if it cannot be written.
    """
    return write_netcdf(path, dataset(motion))


def frame(motion: Trajectory | Rollouts) -> "pandas.DataFrame":
    """Return the table of pandas, indexed by time or (run, time); ``attrs["units"]``: its units."""
    pandas, content = needed("pandas", "pandas"), contents(motion)
    index = pandas.Index(content.labels["time"], name="time")
    if len(content.leading) > 1:
        labels = [content.labels[name] for name in content.leading]
        index = pandas.MultiIndex.from_product(labels, names=list(content.leading))
    columns = _columns(content)
    table = pandas.DataFrame({name: rows for name, (_, rows) in columns.items()}, index=index)
    table.attrs["units"] = {"time": "s"} | {name: unit for name, (unit, _) in columns.items()}
    return table


def write_table(motion: Trajectory | Rollouts, path: str | os.PathLike[str]) -> Path:
    """Write a CSV file, whole or not at all, and return its path.

    NotWritten if it cannot be written. Its header has names and units, such as "time [s]"; numbers
    have all their digits.
    """
    content = contents(motion)
    columns, heads = _columns(content), {"run": "run", "time": "time [s]"}
    header = [heads[name] for name in content.leading]
    header += [f"{name} [{unit}]" for name, (unit, _) in columns.items()]
    places = product(*(np.asarray(content.labels[name]).tolist() for name in content.leading))
    rows = np.stack([numbers for _, numbers in columns.values()], axis=1)
    lines = ((*place, *row.tolist()) for place, row in zip(places, rows, strict=True))
    return write_csv(path, chain([header], lines))


def _columns(content: Contents) -> dict[str, Column]:
    """The columns of what is sampled, by names such as z, tau_alpha_1, forces_tail_1_x."""
    columns: dict[str, Column] = {}
    for name, quantity in content.quantities.items():
        if "time" in quantity.dims:
            columns |= _columns_of(name, quantity, content)
    return columns


def _columns_of(name: str, quantity: Quantity, content: Contents) -> dict[str, Column]:
    """The columns of one quantity."""
    others = quantity.dims[len(content.leading) :]
    places = list(product(*(content.labels[dim] for dim in others)))
    rows = quantity.values.reshape(-1, len(places))
    units = quantity.units
    each = [units] * len(places) if isinstance(units, str) else units
    prefix = () if name in BARE else (name,)
    return {
        "_".join((*prefix, *labels)): (unit, rows[:, k])
        for k, (labels, unit) in enumerate(zip(places, each, strict=True))
    }


def checked(path: str) -> Path:
    """Return the path of a file for a motion, with .npz if it has no suffix.

    ValueError if the suffix is unknown, OSError if it is a folder, ExtraMissing if the library for
    it is not installed.
    """
    target = Path(path)
    if target.is_dir():
        raise IsADirectoryError(f"{path} is a folder")
    if not target.suffix:
        return target.with_name(target.name + ".npz")
    if target.suffix not in WRITERS:
        raise ValueError(f"its name ends in {target.suffix}, which is none of {', '.join(WRITERS)}")
    if target.suffix == ".nc":
        needed("xarray", "xarray")
    return target


def save(motion: Trajectory, path: str) -> Path:
    """Write a motion to a file as its suffix says; raise as ``checked``, and NotWritten."""
    target = checked(path)
    written: Path = getattr(motion, WRITERS[target.suffix])(target)
    return written
