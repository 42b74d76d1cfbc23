"""Methods that show a motion: page, film, filmstrip and plots."""

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from ..model.model import Model

if TYPE_CHECKING:
    from .trajectory import Trajectory


class Showable:
    """Methods that show a motion; they import what they need when they are called."""

    def view(self, path: str | os.PathLike[str] = "run.html", model: Model | None = None) -> Path:
        """Write a page that shows this motion in a browser; see ``serpentail.view``.

        Parameters
        ----------
        path : str or path, default "run.html"
            The .html file.
        model : Model, optional
            The model of a motion that was read from a file.

        Returns
        -------
        Path
            The path of the file.

        Raises
        ------
        ViewError, ModelError
            As of ``serpentail.view``.
        """
        from ..show.page.view import view

        return view(cast("Trajectory", self), path, model=model)

    def _repr_html_(self) -> str:
        """Text and page, for notebooks."""
        from ..show.page.view import in_notebook

        return in_notebook(self, lambda: [cast("Trajectory", self)])

    def film(self, path: str | os.PathLike[str], **options: Any) -> Path:
        """Write a moving film, a filmstrip or a page; see ``serpentail.film``.

        Parameters
        ----------
        path : str or path
            The file; its suffix tells which.
        **options
            Other arguments of ``serpentail.film``.

        Returns
        -------
        Path
            The path of the file.

        Raises
        ------
        ViewError, ModelError, ExtraMissing
            As of ``serpentail.film``.
        """
        from ..show.pictures.film import film

        return film(cast("Trajectory", self), path, **options)

    def filmstrip(self, path: str | os.PathLike[str] | None = None, **options: Any) -> Any:
        """Draw moments of the motion side by side; see ``serpentail.filmstrip``.

        Parameters
        ----------
        path : str or path, optional
            A file to write the figure to.
        **options
            Other arguments of ``serpentail.filmstrip``.

        Returns
        -------
        figure : matplotlib.figure.Figure
            The figure.
        axes : ndarray of matplotlib.axes.Axes
            Its axes.

        Raises
        ------
        ViewError, ModelError, ExtraMissing
            As of ``serpentail.filmstrip``.
        """
        from ..show.pictures.filmstrip import filmstrip

        return filmstrip(cast("Trajectory", self), path, **options)

    def plot(self, *panels: str, **options: Any) -> Any:
        """Draw panels over time; see ``serpentail.plot``.

        Parameters
        ----------
        *panels : str
            Names of panels; default: all that do not stay zero.
        **options
            Other arguments of ``serpentail.plot``.

        Returns
        -------
        figure : matplotlib.figure.Figure
            The figure.
        axes : matplotlib.axes.Axes or ndarray of these
            Its axes.

        Raises
        ------
        ViewError, ExtraMissing
            As of ``serpentail.plot``.
        """
        from ..show.pictures.plot import plot

        return plot(cast("Trajectory", self), *panels, **options)
