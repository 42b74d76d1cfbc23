"""Draws what turned the torso over time: a panel for each of its axes."""

import os
from typing import TYPE_CHECKING, Any

import numpy as np

from ...basics.extras import needed
from ..shares import AXES, SUM, MomentumShares
from .panels import Panel, colour_of
from .plot import stacked
from .style import INK, drawn

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def shares_figure(
    shares: MomentumShares, path: str | os.PathLike[str] | None
) -> tuple["Figure", Any]:
    """Draw turns by cause and their sum, about the axes that the torso turns about."""
    needed("matplotlib", "plot")
    names = [*shares.turns, SUM]
    styles = [*((colour_of(k), "-") for k in range(len(shares.turns))), (INK, "--")]
    curves = np.degrees([*shares.turns.values(), shares.turned])
    panels = [
        Panel(f"turned about\n{axis} axis [deg]", curves[..., k].T, names, styles, 1.0)
        for k, axis in enumerate(AXES)
    ]
    moving = [panel for panel in (each.without_still() for each in panels) if panel.names]
    return drawn(lambda: stacked([shares.motion], moving or panels[:1]), path)
