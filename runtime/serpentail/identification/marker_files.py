"""``read_markers`` and ``write_markers``: marker tracks in TRC, CSV and C3D files."""

import csv
import io
from collections.abc import Callable
from os import PathLike
from pathlib import Path

import numpy as np

from ..basics.checks import refusal
from ..basics.errors import IdentificationError
from ..basics.files import replacing, without_quote, write_csv
from .c3d import read_c3d
from .tracks import MarkerTracks, RawTracks, checked_tracks, checked_unit

LARGEST = 2**30  # bytes of a file that is read
RATE_TOLERANCE = 0.02  # by how much the times may deviate from a stated rate


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
    except TypeError:
        raise refusal("data", path, "the path of a file", IdentificationError) from None
    reader = READERS.get(source.suffix.lower())
    if reader is None:
        raise IdentificationError(
            f"{source}: needs a file whose name ends in {', '.join(READERS)}, or arrays: "
            "serpentail.marker_tracks"
        )
    try:
        if source.exists() and not source.is_file():
            raise IdentificationError(f"{source}: is no regular file: needs one")
        if source.stat().st_size > LARGEST:
            raise IdentificationError(f"{source}: larger than {LARGEST} bytes: cut it into trials")
        raw = reader(source)
    except OSError as error:
        raise IdentificationError(f"{source}: cannot be read ({error})") from error
    if raw.unit is None:
        raw = RawTracks(raw.times, raw.positions, raw.names, unit)
    elif unit is not None:
        stated = checked_unit(raw.unit, str(source))
        if checked_unit(unit, str(source)) != stated:
            raise IdentificationError(
                f"{source}: unit: value {unit!r}: the file states {stated}: leave unit out"
            )
    return checked_tracks(raw, axes, zeros, str(source))


def _lines(source: Path) -> list[str]:
    """Return the lines of a text file."""
    try:
        return source.read_text(encoding="utf-8-sig").splitlines()
    except UnicodeDecodeError as error:
        raise IdentificationError(f"{source}: is not a text file ({error.reason})") from error


def _read_trc(source: Path) -> RawTracks:
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

    # the frames: number, time, and coordinates of all markers
    rows = [(k, line) for k, line in enumerate(lines[5:], 6) if line.strip()]
    cells = [_numbers(source, k, line.split("\t"), 2 + 3 * count) for k, line in rows]
    if len(cells) != frames or not frames:
        raise IdentificationError(
            f"{source}: has {len(cells)} frames, its header says {frames}: the file is cut off, or "
            "its header is wrong"
        )
    table = np.array(cells)
    _check_rate(source, table[:, 1], header.get("DataRate"))
    positions = table[:, 2:].reshape(frames, count, 3)
    return RawTracks(table[:, 1], positions, names, header["Units"])


def _whole(source: Path, header: dict[str, str], key: str) -> int:
    """Return a whole number of a header."""
    try:
        return int(header[key])
    except ValueError:
        needs = "a whole number"
        raise refusal(f"{source}: {key}", header[key], needs, IdentificationError) from None


def _check_rate(source: Path, times: np.ndarray, stated: str | None) -> None:
    """IdentificationError if the times do not have the rate that the file states."""
    try:
        rate = float(stated or "nan")
    except ValueError:
        return
    with np.errstate(over="ignore", invalid="ignore"):  # of times that are refused later
        spans = np.diff(times)
    if np.isfinite(rate) and len(spans) and np.isfinite(spans).all() and (spans > 0).all():
        measured = 1 / float(np.median(spans))
        if abs(measured - rate) > RATE_TOLERANCE * abs(rate):
            raise IdentificationError(
                f"{source}: DataRate is {rate:g} Hz, but the times have {measured:g} Hz: "
                "correct one"
            )


def _numbers(source: Path, line: int, cells: list[str], count: int) -> list[float]:
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


def _read_csv(source: Path) -> RawTracks:
    """Read a CSV file with a line of names."""
    try:
        rows = list(csv.reader(io.StringIO("\n".join(_lines(source)))))
    except csv.Error as error:
        raise IdentificationError(f"{source}: cannot be read as CSV ({error})") from None
    heads = [without_quote(head.strip()) for head in rows[0]] if rows else []
    names = [head[:-2] for head in heads[1::3]]
    if heads != _csv_heads(names) or not names:
        raise IdentificationError(
            f"{source}: line 1 needs time,NAME_x,NAME_y,NAME_z,... of each marker in turn"
        )
    cells = [_numbers(source, k, row, len(heads)) for k, row in enumerate(rows[1:], 2) if row]
    table = np.array(cells).reshape(-1, len(heads))
    return RawTracks(table[:, 0], table[:, 1:].reshape(len(table), len(names), 3), names, None)


def _csv_heads(names: list[str] | tuple[str, ...]) -> list[str]:
    """Return the names of the columns of a CSV file."""
    return ["time", *(f"{name}_{axis}" for name in names for axis in "xyz")]


READERS: dict[str, Callable[[Path], RawTracks]] = {
    ".trc": _read_trc,
    ".csv": _read_csv,
    ".c3d": read_c3d,
}


def write_markers(tracks: MarkerTracks, path: str | PathLike[str]) -> Path:
    """Write marker tracks to a file that ``read_markers`` reads; gaps are empty cells.

    Parameters
    ----------
    tracks : MarkerTracks
        The tracks.
    path : str or path
        A .trc file, written in mm, or a .csv file, written in m.

    Returns
    -------
    Path
        The path of the file, which is written whole or not at all.

    Raises
    ------
    IdentificationError
        The suffix is another one.
    NotWritten
        The file cannot be written.
    """
    target = Path(path)
    if target.suffix not in (".trc", ".csv"):
        raise refusal("path", str(path), "a name ending in .trc or .csv", IdentificationError)
    if target.suffix == ".csv":
        rows = zip(tracks.times, tracks.positions, strict=True)
        frames = ([f"{t:.9g}", *_cells(row)] for t, row in rows)
        return write_csv(target, [_csv_heads(tracks.names), *frames])
    lines = _trc_lines(tracks, target.name)
    with replacing(target) as part:
        part.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return target


def _trc_lines(tracks: MarkerTracks, name: str) -> list[str]:
    """Return the lines of a TRC file."""
    frames, count = tracks.seen.shape
    rate = f"{1 / np.median(np.diff(tracks.times)):.6g}"
    header = {"DataRate": rate, "CameraRate": rate, "NumFrames": str(frames)}
    header |= {"NumMarkers": str(count), "Units": "mm", "OrigDataRate": rate}
    header |= {"OrigDataStartFrame": "1", "OrigNumFrames": str(frames)}
    names = [cell for each in tracks.names for cell in (each, "", "")]
    axes = [f"{axis}{k + 1}" for k in range(count) for axis in "XYZ"]
    rows = [
        [str(k + 1), f"{t:.9g}", *_cells(1e3 * row)]
        for k, (t, row) in enumerate(zip(tracks.times, tracks.positions, strict=True))
    ]
    head = [["PathFileType", "4", "(X/Y/Z)", name], list(header), list(header.values())]
    head += [["Frame#", "Time", *names], ["", "", *axes]]
    return ["\t".join(cells) for cells in (*head, *rows)]


def _cells(row: np.ndarray) -> list[str]:
    """Return numbers to a hundredth of a micrometre and finer, empty in gaps."""
    return ["" if np.isnan(x) else f"{x:.8g}" for x in row.ravel()]
