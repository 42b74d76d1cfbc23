"""The page of a film: where its panels are, and what part of the world each of them shows."""

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from .animal import SIDE, Frame, View, tick
from .style import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

GAP, LEFT, TITLES, FOOT, RULER = 0.06, 0.62, 0.26, 0.5, 0.62  # page margins, inches
LEAST_WIDTH = 6.6  # of the page, for the key, inches
TALLEST_PATH = 3.2  # panel of the path below a film, inches
MOST_PER_LINE = 6  # frames


@dataclass(frozen=True)
class Page:
    """A film's page, in inches."""

    frames: int
    column: float  # width of a panel
    rows: tuple[float, float]  # heights of the side and top views
    path: tuple[float, float] | None  # width and height of the path's panel, if any
    beside: bool  # the film, not below it

    @property
    def per_line(self) -> int:
        """Frames on a line."""
        return math.ceil(self.frames / math.ceil(self.frames / MOST_PER_LINE))

    @property
    def film(self) -> tuple[float, float]:
        """Width and height of all lines."""
        lines = math.ceil(self.frames / self.per_line)
        return self.per_line * (self.column + GAP) - GAP, lines * (TITLES + GAP + sum(self.rows))

    @property
    def base(self) -> float:
        """Height of the film's lower edge on the page."""
        return FOOT + (0 if self.path is None or self.beside else self.path[1] + FOOT)

    @property
    def size(self) -> tuple[float, float]:
        """Width and height of the page."""
        reach = RULER + self.path[0] if self.path is not None and self.beside else 0
        width = LEFT + max(self.film[0] + reach, LEAST_WIDTH)
        return width + 3 * GAP, self.base + self.film[1] + GAP

    def add(self, figure: "Figure", place: Sequence[float]) -> "Axes":
        """Axes at (x, y, w, h) inches."""
        (width, height), (x, y, w, h) = self.size, place
        return figure.add_axes((x / width, y / height, w / width, h / height))

    def panel(self, k: int, row: int) -> tuple[float, float, float, float]:
        """Place of frame k's panel in the upper (0) or lower (1) row of its line."""
        line, column = divmod(k, self.per_line)
        line_top = self.base + self.film[1] - line * (TITLES + GAP + sum(self.rows))
        top = line_top - TITLES - self.rows[0]
        x, y = LEFT + column * (self.column + GAP), top - row * (GAP + self.rows[1])
        return x, y, self.column, self.rows[row]

    def path_panel(self) -> tuple[float, float, float, float]:
        """Place of the path panel."""
        width, height = self.path or (0, 0)
        return (LEFT + self.film[0] + RULER if self.beside else LEFT), FOOT, width, height


def drawn_points(frame: Frame, view: View) -> Array:
    """Everything a frame shows, as points (n, 2) in a view."""
    lines = np.vstack([frame.tail, frame.world(tick(frame.body)), *frame.legs])
    return np.vstack([frame.outline(view), view.of(lines)[:, :2]])


def window_around(shapes: list[Array], margin: float = 0.012) -> Array:
    """Lower and upper corner (2, 2) of a box around all shapes."""
    every = np.vstack(shapes)
    return np.array([every.min(axis=0) - margin, every.max(axis=0) + margin])


def page_of(film: list[Frame], windows: list[Array], com: Array) -> Page:
    """Sizes from the windows; the path's panel is beside the film, below it or left out."""
    # panels that show their windows at one scale
    (wide, high), (_, deep) = (window[1] - window[0] for window in windows)
    column = min(max(1.4 * math.sqrt(wide / high), 1.35), 1.9)
    alone = Page(len(film), column, (column * high / wide, column * deep / wide), None, False)

    # no path where the COM stays within half a torso's length
    if np.ptp(com[:, 1:], axis=0).max() < max(film[0].body.semi_axes):
        return alone

    # beside the film where there is room for it
    low, up = path_window(film, com)
    aspect = float((up - low)[0] / (up - low)[1])
    beside = aspect < 1.6 and alone.per_line >= 4
    tall = alone.film[1] - TITLES if beside else min(TALLEST_PATH, max(alone.film[0], 4.0) / aspect)
    return dataclasses.replace(alone, path=(tall * aspect, tall), beside=beside)


def path_window(film: list[Frame], com: Array) -> Array:
    """The corners (2, 2) of the path panel."""
    return window_around([*(drawn_points(frame, SIDE) for frame in film), SIDE.of(com)[:, :2]])
