"""The style that all drawings share, and how they are written."""

import io
import os
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ...basics.errors import ViewError
from ...basics.files import replacing

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
else:  # Matplotlib is an extra
    Axes = Figure = Any

Array = NDArray[np.float64]
METADATA: dict[str, dict[str, Any]] = {
    ".pdf": {"CreationDate": None},
    ".png": {},
    ".svg": {"Date": None},
}
DPI = 200
INK, QUIET, TORSO, TAIL, HEAD = "#222222", "#8c8c8c", "#c6e0f0", "#d55e00", "#0072b2"
LEG, FORCE = "#009e73", "#cc79a7"  # Okabe and Ito
# of runs, as in the page
SERIES = ("#0072b2", "#d55e00", "#00805d", "#b5508c", "#a86f00", "#3a8fc4", "#6b5bb5", "#555555")
SHADE, SHADOW = "#ecebe6", "#c9c7bf"  # the ground
STYLE: dict[str, Any] = {
    "svg.hashsalt": "serpentail",
    "font.size": 8,
    "axes.linewidth": 0.6,
    "axes.edgecolor": QUIET,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "lines.linewidth": 1.3,
    "lines.solid_capstyle": "round",
    "legend.frameon": False,
    "legend.handlelength": 2.2,
}
Drawn = tuple[Figure, Any]  # with its axes


def figure_path(path: str | os.PathLike[str]) -> Path:
    """Return the path of a figure; ViewError if its suffix is of no known format."""
    target = Path(path)
    if target.suffix.lower() not in METADATA:
        known = ", ".join(METADATA)
        raise ViewError(f"figure {str(path)!r} has suffix {target.suffix!r}: use one of {known}")
    return target


def drawn(draw: Callable[[], Drawn], path: str | os.PathLike[str] | None) -> Drawn:
    """Draw in the shared style; with a path, write the figure too, whole or not at all.

    The same figure gives the same bytes. ViewError is that of ``figure_path``.
    """
    from matplotlib import style

    kind = "" if path is None else figure_path(path).suffix.lower()
    with style.context(STYLE, after_reset=True):
        figure, axes = draw()
        if path is not None:
            picture = io.BytesIO()  # Matplotlib would hide a failed write, and leave its file open
            figure.savefig(picture, format=kind[1:], metadata=METADATA[kind], dpi=DPI)
            with replacing(Path(path)) as part:
                part.write_bytes(picture.getvalue())
    return figure, axes
