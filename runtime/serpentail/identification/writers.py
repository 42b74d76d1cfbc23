"""``write_markers``: writes marker tracks to TRC and CSV files."""

from os import PathLike
from pathlib import Path

import numpy as np

from ..basics.errors import IdentificationError
from ..basics.files import replacing, write_csv
from .tracks import MarkerTracks


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
        raise IdentificationError(f"path: value {str(path)!r}: needs a name ending in .trc or .csv")
    if target.suffix == ".csv":
        return write_csv(target, _csv(tracks))
    lines = _trc(tracks, target.name)
    with replacing(target) as part:
        part.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return target


def _trc(tracks: MarkerTracks, name: str) -> list[str]:
    """Return the lines of a TRC file."""
    frames, count = tracks.seen.shape
    rate = f"{1 / np.median(np.diff(tracks.times)):.6g}"
    axes = [f"{axis}{k + 1}" for k in range(count) for axis in "XYZ"]
    names = [cell for each in tracks.names for cell in (each, "", "")]
    head = "DataRate CameraRate NumFrames NumMarkers Units OrigDataRate OrigDataStartFrame "
    head += "OrigNumFrames"
    values = [rate, rate, str(frames), str(count), "mm", rate, "1", str(frames)]
    return [
        f"PathFileType\t4\t(X/Y/Z)\t{name}",
        "\t".join(head.split()),
        "\t".join(values),
        "\t".join(["Frame#", "Time", *names]),
        "\t".join(["", "", *axes]),
        *(
            "\t".join([str(k + 1), f"{t:.9g}", *_cells(1e3 * row)])
            for k, (t, row) in enumerate(zip(tracks.times, tracks.positions, strict=True))
        ),
    ]


def _csv(tracks: MarkerTracks) -> list[list[str]]:
    """Return the rows of a CSV file."""
    head = ["time", *(f"{name}_{axis}" for name in tracks.names for axis in "xyz")]
    rows = zip(tracks.times, tracks.positions, strict=True)
    return [head, *([f"{t:.9g}", *_cells(row)] for t, row in rows)]


def _cells(row: np.ndarray) -> list[str]:
    """Return numbers to a hundredth of a micrometre and finer, empty in gaps."""
    return ["" if np.isnan(x) else f"{x:.8g}" for x in row.ravel()]
