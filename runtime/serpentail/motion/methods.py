"""Methods of motions whose work is done in rooms above this one: pictures, pages, tables, files.

Each imports what it needs when it is called.
"""

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..basics.near_names import NearNames
from ..model.model import Model

if TYPE_CHECKING:
    import pandas
    import xarray

    from ..show.pictures.plot import Figure


class Exports(NearNames):
    """Conversions of trajectories and rollouts.

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
        from ..bridges.containers.tables import dataset

        return dataset(self)  # type: ignore[arg-type]

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

        return frame(self)  # type: ignore[arg-type]

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
        from ..bridges.containers.tables import write_table

        return write_table(self, path)  # type: ignore[arg-type]

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
        from ..bridges.containers.tables import write_dataset

        return write_dataset(self, path)  # type: ignore[arg-type]


class Showable:
    """Ways to see one motion; ``model`` is that of a motion which was read from a file."""

    def view(
        self,
        path: str | os.PathLike[str] = "run.html",
        model: Model | None = None,
        live: bool = False,
    ) -> Path:
        """Write an .html page that shows this motion in a browser, and return its path.

        Arguments and errors are those of ``serpentail.view``.
        """
        from ..show.page.view import view

        return view(self, path, model=model, live=live)  # type: ignore[call-overload]

    def _repr_html_(self) -> str:
        """Text and page, for notebooks."""
        from ..show.page.view import in_notebook

        return in_notebook(self, lambda: [self])  # type: ignore[list-item]

    def film(self, path: str | os.PathLike[str], **options: Any) -> Path:
        """Write a moving film, a filmstrip or a page, as the suffix tells; return its path.

        Options and errors are those of ``serpentail.film``.
        """
        from ..show.pictures.film import film

        return film(self, path, **options)  # type: ignore[arg-type]

    def filmstrip(
        self, path: str | os.PathLike[str] | None = None, **options: Any
    ) -> tuple["Figure", Any]:
        """Draw moments of the motion side by side; return Matplotlib's figure and its axes.

        With a path the figure is written, too. Options and errors are those of
        ``serpentail.filmstrip``.
        """
        from ..show.pictures.filmstrip import filmstrip

        return filmstrip(self, path, **options)  # type: ignore[arg-type]

    def plot(self, *panels: str, **options: Any) -> tuple["Figure", Any]:
        """Draw panels over time, by default all that do not stay zero; return figure and axes.

        Names of panels, options and errors are those of ``serpentail.plot``.
        """
        from ..show.pictures.plot import plot

        return plot(self, *panels, **options)  # type: ignore[arg-type]
