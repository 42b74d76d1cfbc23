"""The rows of a sweep in the forms that other tools take."""

import math
from collections.abc import Iterable, Iterator
from itertools import chain, islice
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ...basics.checks import shown
from ...basics.errors import SweepError
from ...basics.extras import needed
from ...basics.files import refuse_unwritable, replacing, write_csv
from .shards import AT_ONCE, parquet_library

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
        return _write_csv(sweep, target)
    with replacing(target) as part:
        if target.suffix == ".parquet":
            _write_parquet(sweep, part)
        else:
            dataset(sweep).to_netcdf(part, engine="scipy", format="NETCDF3_64BIT")
    return target


def _write_csv(sweep: "Sweep", path: Path) -> Path:
    """Write one line for each row; numbers have all their digits, missing values are empty."""
    names = list(dict.fromkeys(name for row in sweep for name in flat(row)))
    rows = ([row.get(name, "") for name in names] for row in map(flat, sweep))
    return write_csv(path, chain([names], rows))


def _write_parquet(sweep: "Sweep", path: Path) -> None:
    """Write a column for each entry; SweepError if one has texts and numbers."""
    arrow, parquet = parquet_library()
    schema = arrow.schema([])
    try:
        for part in _parts(sweep):
            schemas = [schema, arrow.table(_columns(part)).schema]
            schema = arrow.unify_schemas(schemas, promote_options="permissive")
    except (arrow.ArrowInvalid, arrow.ArrowTypeError) as reason:
        raise SweepError(f"export: {reason}: write a .csv file") from None
    with parquet.ParquetWriter(path, schema, compression="zstd") as writer:
        for part in _parts(sweep):
            writer.write_table(arrow.table(_columns(part, schema.names), schema))


def _parts(sweep: "Sweep") -> Iterator[Rows]:
    """Yield the rows in parts, with a column for each entry."""
    rows = map(flat, sweep)
    while part := list(islice(rows, AT_ONCE)):
        yield part


def _columns(part: Rows, names: Iterable[str] = ()) -> dict[str, list]:
    """Return rows by columns, by default by all that they have; None where one has no value."""
    names = names or dict.fromkeys(name for row in part for name in row)
    return {name: [row.get(name) for row in part] for name in names}


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


def frame(sweep: "Sweep") -> "pandas.DataFrame":
    """Return the rows as a table of pandas."""
    pandas = needed("pandas", "pandas")
    return pandas.DataFrame([flat(row) for row in sweep])


def dataset(sweep: "Sweep") -> "xarray.Dataset":
    """Return the rows as a dataset over the grids and the samples."""
    xarray = needed("xarray", "xarray")
    axes = sweep.axes
    dims = ["_".join(names) for names in axes.grids]
    coordinates: dict[str, Any] = {}
    for dim, (names, each) in zip(dims, axes.grids.items(), strict=True):
        coordinates |= _grid_coordinates(dim, names, each.values)
    if axes.spreads:
        dims = [*dims, SAMPLE]
        for name, numbers in axes.samples(np.arange(axes.points)).items():
            coordinates |= _entries(name, np.array(numbers))
    given = set(axes.names) | {"number"}
    columns: dict[str, np.ndarray] = {}
    for row in sweep:
        for name, value in flat(row).items():
            if not any(name == one or name.startswith(f"{one}_") for one in given):
                _put(columns, name, len(sweep), row["number"], value)
    variables = {name: (dims, each.reshape(axes.sizes)) for name, each in columns.items()}
    return xarray.Dataset(variables, coordinates)


def _put(columns: dict[str, np.ndarray], name: str, count: int, place: int, value: Any) -> None:
    """Put a value into its column: of numbers, NaN where there is none, or else of texts."""
    if name not in columns:
        columns[name] = np.full(count, "", object) if name == "error" else np.full(count, math.nan)
    if value is None:
        return
    number = isinstance(value, int | float) and columns[name].dtype != object
    if not number and columns[name].dtype != object:
        texts = ["" if math.isnan(x) else str(x) for x in columns[name].tolist()]
        columns[name] = np.array(texts, object)
    columns[name][place] = value if number else str(value)


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
