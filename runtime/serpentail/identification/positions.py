"""``marker_positions``: where markers on a body are, for experiments that are yet to be made."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike

from ..checks import finite_array
from ..errors import IdentificationError
from ..model.model import Model
from .placement import Marker, placements
from .trial import world_points


def marker_positions(model: Model, q: ArrayLike, markers: Mapping[str, Marker]) -> np.ndarray:
    """Return where markers are in the world, (F, M, 3) m, at configurations q (F, nq).

    markers: as of ``identify``.  Raises IdentificationError.
    """
    model.refuse_fixed("marker_positions")
    rows = finite_array("q", q, IdentificationError)
    if rows.ndim != 2 or rows.shape[1] != model.nq:
        raise IdentificationError(f"q has shape {rows.shape}: needs (F, {model.nq})")
    return world_points(model, placements(model, markers), rows)
