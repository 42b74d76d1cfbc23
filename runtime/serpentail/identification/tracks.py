"""``MarkerTracks``: positions of markers over time, nan if a marker was not seen."""

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
from ..basics.plausible_values import LARGEST
from ..motion.text import framed

UNITS: dict[str, Fraction] = MEASURES["m"][1]
ZEROS = ("refuse", "gap")
FEWEST = 4  # frames
FARTHEST = 1e6  # m from the origin, in any recording
LATEST = 1e12  # s: times since 1970, and more


@dataclass(frozen=True, eq=False)
class MarkerTracks:
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
    return checked_tracks(times, positions, names, (unit, axes, zeros), "arrays")


def checked_tracks(
    times: Any, positions: Any, names: Any, how: tuple[Any, Any, Any], source: str
) -> MarkerTracks:
    """Return tracks of arrays after checking them; how: unit, axes, zeros; source: for errors."""
    unit, axes, zeros = how
    unit = checked_unit(unit, source)
    t = checked_times(times, source)
    names = checked_names(names, source)
    where = real_array(f"{source}: positions", positions, IdentificationError)
    if where.shape != (len(t), len(names), 3):
        raise IdentificationError(
            f"{source}: positions have shape {where.shape}: needs ({len(t)}, {len(names)}, 3), "
            "of times, names and x, y, z"
        )
    if np.isinf(where).any():
        raise IdentificationError(f"{source}: positions: a value is infinite: use nan for a gap")
    one_of("zeros", zeros, ZEROS, IdentificationError)
    where = without_zeros(where, names, zeros, source)
    columns, signs = checked_axes(axes)
    where = where[..., columns] * signs * float(UNITS[unit])
    part = np.isfinite(where)
    where = np.where(part.all(axis=2, keepdims=True), where, np.nan)
    unseen = [name for k, name in enumerate(names) if not part[:, k].all(axis=-1).any()]
    if unseen:
        raise IdentificationError(f"{source}: never seen: {', '.join(unseen)}: leave these out")
    far, line = _farthest(where, names, source)
    if far > FARTHEST:
        raise IdentificationError(line)
    if far > LARGEST["m"][0]:
        warnings.warn(line, UnusualSize, stacklevel=3)
    return MarkerTracks(t, where, names, source, unit)


def _farthest(where: np.ndarray, names: Sequence[str], source: str) -> tuple[float, str]:
    """Return the largest coordinate (m), and a line that says it is beyond what is usual."""
    reach = np.abs(where)
    place = np.unravel_index(np.nanargmax(reach), where.shape)
    frame, marker, axis = map(int, place)
    field = f"{source}: marker {shown(names[marker])}, frame {frame} (from 0), {'xyz'[axis]}"
    line = (
        f"{field}: value {where[place]:.6g} m: beyond {LARGEST['m'][1]}, which no recording has: "
        'give the right unit, such as unit="mm", or nan for a gap'
    )
    return float(reach[place]), line


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


def checked_times(times: Any, source: str) -> np.ndarray:
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


def checked_names(names: Any, source: str) -> tuple[str, ...]:
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


def without_zeros(where: np.ndarray, names: Sequence[str], zeros: str, source: str) -> np.ndarray:
    """Return positions with nan in place of exact zeros, or refuse them."""
    empty = (where == 0).all(axis=2)
    if not empty.any():
        return where
    if zeros == "refuse":
        k = int(np.flatnonzero(empty.any(axis=0))[0])
        raise IdentificationError(
            f"{source}: marker {names[k]!r} is at exactly (0, 0, 0) in {int(empty[:, k].sum())} "
            'frames, as some programs write gaps: give zeros="gap" to read them as gaps'
        )
    return np.where(empty[..., None], np.nan, where)


def checked_axes(axes: Any) -> tuple[list[int], np.ndarray]:
    """Return columns and signs of the axes of the data that point right, forward and up."""
    words = axes if isinstance(axes, str) else ""
    columns: list[int] = []
    signs: list[float] = []
    sign = 1.0
    for letter in words:
        if letter == "-" and sign > 0:
            sign = -1.0
        elif letter in "xyz":
            columns.append("xyz".index(letter))
            signs.append(sign)
            sign = 1.0
        else:
            columns = []
            break
    turn = np.zeros((3, 3))
    if sorted(columns) == [0, 1, 2]:
        turn[range(3), columns] = signs
    if np.linalg.det(turn) < 0.5:
        needs = 'x, y and z in some order that is right-handed, such as "xyz", "zxy" or "-yxz"'
        raise IdentificationError(needed("axes", shown(axes).strip("'"), needs))
    return columns, np.array(signs)
