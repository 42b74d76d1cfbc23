"""Motions as datasets of xarray, and as NetCDF files."""

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...basics.extras import needed
from ...basics.files import replacing
from .contents import Contents

if TYPE_CHECKING:
    import xarray


def dataset(held: Contents) -> "xarray.Dataset":
    """Return the dataset; ExtraMissing without xarray."""
    xarray = needed("xarray", "xarray")
    coordinates: dict[str, Any] = {name: (name, list(each)) for name, each in held.labels.items()}
    coordinates["time"] = ("time", held.labels["time"], {"units": "s", "long_name": "time"})
    if held.groups:
        coordinates["group"] = ("point", list(held.groups))
    variables = {}
    for name, variable in held.variables.items():
        told = {"units": variable.unit} if variable.unit else {}
        told["long_name"] = variable.words
        variables[name] = (variable.dims, variable.values, told)
        if not isinstance(variable.units, str):
            last = variable.dims[-1]
            coordinates[f"{last}_units"] = (last, list(variable.units))
    return xarray.Dataset(variables, coordinates, held.facts)


def write(held: Contents, path: str | os.PathLike[str]) -> Path:
    """Write a NetCDF file, whole or not at all, and return its path.

    ExtraMissing without xarray, NotWritten if it cannot be written. SciPy, which is always
    installed, writes NetCDF 3 with 64-bit offsets.
    """
    target, data = Path(path), dataset(held)
    with replacing(target) as part:
        data.to_netcdf(part, engine="scipy", format="NETCDF3_64BIT")
    return target
