"""What can be drawn over time of a motion: each panel's curves, in units that are read easily."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from serpentail_scene.layout import OMEGA

from ...basics.attitude import pitch_roll_yaw, tilt_deg
from ...model.model import Model
from ...motion.trajectory import Trajectory
from ..animal import bends
from .style import INK, SERIES, TAIL, Array

# Okabe and Ito, dashed for grey prints
TRIPLE = (("#0072b2", "-"), ("#d55e00", "--"), ("#009e73", "-."))
WORLD = ("right $x$", "forward $y$", "up $z$")
SINGULAR = 0.15  # |cos(pitch)| below which roll and yaw are not drawn: 9 degrees about the vertical
SEEN = 1e-3  # of a panel's least span
DASHES = ("-", "--", "-.", ":")  # of the curves of several runs
Style = tuple[Any, str]  # colour, dash


@dataclass(frozen=True, eq=False)
class Panel:
    """One axis, the curves on it, and what else the legend has; curves of several runs have gaps.

    A name that begins with "_" is not in the legend.
    """

    label: str
    curves: Array  # (K, n)
    names: Sequence[str]
    styles: Sequence[Style]
    span: float  # the least
    key: Sequence[tuple[str, Style]] = ()

    def without_still(self) -> "Panel":
        """The panel without the curves that stay zero in all runs, which the legend lists."""
        moves = np.nanmax(np.abs(self.curves), axis=0, initial=0) > SEEN * self.span
        moving = {name for name, moved in zip(self.names, moves, strict=True) if moved}
        kept = [k for k, name in enumerate(self.names) if name in moving]
        still = [name for name in dict.fromkeys(self.names) if name not in moving]
        return replace(
            self,
            curves=self.curves[:, kept],
            names=[self.names[k] for k in kept],
            styles=[self.styles[k] for k in kept],
            key=[(f"{_listed(still)}: 0", (INK, " "))] if still else [],
        )


def colour_of(run: int) -> str:
    """The colour of one of several runs."""
    return SERIES[run % len(SERIES)]


def beside(panels: Sequence[Panel], runs: Sequence[str]) -> Panel:
    """Return panels of several runs as one: a colour for each run, a dash for each curve.

    After four curves the dashes come again, paler. The legend has the given names of runs, and
    the dashes. Each run has rows of its own.
    """
    most = max(panels, key=lambda panel: len(panel.names))
    ends = np.cumsum([len(panel.curves) for panel in panels])
    curves = []
    for panel, end in zip(panels, ends, strict=True):
        gap = (end - len(panel.curves), ends[-1] - end)
        curves.append(np.pad(panel.curves, (gap, (0, 0)), constant_values=np.nan))
    names = [name for panel in panels for name in panel.names]
    looks = {name: divmod(i, len(DASHES)) for i, name in enumerate(dict.fromkeys(names))}

    def style(colour: str, name: str) -> Style:
        return (colour, 1 / (1 + looks[name][0])), DASHES[looks[name][1]]

    styles = [style(colour_of(k), name) for k, panel in enumerate(panels) for name in panel.names]
    whole = replace(most, curves=np.hstack(curves), names=names, styles=styles).without_still()
    left = {name: style(INK, name) for name in whole.names}
    words = left.items() if len(left) + len(whole.key) > 1 else ()
    colours = [(name, ((colour_of(k), 1.0), "-")) for k, name in enumerate(runs)]
    hidden = [f"_{name}" for name in whole.names]
    return replace(whole, names=hidden, key=[*colours, *words, *whole.key])


def _listed(names: Sequence[str]) -> str:
    """Names of curves, the first and the last of many."""
    return ", ".join(names) if len(names) < 4 else f"{names[0]} to {names[-1]}"


def height(motion: Trajectory, model: Model | None) -> Panel:
    """Height of B."""
    return Panel("height of\ntorso [mm]", 1e3 * motion.pose[:, 2:3], ("torso",), ((INK, "-"),), 1.0)


def attitude(motion: Trajectory, model: Model | None) -> Panel:
    """Euler angles, with whole turns; roll and yaw have gaps where the torso points up or down."""
    angles = pitch_roll_yaw(motion.pose, unwrap=True)
    angles[np.abs(np.cos(angles[:, 0])) < SINGULAR, 1:] = np.nan
    names = (r"pitch $\phi_x$", r"roll $\phi_y$", r"yaw $\phi_z$")
    return Panel("attitude [deg]", np.degrees(angles), names, TRIPLE, 1.0)


def tilt(motion: Trajectory, model: Model | None) -> Panel:
    """Angle between the back and upright."""
    curve = tilt_deg(motion.attitude)[:, None]
    return Panel("tilt of the\nback [deg]", curve, ("tilt",), ((INK, "-"),), 1.0)


def tail(motion: Trajectory, model: Model | None) -> Panel:
    """Bends of the segments: of links the sum of their angles; without a model coordinates."""
    names, styles, order = of_segments(motion)
    if model is None:
        label, angles = "tail coord.\n[deg]", motion.tail
    else:
        label, angles = "bend of\nsegment [deg]", bends(model, motion.tail)
    return Panel(label, np.degrees(angles[:, order]), names, styles, 1.0)


def torque(motion: Trajectory, model: Model | None) -> Panel:
    """Torques of the tail coordinates."""
    names, styles, order = of_segments(motion)
    return Panel("tail torque\n[mN m]", 1e3 * motion.tau[:, order], names, styles, 0.01)


def force(motion: Trajectory, model: Model | None) -> Panel:
    """The ground's normal forces, the sum of each group."""
    contact = motion.contact
    if contact is None:
        return Panel("normal force\n[N]", np.zeros((len(motion.t), 0)), (), (), 1.0)
    names = list(contact.groups)
    curves = np.stack([contact.of(name).forces[..., 2].sum(axis=1) for name in names], axis=1)
    label = "normal force\n[N]" if len(names) > 1 else f"normal force\nof {names[0]} [N]"
    return Panel(label, curves, names, TRIPLE[: len(names)], 1.0)


def rate(motion: Trajectory, model: Model | None) -> Panel:
    """Angular velocity of the torso in its own frame."""
    names = (r"$\omega_x$", r"$\omega_y$", r"$\omega_z$")
    fixed = motion.layout.fixed
    curves = np.zeros((len(motion.t), 3)) if fixed else motion.v[:, OMEGA]
    return Panel("torso rate\n[rad/s]", curves, names, TRIPLE, 0.1)


def energy(motion: Trajectory, model: Model | None) -> Panel:
    """Kinetic, potential and total energy."""
    curves = 1e3 * np.stack([motion.kinetic, motion.potential, motion.energy], axis=1)
    styles = (*TRIPLE[:2], (INK, "-"))
    return Panel("energy [mJ]", curves, ("kinetic", "potential", "total"), styles, 1.0)


def momentum(motion: Trajectory, model: Model | None) -> Panel:
    """Linear momentum."""
    return Panel("momentum\n[mN s]", 1e3 * motion.linear_momentum, WORLD, TRIPLE, 1.0)


def angular_momentum(motion: Trajectory, model: Model | None) -> Panel:
    """Angular momentum about the centre of mass."""
    return Panel("angular mom.\n[mN m s]", 1e3 * motion.angular_momentum, WORLD, TRIPLE, 0.01)


PANELS: dict[str, Callable[[Trajectory, Model | None], Panel]] = {
    each.__name__: each
    for each in (
        *(height, attitude, tilt, tail, torque, force),
        *(rate, energy, momentum, angular_momentum),
    )
}


def of_segments(motion: Trajectory) -> tuple[list[str], list[tuple[Any, str]], list[int]]:
    """Names and styles of tail coordinates, a colour a segment, yaw dashed; and their order.

    Of several chains a colour a coordinate.
    """
    from matplotlib import colormaps

    segments = motion.segments
    if len(motion.layout.chains) > 1:
        count = motion.layout.nt
        each = [(colour, "-") for colour in colormaps["viridis"](np.linspace(0, 0.85, count))]
        return [*motion.names.tail], each, [*range(count)]
    colours = (
        [TAIL] if segments == 1 else list(colormaps["viridis"](np.linspace(0, 0.85, segments)))
    )
    styles = [(colour, dash) for dash in ("-", "--") for colour in colours]
    numbers = [f" {i + 1}" for i in range(segments)] if segments > 1 else [""] * segments
    names = [bend + number for bend in ("pitch", "yaw") for number in numbers]
    return names, styles, [*range(0, 2 * segments, 2), *range(1, 2 * segments, 2)]
