"""What trajectories and rollouts can become: containers of other libraries, and their files."""

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import pandas
    import xarray


class Exports:
    """Methods of trajectories and rollouts; what they need is imported when they are called.

    Coordinates are called by their names, such as x, qw, alpha_1, and everything is SI.  Runs that
    failed, or that ended before others, have nan after their end.
    """

    def to_xarray(self) -> "xarray.Dataset":
        """Return a dataset: dimensions time, or run and time, then coordinate, rate, joint, axis,
        point, plane, leg.

        ``units`` and ``long_name`` are attributes of its variables: q, v, tau, energies, momenta
        and, on the ground, points, forces, bristles, legs.  Plain values of ``info`` are attributes
        of the dataset, all of it as JSON is "info".  Runs also have ends (s), errors and the
        parameters of their own.  ExtraMissing without the extra "xarray".
        """
        from ..containers.labelled import dataset

        return dataset(self._contents())

    def to_dataframe(self) -> "pandas.DataFrame":
        """Return a table of one row a sample, its index time (s), or run and time.

        Columns are such as z, tau_alpha_1, forces_tail_1_x; their units are in ``attrs["units"]``.
        ExtraMissing without the extra "pandas".
        """
        from ..containers.tables import frame

        return frame(self._contents())

    def to_csv(self, path: str | os.PathLike[str]) -> Path:
        """Write the table of ``to_dataframe`` as CSV, whole or not at all; return the path.

        The header has units, as "time [s]"; numbers have all their digits.  It needs no extra;
        NotWritten where it cannot be written.
        """
        from ..containers.tables import write

        return write(self._contents(), path)

    def to_netcdf(self, path: str | os.PathLike[str]) -> Path:
        """Write the dataset of ``to_xarray`` as NetCDF 3, whole or not at all; return the path.

        ExtraMissing without the extra "xarray", NotWritten where it cannot be written.
        """
        from ..containers.labelled import write

        return write(self._contents(), path)

    def _contents(self) -> Any:
        """What it holds, with names and units."""
        from ..containers.contents import contents

        return contents(self)  # type: ignore[arg-type]
