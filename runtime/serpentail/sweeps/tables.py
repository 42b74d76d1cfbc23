"""The rows of a sweep in the forms that other tools take."""

import math
from contextlib import suppress
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..checks import shown
from ..errors import SweepError
from ..extras import needed
from ..files import refuse_unwritable, replacing, write_csv
from .axes import Axes

if TYPE_CHECKING:
    import pandas
    import xarray

    from .result import Sweep

ENDINGS = (".parquet", ".csv", ".nc")
SAMPLE = "sample"
Rows = list[dict[str, Any]]


def checked(path: str | PathLike[str]) -> Path:
    """Return the path of a file of rows; SweepError if its suffix is wrong."""
    target = Path(path)
    if target.suffix not in ENDINGS:
        raise SweepError(
            f"export: value {shown(str(path))}: needs a name that ends in .parquet, .csv or .nc"
        )
    for module, extra, ending in (
        ("pyarrow", "parquet", ".parquet"),
        ("pandas", "parquet", ".parquet"),
        ("xarray", "xarray", ".nc"),
    ):
        if ending == target.suffix:
            needed(module, extra)
    try:
        refuse_unwritable(target)
    except OSError as reason:
        raise SweepError(f"export: {reason}: name another file") from None
    return target


def write(sweep: "Sweep", path: str | PathLike[str]) -> Path:
    """Write the rows to a file, whole or not at all, and return its path."""
    target = checked(path)
    if target.suffix == ".csv":
        return _write_csv(sweep.rows(), target)
    with replacing(target) as part:
        if target.suffix == ".parquet":
            frame(sweep.rows()).to_parquet(part, engine="pyarrow", index=False)
        else:
            data = sweep.to_xarray()
            data.to_netcdf(part, engine="scipy", format="NETCDF3_64BIT")
    return target


def _write_csv(rows: Rows, path: Path) -> Path:
    """Write one line for each row; numbers have all their digits, missing values are empty."""
    found = [flat(row) for row in rows]
    names = list(dict.fromkeys(name for row in found for name in row))
    return write_csv(path, [names, *([row.get(name, "") for name in names] for row in found)])


def flat(row: dict[str, Any], before: str = "") -> dict[str, Any]:
    """Return a row with a column for each entry of its lists (q_end_2) and tables (a.b)."""
    found: dict[str, Any] = {}
    for name, value in row.items():
        if isinstance(value, list):
            found |= flat({f"{name}_{k}": x for k, x in enumerate(value)}, before)
        elif isinstance(value, dict):
            found |= flat(value, f"{before}{name}.")
        else:
            found[before + name] = value
    return found


def frame(rows: Rows) -> "pandas.DataFrame":
    """Return the rows as a table of pandas."""
    pandas = needed("pandas", "pandas")
    return pandas.DataFrame([flat(row) for row in rows])


def dataset(axes: Axes, count: int, rows: Rows) -> "xarray.Dataset":
    """Return the rows as a dataset over the grids and the samples."""
    xarray = needed("xarray", "xarray")
    dims = ["_".join(names) for names in axes.grids]
    sizes = [len(each.values) for each in axes.grids.values()]
    coordinates: dict[str, Any] = {}
    for dim, (names, each) in zip(dims, axes.grids.items(), strict=True):
        coordinates |= _grid_coordinates(dim, names, each.values)
    if axes.spreads:
        dims, sizes = [*dims, SAMPLE], [*sizes, axes.points]
        for name, numbers in axes.samples().items():
            coordinates |= _entries(name, np.array(numbers))
    placed = _placed(count, rows)
    filled = dict.fromkeys(name for row in placed for name in row)
    columns = {name: [row.get(name) for row in placed] for name in filled}
    given = set(axes.names) | {"number"}
    variables = {
        name: (dims, _array(name, values).reshape(sizes))
        for name, values in columns.items()
        if not any(name == one or name.startswith(f"{one}_") for one in given)
    }
    return xarray.Dataset(variables, coordinates)


def _placed(count: int, rows: Rows) -> Rows:
    """Return a row for every point, empty if it has none yet."""
    found: Rows = [{}] * count
    for row in rows:
        found[row["number"]] = flat(row)
    return found


def _grid_coordinates(dim: str, names: tuple[str, ...], values: tuple) -> dict[str, Any]:
    """Return the coordinates of one grid: its values, or their numbers and a coordinate a name."""
    if len(names) == 1 and all(isinstance(value, int | float | str) for value in values):
        return {dim: (dim, list(values))}
    found: dict[str, Any] = {dim: (dim, np.arange(len(values)))}
    if len(names) == 1:
        return found | {f"{dim}_value": (dim, [str(value) for value in values])}
    for k, name in enumerate(names):
        column = [value[k] for value in values]
        plain = all(isinstance(x, int | float | str) for x in column)
        found[name] = (dim, column if plain else [str(x) for x in column])
    return found


def _entries(name: str, numbers: np.ndarray) -> dict[str, Any]:
    """Return the coordinates of an axis that is spread, one an entry of its arrays."""
    if numbers.ndim == 1:
        return {name: (SAMPLE, numbers)}
    columns = numbers.reshape(len(numbers), -1)
    return {f"{name}_{k}": (SAMPLE, column) for k, column in enumerate(columns.T)}


def _array(name: str, values: list[Any]) -> np.ndarray:
    """Return a column as numbers with NaN for missing ones, or else as texts."""
    with suppress(TypeError, ValueError):
        if name != "error":
            return np.array([math.nan if x is None else float(x) for x in values])
    return np.array(["" if x is None else str(x) for x in values])
