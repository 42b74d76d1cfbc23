"""``Marker``: where a marker is on the torso or along the tail."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..checks import number, numbers, refusal
from ..errors import IdentificationError
from ..model.model import Model

TORSO = -1  # the piece of a marker on the torso
NOWHERE = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Marker:
    """Place of a marker: ``Marker(torso=(x, y, z))`` or ``Marker(tail=0.5)``.

    Parameters
    ----------
    torso : sequence of float, shape (3,), optional
        Position from B (m), in the body frame.
    tail : float, optional
        Place along the tail by length, from 0 at the mount to 1 at the tip.
    offset : sequence of float, shape (3,), default zeros
        Further offset to the marker (m); on the tail from its centre line, in the axes of the
        link or of the arc's cross-section, whose y axis points towards the mount.

    Examples
    --------
    >>> import serpentail as st
    >>> st.Marker(tail=1.0).offset
    (0.0, 0.0, 0.0)
    """

    torso: Sequence[float] | None = None
    tail: float | None = None
    offset: Sequence[float] = NOWHERE


@dataclass(frozen=True, eq=False)
class Placements:
    """M markers on the pieces of a tail.

    names; piece (M,), -1 for the torso; fraction of the piece (M,); offset from there (M, 3), m.
    """

    names: tuple[str, ...]
    piece: np.ndarray
    fraction: np.ndarray
    offset: np.ndarray

    def moved(self, offset: np.ndarray) -> "Placements":
        """Return the same markers with other offsets."""
        return Placements(self.names, self.piece, self.fraction, offset)


def piece_lengths(model: Model) -> np.ndarray:
    """Return the length (m) of each link, or of each arc, from the mount to the tip."""
    p = model.parameters
    own = p.get("link_lengths", p.get("arc_lengths"))
    if own is not None:
        return np.atleast_1d(np.asarray(own, float))
    pieces = int(np.sum(model.joints_each))
    return np.full(pieces, float(p["tail_length"]) / pieces)


def placements(model: Model, markers: Any) -> Placements:
    """Return the places of the markers; IdentificationError if one is wrong."""
    if not isinstance(markers, Mapping) or not markers:
        needs = 'a Marker for each name, such as {"head": Marker(torso=(0, 0.03, 0.02))}'
        raise refusal("markers", markers, needs, IdentificationError)
    ends = np.concatenate([[0.0], np.cumsum(piece_lengths(model))])
    placed = [_placed(str(name), marker, ends) for name, marker in markers.items()]
    pieces, fractions, offsets = zip(*placed, strict=True)
    return Placements(
        tuple(map(str, markers)), np.array(pieces), np.array(fractions), np.array(offsets, float)
    )


def _placed(name: str, marker: Any, ends: np.ndarray) -> tuple[int, float, np.ndarray]:
    """Return piece, fraction and offset of a marker."""
    field = f"markers.{name}"
    if not isinstance(marker, Marker) or (marker.torso is None) == (marker.tail is None):
        needs = "a Marker with torso=(x, y, z) or with tail=0 to 1"
        raise refusal(field, marker, needs, IdentificationError)
    if marker.torso is not None:
        place = _three(f"{field}.torso", marker.torso)
        return TORSO, 0.0, place + _three(f"{field}.offset", marker.offset)
    along = number(f"{field}.tail", marker.tail, IdentificationError, least=0, most=1)
    reach = along * ends[-1]
    piece = int(np.clip(np.searchsorted(ends, reach, side="left") - 1, 0, len(ends) - 2))
    fraction = (reach - ends[piece]) / (ends[piece + 1] - ends[piece])
    return piece, float(np.clip(fraction, 0, 1)), _three(f"{field}.offset", marker.offset)


def _three(field: str, value: Any) -> np.ndarray:
    """Return three numbers in m."""
    if np.shape(value) != (3,):
        raise refusal(field, value, "3 finite numbers (m)", IdentificationError)
    return numbers(field, value, 3, IdentificationError)
