"""The rows of a sweep in the forms that other tools take."""

from collections.abc import Iterable, Iterator
from itertools import chain, islice
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ...basics.checks import shown
from ...basics.errors import SweepError
from ...basics.extras import needed
from ...basics.files import refuse_unwritable, replacing, write_csv, write_netcdf
from .store import AT_ONCE

if TYPE_CHECKING:
    import xarray

    from .result import Sweep

ENDINGS = {".parquet": ("pyarrow", "parquet"), ".csv": None, ".nc": ("xarray", "xarray")}
Rows = list[dict[str, Any]]


def checked(path: str | PathLike[str]) -> Path:
    """Return the path of a file of rows; SweepError if its suffix is wrong."""
    target = Path(path)
    if target.suffix not in ENDINGS:
        raise SweepError(
            f"export: value {shown(str(path))}: needs a name that ends in .parquet, .csv or .nc"
        )
    if library := ENDINGS[target.suffix]:
        needed(*library)
    try:
        refuse_unwritable(target)
    except OSError as reason:
        raise SweepError(f"export: {reason}: name another file") from None
    return target


def write(sweep: "Sweep", path: str | PathLike[str]) -> Path:
    """Write the rows to a file, whole or not at all, and return its path."""
    target = checked(path)
    if target.suffix == ".csv":
        # one line for each row; numbers have all their digits, missing values are empty
        names = list(dict.fromkeys(name for row in sweep for name in flat(row)))
        lines = ([row.get(name, "") for name in names] for row in map(flat, sweep))
        return write_csv(target, chain([names], lines))
    if target.suffix == ".nc":
        return write_netcdf(target, dataset(sweep))
    with replacing(target) as part:
        _write_parquet(sweep, part)
    return target


def _write_parquet(sweep: "Sweep", path: Path) -> None:
    """Write a column for each entry; SweepError if one has texts and numbers."""
    arrow, parquet = needed("pyarrow", "parquet"), needed("pyarrow.parquet", "parquet")
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
    columns: dict[str, Any] = {}
    for name, value in row.items():
        if isinstance(value, list):
            columns |= flat({f"{name}_{k}": x for k, x in enumerate(value)}, before)
        elif isinstance(value, dict):
            columns |= flat(value, f"{before}{name}.")
        else:
            columns[before + name] = value
    return columns


def dataset(sweep: "Sweep") -> "xarray.Dataset":
    """Return the rows as a dataset over the grids and the samples."""
    xarray, pandas, axes = needed("xarray", "xarray"), needed("pandas", "pandas"), sweep.axes
    rows = [flat({k: x for k, x in row.items() if k not in axes.names}) for row in sweep]
    frame = pandas.DataFrame(rows).set_index("number").reindex(range(len(sweep)))
    dims = ["_".join(names) for names in axes.grids] + ["sample"] * bool(axes.spreads)
    variables = {}
    for name, column in frame.items():
        texts = name == "error" or column.map(lambda x: isinstance(x, str)).any()
        values = column.fillna("").astype(str).astype(object) if texts else column.astype(float)
        variables[name] = (dims, values.to_numpy().reshape(axes.sizes))

    # a grid of one name is a coordinate by its values, any other one by the places of these
    coordinates: dict[str, Any] = {}
    for dim, (names, columns) in zip(dims, axes.grids.items(), strict=False):
        for name, values in zip(names, columns, strict=True):
            simple = all(isinstance(x, int | float | str) for x in values)
            label = name if simple or len(names) > 1 else f"{name}_value"
            coordinates[label] = (dim, list(values) if simple else list(map(str, values)))
        coordinates.setdefault(dim, (dim, np.arange(len(columns[0]))))
    for name, samples in axes.samples.items():
        entries = _columns([flat({name: sample}) for sample in samples.tolist()])
        coordinates |= {entry: ("sample", numbers) for entry, numbers in entries.items()}
    return xarray.Dataset(variables, coordinates)
