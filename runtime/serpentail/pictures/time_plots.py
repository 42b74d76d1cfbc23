"""Plots over time: attitude, tail, rates, energies and momenta of a motion on one time axis."""

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..attitude import pitch_roll_yaw
from ..model.layout import OMEGA
from ..motion.trajectory import Trajectory
from .style import INK, TAIL, Array, writable, write

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Okabe and Ito, dashed for grey prints
TRIPLE = (("#0072b2", "-"), ("#d55e00", "--"), ("#009e73", "-."))


@dataclass(frozen=True, eq=False)
class Panel:
    """One axis of the time plots, and the curves on it."""

    label: str
    curves: Array  # (K, n)
    names: Sequence[str]
    styles: Sequence[tuple[Any, str]]  # (colour, dash)
    span: float  # the least
    roots: bool = False  # a scale on which blows and weights are both seen


def time_plots(trajectory: Trajectory, path: str | os.PathLike[str]) -> Path:
    """Draw attitude, tail, rates, torques, energies and momenta over time; return the path."""
    if len(trajectory.t) < 2:
        raise ValueError("the trajectory has one sample: give at least two to draw over time")
    return write(writable(path), lambda: _draw_times(trajectory))


def _draw_times(trajectory: Trajectory) -> "Figure":
    """The stacked panels of the time plots."""
    from matplotlib.figure import Figure

    panels = _panels(trajectory)
    figure = Figure(figsize=(7.2, 0.5 + 1.2 * len(panels)), layout="constrained")
    every = figure.subplots(len(panels), 1, sharex=True, squeeze=False)[:, 0]
    for axes, panel in zip(every, panels, strict=True):
        _draw_panel(axes, trajectory.t, panel)
    every[-1].set(xlabel="time [s]", xlim=(trajectory.t[0], trajectory.t[-1]))
    figure.align_ylabels(every)
    return figure


def _draw_panel(axes: "Axes", t: Array, panel: Panel) -> None:
    """Curves, grid and a legend outside, at the right."""
    from matplotlib.ticker import MaxNLocator

    # curves
    for curve, name, (colour, dash) in zip(panel.curves.T, panel.names, panel.styles, strict=True):
        axes.plot(t, curve, dash, color=colour, label=name)

    # the axis
    low, high = float(panel.curves.min()), float(panel.curves.max())
    margin = 0.06 * (high - low) + max(0.0, panel.span - (high - low)) / 2
    axes.set(ylabel=panel.label, ylim=(low - margin, high + margin))
    if panel.roots:
        axes.set_yscale(
            "function",
            functions=(lambda x: np.sign(x) * np.sqrt(np.abs(x)), lambda x: np.sign(x) * x**2),
        )
        axes.set_ylim(0, max(panel.span, high) * 1.1)
    axes.grid(color="#e6e6e6", linewidth=0.6)
    axes.set_axisbelow(True)
    if "[deg]" in panel.label:
        axes.yaxis.set_major_locator(MaxNLocator(5, steps=[1, 1.5, 3, 4.5, 9, 10]))

    # the legend
    columns, size = 2 if len(panel.names) > 3 else 1, 7 if len(panel.names) < 10 else 6
    look = {"ncols": columns, "fontsize": size, "labelspacing": 0.3}
    axes.legend(loc="center left", bbox_to_anchor=(1.01, 0.5), **look)


def _panels(trajectory: Trajectory) -> list[Panel]:
    """What the time plots show."""
    angles = np.degrees(pitch_roll_yaw(trajectory.q, unwrap=True))
    energies = 1e3 * np.stack([trajectory.kinetic, trajectory.potential, trajectory.energy], axis=1)
    attitude = (r"pitch $\phi_x$", r"roll $\phi_y$", r"yaw $\phi_z$")
    rates = (r"$\omega_x$", r"$\omega_y$", r"$\omega_z$")
    world = ("right $x$", "forward $y$", "up $z$")
    return [
        Panel("attitude [deg]", angles, attitude, TRIPLE, 1.0),
        *_tail_panels(trajectory),
        *_ground_panels(trajectory),
        Panel("torso rate\n[rad/s]", trajectory.v[:, OMEGA], rates, TRIPLE, 0.1),
        Panel(
            "energy [mJ]",
            energies,
            ("kinetic", "potential", "total"),
            (*TRIPLE[:2], (INK, "-")),
            1.0,
        ),
        Panel("momentum\n[mN s]", 1e3 * trajectory.linear_momentum, world, TRIPLE, 1.0),
        Panel("angular mom.\n[mN m s]", 1e3 * trajectory.angular_momentum, world, TRIPLE, 0.01),
    ]


def _ground_panels(trajectory: Trajectory) -> list[Panel]:
    """Height of the torso and the ground's normal forces by groups; none in flight."""
    contact = trajectory.contact
    if contact is None:
        return []
    forces = np.stack(
        [contact.of(group).forces[..., 2].sum(axis=1) for group in contact.groups], axis=1
    )
    height = 1e3 * trajectory.q[:, 2:3]
    return [
        Panel("height [mm]", height, ("of B",), ((INK, "-"),), 1.0),
        Panel(
            "normal force\n[N]",
            forces,
            tuple(contact.groups),
            TRIPLE[: forces.shape[1]],
            1.0,
            roots=True,
        ),
    ]


def _tail_panels(trajectory: Trajectory) -> list[Panel]:
    """Tail coordinates and torques, a colour a segment, yaw dashed; none without a tail."""
    from matplotlib import colormaps

    segments = trajectory.segments
    if not segments:
        return []
    colours = (
        [TAIL] if segments == 1 else list(colormaps["viridis"](np.linspace(0, 0.85, segments)))
    )
    styles = [(colour, dash) for dash in ("-", "--") for colour in colours]
    names = [f"{bend} {i + 1}" for bend in ("pitch", "yaw") for i in range(segments)]
    order = [*range(0, 2 * segments, 2), *range(1, 2 * segments, 2)]
    angles, torques = np.degrees(trajectory.tail[:, order]), 1e3 * trajectory.tau[:, order]
    return [
        Panel("tail [deg]", angles, names, styles, 1.0),
        Panel("tail torque\n[mN m]", torques, names, styles, 0.01),
    ]
