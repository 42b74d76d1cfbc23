"""``Marker``: where a marker is on the torso or along the tail."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..basics.attitude import REST
from ..basics.checks import number, numbers, refusal
from ..basics.errors import IdentificationError
from ..model.model import Model

TORSO = -1  # the piece of a marker on the torso
NOWHERE = (0.0, 0.0, 0.0)
STRAIGHT = 1e-5  # rad: polar coordinates have no value at 0


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
class Pieces:
    """Links and arcs of a tail from the mount to the tip: the segment (P,) of each, whether it is
    an arc (P,), and the indices (P + 1,) of the tail points at their ends.
    """

    segment: np.ndarray
    arc: np.ndarray
    ends: np.ndarray


@dataclass(frozen=True, eq=False)
class Placements:
    """M markers on the pieces of a tail.

    names; piece (M,), -1 for the torso; fraction of the piece (M,); offset from there (M, 3), m.
    """

    names: tuple[str, ...]
    piece: np.ndarray
    fraction: np.ndarray
    offset: np.ndarray
    pieces: Pieces

    @property
    def on_torso(self) -> np.ndarray:
        """Which markers are on the torso, (M,)."""
        return self.piece == TORSO


def placements(model: Model, markers: Any) -> Placements:
    """Return the places of the markers; IdentificationError if one is wrong."""
    if not isinstance(markers, Mapping) or not markers:
        needs = 'a Marker for each name, such as {"head": Marker(torso=(0, 0.03, 0.02))}'
        raise refusal("markers", markers, needs, IdentificationError)
    count = np.atleast_1d(model.joints_each)
    arc = np.repeat([kind == "continuum" for kind in model.kinds], count)
    points = np.where(arc, model.samples or 1, 1)
    ends = np.concatenate([[0], np.cumsum(points)])
    pieces = Pieces(np.repeat(np.arange(model.segments), count), arc, ends)

    # where pieces begin and end by length (m), on a tail that is almost straight
    tail = np.tile([0.0, STRAIGHT], model.segments)
    joints = model.tail_points(np.concatenate([REST, tail]))[pieces.ends]
    lengths = np.linalg.norm(np.diff(joints, axis=0), axis=1)
    along = np.concatenate([[0.0], np.cumsum(lengths)])

    placed = [_placed(str(name), marker, along) for name, marker in markers.items()]
    piece, fraction, offset = zip(*placed, strict=True)
    return Placements(
        tuple(map(str, markers)), np.array(piece), np.array(fraction), np.array(offset), pieces
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
