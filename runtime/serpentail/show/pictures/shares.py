"""Draws what turned the torso over time: a panel for each of its axes."""

import os
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from ...basics.extras import needed
from ...motion.trajectory import Trajectory
from .panels import Panel, colour_of
from .plot import stacked
from .style import INK, Array, drawn

if TYPE_CHECKING:
    from matplotlib.figure import Figure

AXES = ("pitch", "roll", "yaw")


def shares_figure(
    motion: Trajectory,
    turns: Mapping[str, Array],
    turned: Array,
    path: str | os.PathLike[str] | None = None,
) -> tuple["Figure", Any]:
    """Draw turns (K, 3), rad, by cause, and their sum, about the axes that the torso turns about.

    path: also write the figure to this .pdf, .png or .svg file.  ExtraMissing without the extra
    "plot".
    """
    needed("matplotlib", "plot")
    names = [*turns, "sum"]
    styles = [*((colour_of(k), "-") for k in range(len(turns))), (INK, "--")]
    curves = np.degrees([*turns.values(), turned])
    panels = [
        Panel(f"turned about\n{axis} axis [deg]", curves[..., k].T, names, styles, 1.0)
        for k, axis in enumerate(AXES)
    ]
    moving = [panel for panel in (each.without_still() for each in panels) if panel.names]
    return drawn(lambda: stacked([motion], moving or panels[:1]), path)
