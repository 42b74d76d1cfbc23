"""Conversions of motions to other libraries' containers and files."""

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import pandas
    import xarray


class Exports:
    """Conversions of trajectories and rollouts; they import what they need when they are called.

    Coordinates have names such as x, qw, alpha_1; everything is in SI units. Runs that failed or
    ended early have nan after their end.
    """

    def to_xarray(self) -> "xarray.Dataset":
        """Convert to an xarray dataset; needs the extra "xarray".

        Returns
        -------
        xarray.Dataset
            Dimensions time, or run and time, then coordinate, rate, joint, axis, point, plane, leg.
            Variables are q, v, tau, energies and momenta and, on the ground, points, forces,
            bristles and legs, each with the attributes ``units`` and ``long_name``. Rollouts also
            have ends (s), errors and the runs' own parameters. Plain values of ``info`` are
            attributes of the dataset; its attribute "info" has all of it as JSON.

        Raises
        ------
        ExtraMissing
            xarray is not installed.
        """
        from ..bridges.containers.labelled import dataset

        return dataset(self._contents())

    def to_dataframe(self) -> "pandas.DataFrame":
        """Convert to a pandas table; needs the extra "pandas".

        Returns
        -------
        pandas.DataFrame
            One row for each sample; the index is time (s), or run and time. Columns are such as z,
            tau_alpha_1, forces_tail_1_x; ``attrs["units"]`` has their units.

        Raises
        ------
        ExtraMissing
            pandas is not installed.
        """
        from ..bridges.containers.tables import frame

        return frame(self._contents())

    def to_csv(self, path: str | os.PathLike[str]) -> Path:
        """Write the table of ``to_dataframe`` as CSV, whole or not at all; needs no extra.

        Parameters
        ----------
        path : str or path
            The file. The header has units, such as "time [s]"; numbers have all their digits.

        Returns
        -------
        Path
            The path of the file.

        Raises
        ------
        NotWritten
            The file cannot be written.
        """
        from ..bridges.containers.tables import write

        return write(self._contents(), path)

    def to_netcdf(self, path: str | os.PathLike[str]) -> Path:
        """Write the dataset of ``to_xarray`` as NetCDF 3, whole or not at all.

        Parameters
        ----------
        path : str or path
            The file.

        Returns
        -------
        Path
            The path of the file.

        Raises
        ------
        ExtraMissing
            xarray is not installed.
        NotWritten
            The file cannot be written.
        """
        from ..bridges.containers.labelled import write

        return write(self._contents(), path)

    def _contents(self) -> Any:
        """Return what it holds, with names and units."""
        from ..bridges.containers.contents import contents

        return contents(self)  # type: ignore[arg-type]
