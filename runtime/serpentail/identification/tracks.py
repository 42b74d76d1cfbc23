"""``MarkerTracks``: positions of markers over time, nan if a marker was not seen."""

import re
import warnings
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from serpentail_scene.units import MEASURES, plain

from ..basics.checks import finite_array, needed, one_of, real_array, refusal, shown
from ..basics.errors import IdentificationError, UnusualSize
from ..basics.near_names import NearNames
from ..basics.plausible_values import LARGEST
from ..motion.text import framed

UNITS: dict[str, Fraction] = MEASURES["m"][1]
ZEROS = ("refuse", "gap")
AXES = "^(-?[xyz]){3}$"
FEWEST = 4  # frames
FARTHEST = 1e6  # m from the origin, in any recording
LATEST = 1e12  # s: times since 1970, and more


@dataclass(frozen=True, eq=False)
class MarkerTracks(NearNames):
    """Positions of M markers at F times; ``marker_tracks`` and ``read_markers`` make them.

    Attributes
    ----------
    times : ndarray, shape (F,)
        Increasing times (s).
    positions : ndarray, shape (F, M, 3)
        Positions (m, world); nan if a marker was not seen.
    names : tuple of str
        Names of the markers.
    source : str
        Where they are from, for messages.
    unit : str
        The unit that they were given in, for messages.
    """

    times: np.ndarray
    positions: np.ndarray
    names: tuple[str, ...]
    source: str = "arrays"
    unit: str = "m"

    def __repr__(self) -> str:
        frames, count = self.seen.shape
        return framed(
            [
                f"MarkerTracks of {self.source}: {count} markers at {frames} times, "
                f"{self.times[0]:.6g} to {self.times[-1]:.6g} s",
                f"names {', '.join(self.names)}",
                f"positions {self.positions.shape}; SI: s, m; {1 - self.seen.mean():.0%} not seen",
            ]
        )

    @property
    def seen(self) -> np.ndarray:
        """Whether each marker was seen at each time, (F, M)."""
        return np.isfinite(self.positions).all(axis=2)

    def of(self, names: Sequence[str]) -> "MarkerTracks":
        """Return the tracks of some markers.

        Parameters
        ----------
        names : sequence of str
            Names in the wanted order.

        Returns
        -------
        MarkerTracks
            Their tracks.

        Raises
        ------
        IdentificationError
            There is no marker of such a name.
        """
        for name in names:
            one_of(f"markers of {self.source}", name, self.names, IdentificationError)
        columns = [self.names.index(name) for name in names]
        return replace(self, positions=self.positions[:, columns], names=tuple(names))


def marker_tracks(
    times: ArrayLike,
    positions: ArrayLike,
    names: Sequence[str],
    *,
    unit: str,
    axes: str = "xyz",
    zeros: str = "refuse",
) -> MarkerTracks:
    """Make marker tracks from arrays.

    Parameters
    ----------
    times : array_like, shape (F,)
        Increasing times (s), four or more, evenly spaced or not.
    positions : array_like, shape (F, M, 3)
        Positions; nan if a marker was not seen.
    names : sequence of str
        Names of the M markers.
    unit : str
        Unit of the positions, such as "mm". It has no default, because a wrong guess would not
        be noticed.
    axes : str, default "xyz"
        Axes of the data that point right, forward and up, which are the world's x, y and z. For
        OpenSim's y up and x forward it is "zxy". A minus reverses an axis, as in "-yxz".
    zeros : {"refuse", "gap"}, default "refuse"
        Markers at exactly (0, 0, 0), which some programs write in gaps: refuse them, or read
        them as gaps.

    Returns
    -------
    MarkerTracks
        The tracks, in m and in world axes.

    Raises
    ------
    IdentificationError
        An argument is wrong, or a position is more than 1000 km from the origin.

    Warns
    -----
    UnusualSize
        A position is more than 100 m from the origin: most often the unit is wrong.

    Examples
    --------
    >>> import numpy as np
    >>> import serpentail as st
    >>> tracks = st.marker_tracks(np.arange(4) / 100, np.ones((4, 1, 3)), ["tip"], unit="mm")
    >>> tracks.positions[0, 0].tolist()
    [0.001, 0.001, 0.001]
    """
    return checked_tracks(RawTracks(times, positions, names, unit), axes, zeros, "arrays")


@dataclass(frozen=True, eq=False)
class RawTracks:
    """Marker tracks as a user or a file states them, before they are checked."""

    times: Any
    positions: Any
    names: Any
    unit: Any


def checked_tracks(raw: RawTracks, axes: Any, zeros: Any, source: str) -> MarkerTracks:
    """Return tracks in m and in world axes after checking them; source: for messages."""
    unit = checked_unit(raw.unit, source)
    times = _checked_times(raw.times, source)
    names = _checked_names(raw.names, source)
    positions = real_array(f"{source}: positions", raw.positions, IdentificationError)
    if positions.shape != (len(times), len(names), 3):
        raise IdentificationError(
            f"{source}: positions have shape {positions.shape}: needs "
            f"({len(times)}, {len(names)}, 3), of times, names and x, y, z"
        )
    if np.isinf(positions).any():
        raise IdentificationError(f"{source}: positions: a value is infinite: use nan for a gap")
    one_of("zeros", zeros, ZEROS, IdentificationError)
    positions = _without_zeros(positions, names, zeros, source)
    columns, signs = _checked_axes(axes)
    positions = positions[..., columns] * signs * float(UNITS[unit])

    # a marker with one coordinate missing was not seen
    seen = np.isfinite(positions).all(axis=2)
    positions = np.where(seen[..., None], positions, np.nan)
    unseen = [names[k] for k in np.flatnonzero(~seen.any(axis=0))]
    if unseen:
        raise IdentificationError(f"{source}: never seen: {', '.join(unseen)}: leave these out")
    _refuse_far(positions, names, source)
    return MarkerTracks(times, positions, names, source, unit)


def _refuse_far(positions: np.ndarray, names: Sequence[str], source: str) -> None:
    """Refuse a coordinate (m) that no recording has, and warn of one that is unusual."""
    place = np.unravel_index(np.nanargmax(np.abs(positions)), positions.shape)
    value, (frame, marker, axis) = float(positions[place]), map(int, place)
    if abs(value) <= LARGEST["m"][0]:
        return
    line = (
        f"{source}: marker {shown(names[marker])}, frame {frame} (from 0), {'xyz'[axis]}: "
        f"value {value:.6g} m: beyond {LARGEST['m'][1]}, which no recording has: "
        'give the right unit, such as unit="mm", or nan for a gap'
    )
    if abs(value) > FARTHEST:
        raise IdentificationError(line)
    warnings.warn(line, UnusualSize, stacklevel=4)


def checked_unit(unit: Any, source: str) -> str:
    """Return a unit of length as MEASURES spells it; IdentificationError if it is missing."""
    if unit is None:
        raise IdentificationError(
            f'{source}: unit: none is stated: give unit="mm", or whichever of '
            f"{', '.join(UNITS)} it is"
        )
    spelled = plain(unit) if isinstance(unit, str) else unit
    if not isinstance(spelled, str) or spelled not in UNITS:
        raise refusal(f"{source}: unit", unit, f"one of {', '.join(UNITS)}", IdentificationError)
    return spelled


def _checked_times(times: Any, source: str) -> np.ndarray:
    """Return the times; IdentificationError unless they are finite and increase."""
    t = finite_array(f"{source}: times", times, IdentificationError)
    if t.ndim != 1 or len(t) < FEWEST:
        raise IdentificationError(
            f"{source}: times have shape {t.shape}: needs {FEWEST} frames or more"
        )
    late = np.flatnonzero(np.abs(t) > LATEST)
    if len(late):
        raise IdentificationError(
            f"{source}: times[{late[0]}]: value {t[late[0]]:g}: needs seconds, up to {LATEST:g}"
        )
    wrong = np.flatnonzero(np.diff(t) <= 0)
    if len(wrong):
        k = int(wrong[0])
        word = "repeated" if t[k + 1] == t[k] else "before the last"
        raise IdentificationError(
            f"{source}: times: frame {k + 1} (from 0) has {t[k + 1]:g} s, {word} ({t[k]:g} s): "
            "needs times that increase; remove frames that are doubled"
        )
    return t.copy()


def _checked_names(names: Any, source: str) -> tuple[str, ...]:
    """Return the names of markers; IdentificationError unless they are different texts."""
    listed = tuple(names) if isinstance(names, list | tuple) else ()
    sound = (isinstance(x, str) and x.strip() and x.isprintable() for x in listed)
    if not listed or not all(sound):
        needs = "a name for each marker, without control characters"
        raise refusal(f"{source}: names", names, needs, IdentificationError)
    name, count = Counter(listed).most_common(1)[0]
    if count > 1:
        raise IdentificationError(f"{source}: two markers are called {shown(name)}: rename one")
    return listed


def _without_zeros(
    positions: np.ndarray, names: Sequence[str], zeros: str, source: str
) -> np.ndarray:
    """Return positions with nan in place of exact zeros, or refuse them."""
    empty = (positions == 0).all(axis=2)
    if not empty.any():
        return positions
    if zeros == "refuse":
        k = int(np.flatnonzero(empty.any(axis=0))[0])
        raise IdentificationError(
            f"{source}: marker {names[k]!r} is at exactly (0, 0, 0) in {int(empty[:, k].sum())} "
            'frames, as some programs write gaps: give zeros="gap" to read them as gaps'
        )
    return np.where(empty[..., None], np.nan, positions)


def _checked_axes(axes: Any) -> tuple[list[int], np.ndarray]:
    """Return columns and signs of the axes of the data that point right, forward and up."""
    words = axes if isinstance(axes, str) and re.fullmatch(AXES, axes) else ""
    signed = re.findall("(-?)([xyz])", words)
    columns = ["xyz".index(letter) for _, letter in signed]
    signs = np.array([-1.0 if minus else 1.0 for minus, _ in signed])
    turn = np.zeros((3, 3))
    if sorted(columns) == [0, 1, 2]:
        turn[range(3), columns] = signs
    if np.linalg.det(turn) < 0.5:
        needs = 'x, y and z in some order that is right-handed, such as "xyz", "zxy" or "-yxz"'
        raise IdentificationError(needed("axes", shown(axes).strip("'"), needs))
    return columns, signs
