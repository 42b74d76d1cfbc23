"""``Marker``: where a marker is on the torso or along the tail, and where that is in the world.

Places on the centre line follow from the model's own tail points, for every kind of tail. A place
on a link is between the link's ends. A place on an arc is the end of a shorter arc of the same
curvature: at the fraction x it is x times as far from the root as the end of the arc would be, were
it bent by x times as much. Only the axes of offsets are turned here. Derivatives are central
differences.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from serpentail_scene.layout import OMEGA, PER_SEGMENT, QUATERNION, TAIL_Q, TAIL_V

from ..basics.attitude import REST, Entries, from_angles, product, rotation_matrix
from ..basics.checks import finite_array, measured, number, numbers, refusal
from ..basics.errors import IdentificationError
from ..model.model import Model
from ..model.polar import polar_to_bend
from ..model.state import Quantities

TORSO = -1  # the piece of a marker on the torso
NOWHERE = (0.0, 0.0, 0.0)
STRAIGHT = 1e-5  # rad: polar coordinates have no value at 0
STEP = 1e-5  # of differences, in rad or relative to sizes; their error is about its square


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

    torso: Quantities | None = None
    tail: float | None = None
    offset: Quantities = NOWHERE


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
    """M markers on a model.

    names; piece (M,), -1 for the torso; fraction of the piece (M,); offset from there (M, 3), m.
    """

    model: Model
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
    if "joint_ratios" in model.parameters:
        remedy = f"{model.name} has joint_ratios: identify a model whose joints turn alike"
        raise IdentificationError(f"markers: {remedy}")
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
    columns = np.array(piece), np.array(fraction), np.array(offset)
    return Placements(model, tuple(map(str, markers)), *columns, pieces)


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
    value = measured(field, value, "m", IdentificationError)
    if np.shape(value) != (3,):
        raise refusal(field, value, "3 finite numbers (m)", IdentificationError)
    return numbers(field, value, 3, IdentificationError)


def marker_points(placed: Placements, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return markers at configurations (F, nq): points (F, M, 3) m in the world, and their
    derivatives by q in its tangent space (F, M, 3, nv).
    """
    tail, nt = q[:, TAIL_Q], placed.model.layout.nt
    # at the tail's shape, and beside it in each coordinate
    steps = STEP * np.concatenate([np.zeros((1, nt)), np.eye(nt), -np.eye(nt)])
    places = _in_body(placed, (tail + steps[:, None]).reshape(-1, nt))
    body = places.reshape(len(steps), len(q), -1, 3)
    R = rotation_matrix(q[:, QUATERNION])[:, None]

    # shifts, turns of the torso, bends of the tail
    by_q = np.zeros((*body.shape[1:], placed.model.nv))
    by_q[..., :3] = np.eye(3)
    turns = np.cross(np.eye(3), body[0][..., None, :])  # rows e_k x of each point
    by_q[..., OMEGA] = R @ np.swapaxes(turns, -1, -2)
    slopes = (body[1 : nt + 1] - body[nt + 1 :]) / (2 * STEP)
    by_q[..., TAIL_V] = R @ np.moveaxis(slopes, 0, -1)
    return _in_world(q, R, body[0]), by_q


def world_points(placed: Placements, q: np.ndarray) -> np.ndarray:
    """Return markers at configurations (F, nq), (F, M, 3) m."""
    R = rotation_matrix(q[:, QUATERNION])[:, None]
    return _in_world(q, R, _in_body(placed, q[:, TAIL_Q]))


def _in_world(q: np.ndarray, R: np.ndarray, body: np.ndarray) -> np.ndarray:
    """Return points in the world of points (F, M, 3) in B; attitudes R (F, 1, 3, 3)."""
    return q[:, None, :3] + (R @ body[..., None])[..., 0]


def offset_axes(placed: Placements, q: np.ndarray) -> np.ndarray:
    """Return the axes (F, M, 3, 3) of offsets in the world at configurations (F, nq)."""
    R = rotation_matrix(q[:, QUATERNION])[:, None]
    return R @ _axes(placed, q[:, TAIL_Q])


def _axes(placed: Placements, tail: np.ndarray) -> np.ndarray:
    """Return the axes (F, M, 3, 3) of offsets in B at tail coordinates (F, 2m)."""
    if placed.model.kernel("tail_points").polar:
        pairs = polar_to_bend(tail[:, ::PER_SEGMENT], tail[:, 1::PER_SEGMENT])[:2]
        tail = np.stack(pairs, axis=-1).reshape(tail.shape)
    quaternions = np.zeros((len(tail), len(placed.names), 4))
    quaternions[..., 0] = 1
    frame: Entries = from_angles(np.array(placed.model.parameters.get("mount_angles", (0.0, 0, 0))))
    for k in range(placed.piece.max() + 1):
        i = PER_SEGMENT * placed.pieces.segment[k]
        turn = partial(_turn, placed.pieces.arc[k], tail[:, i], tail[:, i + 1])
        for marker in np.flatnonzero(placed.piece == k):
            entries = product(frame, turn(placed.fraction[marker]))
            quaternions[:, marker] = np.stack(entries, axis=-1)
        frame = product(frame, turn(1.0))
    return rotation_matrix(quaternions)


def _in_body(placed: Placements, tail: np.ndarray) -> np.ndarray:
    """Return markers in B (F, M, 3) m at tail coordinates (F, 2m)."""
    places = _centre_line(placed, tail)
    if not placed.offset[~placed.on_torso].any():
        return places + placed.offset
    return places + (_axes(placed, tail) @ placed.offset[..., None])[..., 0]


def _turn(arc: bool, first: np.ndarray, second: np.ndarray, fraction: float) -> list[np.ndarray]:
    """Return the quaternion by which axes turn along a piece, up to a fraction of it.

    A link turns at its joint by Rx(alpha) Rz(beta), Eq. 13, the slices of an arc by x (a, 0, b).
    """
    if arc:
        half = fraction * np.hypot(first, second) / 2
        part = fraction * np.sinc(half / np.pi) / 2
        return [np.cos(half), part * first, 0 * half, part * second]
    (c1, s1), (c2, s2) = ((np.cos(x / 2), np.sin(x / 2)) for x in (first, second))
    return [c1 * c2, s1 * c2, -s1 * s2, c1 * s2]


def _centre_line(placed: Placements, tail: np.ndarray) -> np.ndarray:
    """Return places on the centre line in B (N, M, 3), m; of markers on the torso 0."""
    kernel, pieces = placed.model.kernel("tail_points"), placed.pieces
    each = np.zeros(len(placed.names), int)
    scale = [np.ones(tail.shape[1])]
    # for each place within an arc, a tail of which this arc is bent less
    for marker, (k, x) in enumerate(zip(placed.piece, placed.fraction, strict=True)):
        if k != TORSO and pieces.arc[k] and 0 < x < 1:
            each[marker] = len(scale)
            scale.append(np.ones(tail.shape[1]))
            i = PER_SEGMENT * pieces.segment[k]
            scale[-1][i + kernel.polar : i + PER_SEGMENT] = x
    q = np.zeros((len(scale), len(tail), TAIL_Q.start + tail.shape[1]))
    q[..., : TAIL_Q.start] = REST
    q[..., TAIL_Q] = np.array(scale)[:, None] * tail
    points = kernel(q.reshape(-1, q.shape[-1])).reshape(*q.shape[:2], -1, 3)
    first, last = (points[each, :, pieces.ends[placed.piece + k]] for k in (0, 1))
    places = first + placed.fraction[:, None, None] * (last - first)
    places[placed.on_torso] = 0.0
    return np.swapaxes(places, 0, 1)


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
    return world_points(placements(model, markers), rows)
