"""Draws the results of an identification over time: residuals of markers, torques and power."""

import os
from typing import TYPE_CHECKING, Any

import numpy as np

from ..extras import needed
from ..motion.trajectory import Trajectory
from .style import Array, drawn

if TYPE_CHECKING:
    from matplotlib.figure import Figure

WIDTH, ROW = 7.2, 1.9  # inches
Residuals = tuple[tuple[str, ...], Array, float]  # names, (F, M, 3) m, noise m
Bands = tuple[Array, Array, Array] | None  # times (U,), low and high (U, 2m)


def residual_figure(
    motion: Trajectory,
    residuals: Residuals,
    bands: Bands = None,
    path: str | os.PathLike[str] | None = None,
) -> tuple["Figure", Any]:
    """Draw distances of seen from modelled markers, torques with their intervals, and power.

    path: also write the figure to this .pdf, .png or .svg file.  ExtraMissing without the extra
    "plot".
    """
    needed("matplotlib", "plot")
    return drawn(lambda: _figure(motion, residuals, bands), path)


def _figure(motion: Trajectory, residuals: Residuals, bands: Bands) -> tuple["Figure", Any]:
    """A figure of three panels on one time axis."""
    from .figure import Drawing

    names, off, noise = residuals
    figure = Drawing(figsize=(WIDTH, 3 * ROW), layout="constrained")
    every = figure.subplots(3, 1, sharex=True)
    for name, each in zip(names, np.moveaxis(np.linalg.norm(off, axis=2), 1, 0), strict=True):
        every[0].plot(motion.t, 1e3 * each, ".", markersize=3, label=name)
    every[0].axhline(1e3 * noise * np.sqrt(3), color="#999999", linewidth=0.8)
    every[0].set_ylabel("residual [mm]")
    # torques, and the power of each
    coordinates = range(motion.tau.shape[1])
    rates = motion.v[:, -motion.tau.shape[1] :]
    for k in coordinates:
        (line,) = every[1].plot(motion.t, 1e3 * motion.tau[:, k], label=f"tail coordinate {k}")
        if bands is not None:
            times, low, high = bands
            shade = {"color": line.get_color(), "alpha": 0.2, "linewidth": 0}
            every[1].fill_between(times, 1e3 * low[:, k], 1e3 * high[:, k], **shade)
        every[2].plot(motion.t, 1e3 * motion.tau[:, k] * rates[:, k])
    every[1].set_ylabel("torque [mN m]")
    every[2].set_ylabel("power [mW]")
    every[2].set(xlabel="time [s]", xlim=(motion.t[0], motion.t[-1]))
    for axes in every:
        axes.grid(color="#e6e6e6", linewidth=0.6)
    for axes in every[:2]:
        axes.legend(loc="upper right", fontsize=6, ncols=4)
    figure.align_ylabels(every)
    return figure, every
