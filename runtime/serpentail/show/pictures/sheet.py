"""The sheet of a filmstrip: the places of its panels, of its key and of the path."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .style import Array, Axes, Figure

GAP, LEFT, TITLES = 0.06, 0.72, 0.24  # margins, inches
RULER, TICKS = 0.62, 0.42  # margins at the left of and below the path, inches
KEY_LINE, KEY_COLUMN = 0.17, 1.55  # a mark of the key, inches
LEAST_WIDTH, MOST_WIDTH = 6.4, 10.0  # of all panels, inches
TALLEST_PATH = 3.2  # panel of the path below a film, inches


@dataclass(frozen=True)
class Sheet:
    """A filmstrip's sheet, in inches."""

    frames: int
    column: float  # width of a panel
    rows: tuple[float, ...]  # heights of the panels, from above
    marks: int  # of the key
    path: float | None  # aspect of the path's panel, if there is one

    @property
    def per_line(self) -> int:
        """Frames on a line."""
        most = max(1, int((MOST_WIDTH + GAP) / (self.column + GAP)))
        return math.ceil(self.frames / math.ceil(self.frames / most))

    @property
    def line(self) -> float:
        """Height of a line: titles and rows."""
        return TITLES + sum(self.rows) + GAP * len(self.rows)

    @property
    def film(self) -> tuple[float, float]:
        """Width and height of all lines."""
        lines = math.ceil(self.frames / self.per_line)
        return self.per_line * (self.column + GAP) - GAP, lines * self.line

    @property
    def beside(self) -> bool:
        """Whether the path is beside the film, if there is room, not below it."""
        return self.path is not None and self.path < 1.6 and self.film[1] > 2

    @property
    def path_size(self) -> tuple[float, float]:
        """Width and height of the path's panel."""
        if self.path is None:
            return 0.0, 0.0
        tall = min(TALLEST_PATH, max(self.film[0], 4.0) / self.path)
        tall = self.film[1] - TITLES - TICKS if self.beside else tall
        return tall * self.path, tall

    @property
    def key_columns(self) -> int:
        """Marks of the key side by side."""
        return max(1, int((max(self.film[0], LEAST_WIDTH) - 1.0) / KEY_COLUMN))

    @property
    def foot(self) -> float:
        """Height of the key."""
        return 0.12 + KEY_LINE * math.ceil(self.marks / self.key_columns)

    @property
    def base(self) -> float:
        """Height of the film's lower edge on the sheet."""
        below = self.path is not None and not self.beside
        return self.foot + (TICKS + GAP + self.path_size[1] if below else 0.0)

    @property
    def size(self) -> tuple[float, float]:
        """Width and height of the sheet."""
        reach = RULER + self.path_size[0] if self.beside else 0
        return LEFT + max(self.film[0] + reach, LEAST_WIDTH) + 3 * GAP, self.base + self.film[1]

    def add(self, figure: Figure, place: Sequence[float]) -> Axes:
        """Axes at (x, y, w, h) inches."""
        (width, height), (x, y, w, h) = self.size, place
        return figure.add_axes((x / width, y / height, w / width, h / height))

    def panel(self, k: int, row: int) -> tuple[float, float, float, float]:
        """Place of frame k's panel in a row of its line."""
        line, column = divmod(k, self.per_line)
        top = self.base + self.film[1] - line * self.line - TITLES
        y = top - sum(self.rows[: row + 1]) - row * GAP
        return LEFT + column * (self.column + GAP), y, self.column, self.rows[row]

    def path_panel(self) -> tuple[float, float, float, float]:
        """Place of the path panel."""
        x = LEFT + self.film[0] + RULER if self.beside else LEFT
        return x, self.foot + TICKS, *self.path_size


def sheet_of(frames: int, windows: Sequence[Array], marks: int, path: float | None) -> Sheet:
    """Return the sheet of panels for windows of equal widths, one for each row, at one scale."""
    sizes = np.array([window[1] - window[0] for window in windows])
    wide = sizes[0, 0]
    column = min(max(1.4 * math.sqrt(wide / sizes[:, 1].max()), 0.85), 1.9)
    return Sheet(frames, column, tuple(column * sizes[:, 1] / wide), marks, path)
