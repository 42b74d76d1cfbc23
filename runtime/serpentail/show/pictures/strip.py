"""``Strip``: what a filmstrip or a moving film draws, and in which windows."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from .animal import FORCE, LEG
from .frames import LONGEST, Frame
from .page import drawn_points, of_equal_widths, window_around
from .style import HEAD, INK, QUIET, TAIL, Array
from .views import SIDE, View

HIGHEST = 4.0  # widths of a panel that a motion may rise for its panels to have the ground in them
DOT: dict[str, Any] = {"color": HEAD, "linestyle": "", "marker": "o", "markersize": 4}
KEY: dict[str, dict[str, Any]] = {
    "head": DOT,
    "head, far side": DOT | {"markerfacecolor": "white"},
    "back": {"color": INK, "linewidth": 1.4},
    "tail": {"color": TAIL, "linewidth": 1.4},
    "path of the COM": {"color": QUIET, "linestyle": ":"},
}
OF_TORSO = ("head", "head, far side", "back", "path of the COM")  # not drawn for a fixed base


@dataclass(frozen=True, eq=False)
class Strip:
    """What is drawn: for each motion its frames and the path (K, 3) of its centre of mass.

    names: of the motions, to tell them apart. grounded: there is ground at z = 0. largest: the
    largest force (N).
    """

    films: list[list[Frame]]
    coms: list[Array]
    views: list[View]
    names: list[str]
    grounded: bool
    largest: float

    def origin(self, frame: Frame) -> Array:
        """The world point at the middle of a frame's panels: over the ground its height is 0."""
        return frame.com * (1, 1, 0) if self.anchored else frame.com

    @cached_property
    def every(self) -> list[Frame]:
        """All frames."""
        return [frame for film in self.films for frame in film]

    @cached_property
    def anchored(self) -> bool:
        """Whether every panel shows the ground, because it is near enough."""
        reach = np.ptp(np.vstack([drawn_points(f, SIDE) - SIDE.of(f.com)[:2] for f in self.every]))
        return self.grounded and max(f.com[2] for f in self.every) < HIGHEST * reach

    def windows(self) -> list[Array]:
        """What the panels of each view show, about their origins."""
        found = []
        for view in self.views:
            shapes = [drawn_points(f, view) - view.of(self.origin(f))[:2] for f in self.every]
            if self.anchored and view.matrix[1, 2] > 0:
                shapes.append(np.array([[0.0, -0.02]]))
            found.append(window_around(shapes))
        return of_equal_widths(found)

    def key(self) -> dict[str, dict[str, Any]]:
        """What the marks mean."""
        legs = {"leg": {"color": LEG, "linewidth": 1.4}} if len(self.every[0].legs) else {}
        force = f"force, {1e3 * LONGEST:.0f} mm: {self.largest:.3g} N"
        forces = {force: {"color": FORCE, "linewidth": 1.4}} if self.largest else {}
        under = any(frame.lowest < -2e-3 for frame in self.every)
        pale: dict[str, Any] = {"color": TAIL, "linewidth": 1.4, "alpha": 0.3}
        below = {"below the ground": pale} if self.grounded and under else {}
        torsos = any(frame.body.marked for frame in self.every)
        own = {name: look for name, look in KEY.items() if torsos or name not in OF_TORSO}
        return own | legs | forces | below
