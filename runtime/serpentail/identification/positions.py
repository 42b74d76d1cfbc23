"""``marker_positions``: positions of markers on a model, to simulate experiments."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike

from ..basics.checks import finite_array
from ..basics.errors import IdentificationError
from ..model.model import Model
from .placement import Marker, placements
from .points import world_points


def marker_positions(model: Model, q: ArrayLike, markers: Mapping[str, Marker]) -> np.ndarray:
    """Return the positions of markers at given configurations.

    Parameters
    ----------
    model : Model
        The model, with a free base.
    q : array_like, shape (F, nq)
        Configurations.
    markers : mapping of str to Marker
        Place of each marker.

    Returns
    -------
    ndarray, shape (F, M, 3)
        Positions (m, world).

    Raises
    ------
    IdentificationError
        An argument is wrong.
    ModelError
        The base is fixed.
    """
    model.refuse_fixed("marker_positions")
    rows = finite_array("q", q, IdentificationError)
    if rows.ndim != 2 or rows.shape[1] != model.nq:
        raise IdentificationError(f"q has shape {rows.shape}: needs (F, {model.nq})")
    return world_points(model, placements(model, markers), rows)
