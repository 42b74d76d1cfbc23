"""Figures of results over time: residuals of an identification, and what turned the torso."""

import os
from typing import Any

import numpy as np

from ...basics.extras import needed
from ...motion.trajectory import Trajectory
from ..shares import AXES, SUM, MomentumShares
from .panels import Panel, colour_of, of_segments, torque
from .plot import labelled, stacked
from .style import INK, QUIET, Array, Figure, drawn

Residuals = tuple[tuple[str, ...], Array, float]  # names, (F, M, 3) m, noise m
Bands = tuple[Array, Array, Array, float] | None  # times (U,), low and high (U, 2m), probability
ROOM = 0.3  # of a panel, for its legend


def residual_figure(
    motion: Trajectory,
    residuals: Residuals,
    bands: Bands = None,
    path: str | os.PathLike[str] | None = None,
) -> tuple[Figure, Any]:
    """Draw distances of seen from modelled markers, torques with their intervals, and power.

    path: also write the figure to this .pdf, .png or .svg file.  ExtraMissing without the extra
    "plot".
    """
    needed("matplotlib", "plot")
    return drawn(lambda: _figure(motion, residuals, bands), path)


def _figure(motion: Trajectory, residuals: Residuals, bands: Bands) -> tuple[Figure, Any]:
    """A figure of three panels on one time axis."""
    from matplotlib import colormaps

    names, off, noise = residuals
    distances = 1e3 * np.linalg.norm(off, axis=2)
    colours = colormaps["viridis"](np.linspace(0, 0.9, len(names)))
    tau = torque(motion, None)
    coordinates, styles, order = of_segments(motion)
    rates = motion.v[:, -motion.tau.shape[1] :][:, order]
    power = Panel("power\n[mW]", tau.curves * rates, coordinates, styles, 0.01)
    dots = [(colour, ".") for colour in colours]
    usual = 1e3 * noise * np.sqrt(3)
    key = [(f"rms of noise: {usual:.2g} mm", (QUIET, "-"))]
    off_by = Panel("residual\n[mm]", distances, names, dots, 0.1, key)
    figure, every = stacked([motion], [off_by, tau, power])
    every[0].axhline(usual, color=QUIET, linewidth=0.8, zorder=0.5)
    if bands is not None:
        times, low, high, probability = bands
        shown = np.stack([np.interp(times, motion.t, row) for row in rates.T], axis=1)
        ends = 1e3 * np.stack([low[:, order], high[:, order]])
        for axes, pair in ((every[1], ends), (every[2], np.sort(ends * shown, axis=0))):
            for k, (colour, _) in enumerate(styles):
                shade = {"color": colour, "alpha": 0.2, "linewidth": 0}
                label = None if k else f"{100 * probability:g} %"
                axes.fill_between(times, pair[0, :, k], pair[1, :, k], label=label, **shade)
            least, most = float(pair.min()), float(pair.max())
            axes.set_ylim(least, least + (most - least) / (1 - ROOM))
            labelled(axes, len(styles) + 1)
    return figure, every


def shares_figure(
    shares: MomentumShares, path: str | os.PathLike[str] | None
) -> tuple[Figure, Any]:
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
