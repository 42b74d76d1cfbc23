"""``read_markers``: reads marker tracks from TRC, CSV and C3D files."""

import csv
import io
from collections.abc import Callable
from os import PathLike
from pathlib import Path

import numpy as np

from ..basics.errors import IdentificationError
from ..basics.files import without_quote
from .c3d import read_c3d
from .tracks import MarkerTracks, checked_tracks, checked_unit

LARGEST = 2**30  # bytes of a file that is read
RATE_TOLERANCE = 0.02  # by how much the times may deviate from a stated rate
AXES = "^(-?[xyz]){3}$"
Read = tuple[np.ndarray, np.ndarray, list[str], str | None]  # times, positions, names, unit


def read_markers(
    path: str | PathLike[str],
    unit: str | None = None,
    *,
    axes: str = "xyz",
    zeros: str = "refuse",
) -> MarkerTracks:
    """Read marker tracks from a TRC, CSV or C3D file, which may be damaged or from a stranger.

    Parameters
    ----------
    path : str or path
        The file. C3D needs the extra "c3d".
    unit : str, optional
        Unit of a file that states none, such as a CSV file. If the file states a unit, it must
        be the same.
    axes, zeros : str
        As of ``marker_tracks``.

    Returns
    -------
    MarkerTracks
        The tracks.

    Raises
    ------
    IdentificationError
        The file cannot be read; the message names the line.
    ExtraMissing
        A C3D file is read without the extra "c3d".

    Notes
    -----
    The first line of a CSV file names the columns: ``time``, then ``NAME_x``, ``NAME_y`` and
    ``NAME_z`` of each marker. Empty cells and nan are gaps.

    Examples
    --------
    >>> tracks = st.read_markers("flight.csv", unit="mm", axes="zxy")  # doctest: +SKIP
    """
    try:
        source = Path(path)
        known = source.suffix.lower()
    except TypeError:
        raise IdentificationError(f"data: value {path!r:.60}: needs the path of a file") from None
    if known not in READERS:
        raise IdentificationError(
            f"{source}: needs a file whose name ends in {', '.join(READERS)}, or arrays: "
            "serpentail.marker_tracks"
        )
    try:
        if source.exists() and not source.is_file():
            raise IdentificationError(f"{source}: is no regular file: needs one")
        if source.stat().st_size > LARGEST:
            raise IdentificationError(f"{source}: larger than {LARGEST} bytes: cut it into trials")
        times, positions, names, stated = READERS[known](source)
    except OSError as error:
        raise IdentificationError(f"{source}: cannot be read ({error})") from error
    if stated is not None:
        stated = checked_unit(stated, str(source))
        if unit is not None and checked_unit(unit, str(source)) != stated:
            raise IdentificationError(
                f"{source}: unit: value {unit!r}: the file states {stated}: leave unit out"
            )
    return checked_tracks(times, positions, names, (stated or unit, axes, zeros), str(source))


def _lines(source: Path) -> list[str]:
    """Return the lines of a text file."""
    try:
        return source.read_text(encoding="utf-8-sig").splitlines()
    except UnicodeDecodeError as error:
        raise IdentificationError(f"{source}: is not a text file ({error.reason})") from error


def _trc(source: Path) -> Read:
    """Read a TRC file: three lines of header, two of names, then frames."""
    lines = _lines(source)
    if len(lines) < 6 or not lines[0].startswith("PathFileType"):
        raise IdentificationError(
            f"{source}: is not a complete TRC file: its first line needs PathFileType"
        )
    header = dict(zip(lines[1].split("\t"), lines[2].split("\t"), strict=False))
    header = {key.strip(): value.strip() for key, value in header.items()}
    lacking = [key for key in ("NumFrames", "NumMarkers", "Units") if key not in header]
    if lacking:
        raise IdentificationError(f"{source}: line 3 has no {lacking[0]}: is the header complete?")
    names = [name.strip() for name in lines[3].split("\t")[2:] if name.strip()]
    count, frames = (_whole(source, header, key) for key in ("NumMarkers", "NumFrames"))
    if len(names) != count:
        raise IdentificationError(
            f"{source}: line 4 names {len(names)} markers, NumMarkers is {count}"
        )
    rows = [(k, line) for k, line in enumerate(lines[5:], 6) if line.strip()]
    cells = [_cells(source, k, line.split("\t"), 2 + 3 * count) for k, line in rows]
    if len(cells) != frames or not frames:
        raise IdentificationError(
            f"{source}: has {len(cells)} frames, its header says {frames}: the file is cut off, or "
            "its header is wrong"
        )
    table = np.array(cells)
    _check_rate(source, table[:, 1], header.get("DataRate"))
    return table[:, 1], table[:, 2:].reshape(frames, count, 3), names, header["Units"]


def _whole(source: Path, header: dict[str, str], key: str) -> int:
    """Return a whole number of a header."""
    try:
        return int(header[key])
    except ValueError:
        raise IdentificationError(
            f"{source}: {key}: value {header[key]!r:.40}: needs a whole number"
        ) from None


def _check_rate(source: Path, times: np.ndarray, stated: str | None) -> None:
    """IdentificationError if the times do not have the rate that the file states."""
    try:
        rate = float(stated or "nan")
    except ValueError:
        return
    with np.errstate(over="ignore", invalid="ignore"):  # of times that are refused later
        spans = np.diff(times)
    if np.isfinite(rate) and len(spans) and np.isfinite(spans).all() and (spans > 0).all():
        found = 1 / float(np.median(spans))
        if abs(found - rate) > RATE_TOLERANCE * abs(rate):
            raise IdentificationError(
                f"{source}: DataRate is {rate:g} Hz, but the times have {found:g} Hz: correct one"
            )


def _cells(source: Path, line: int, cells: list[str], count: int) -> list[float]:
    """Return the numbers of a line, nan in empty cells; IdentificationError if some are missing."""
    cells = [cell.strip() for cell in cells]
    while len(cells) > count and not cells[-1]:
        cells.pop()
    if len(cells) != count:
        raise IdentificationError(
            f"{source}: line {line} has {len(cells)} of {count} columns: is the file cut off?"
        )
    try:
        return [float(cell) if cell else np.nan for cell in cells]
    except ValueError as error:
        raise IdentificationError(f"{source}: line {line}: {error!s:.80}") from None


def _csv(source: Path) -> Read:
    """Read a CSV file with a line of names."""
    try:
        rows = list(csv.reader(io.StringIO("\n".join(_lines(source)))))
    except csv.Error as error:
        raise IdentificationError(f"{source}: cannot be read as CSV ({error})") from None
    heads = [without_quote(head.strip()) for head in rows[0]] if rows else []
    names = [head[:-2] for head in heads[1::3]]
    wanted = ["time", *(f"{name}_{axis}" for name in names for axis in "xyz")]
    if heads != wanted or not names:
        raise IdentificationError(
            f"{source}: line 1 needs time,NAME_x,NAME_y,NAME_z,... of each marker in turn"
        )
    cells = [_cells(source, k, row, len(heads)) for k, row in enumerate(rows[1:], 2) if row]
    table = np.array(cells).reshape(-1, len(heads))
    return table[:, 0], table[:, 1:].reshape(len(table), len(names), 3), names, None


READERS: dict[str, Callable[[Path], Read]] = {".trc": _trc, ".csv": _csv, ".c3d": read_c3d}
