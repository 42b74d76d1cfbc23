"""Draws the comparison of tail models: Fig. 8, and cost against difference."""

import math
from pathlib import Path
from typing import TYPE_CHECKING

from serpentail.pictures.style import HEAD, INK, QUIET, TAIL, write

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

GRID = {"color": "#e6e6e6", "linewidth": 0.6}
AS_BUILT = {
    "color": TAIL,
    "marker": "o",
    "markersize": 4,
    "label": "links with their own inertia (as in the paper)",
}
THIN = {
    "color": HEAD,
    "marker": "s",
    "markersize": 3.6,
    "markerfacecolor": "white",
    "linestyle": "--",
    "linewidth": 1.0,
    "label": "links without inertia of their own",
}
SIGNS = "a gap in a line: the difference changes its sign here"
FEWEST, MOST = 2, 64  # links in Fig. 8b
# where a number of links is written, points from its mark
LABELS = dict.fromkeys((1, 3, 4, 6, 8, 12, 16, 24, 32, 64, 128, 256), (-7, -1)) | {2: (0, -13)}


def draw_figure_8(study: dict, path: Path) -> Path:
    """Draw (a) the torso's yaw over time and (b) the final difference over the number of links;
    return the path.
    """
    return write(path, lambda: _figure_8(study))


def draw_cost(study: dict, path: Path) -> Path:
    """Draw the time of one forward dynamics over the difference of final yaw, n at each mark;
    return the path.
    """
    return write(path, lambda: _cost(study))


def _figure_8(study: dict) -> "Figure":
    """Both panels."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.2, 2.9), layout="constrained")
    motion, difference = figure.subplots(1, 2)
    _motion(motion, study)
    _difference(difference, study)
    for axes in (motion, difference):
        axes.grid(**GRID)
        axes.set_axisbelow(True)
    return figure


def _motion(axes: "Axes", study: dict) -> None:
    """Fig. 8a, and its end enlarged."""
    curves = (
        (study["continuum"]["motion"], {"color": HEAD, "label": "continuum"}),
        (
            study["motion_of_4_links"],
            {"color": TAIL, "linestyle": "--", "label": "articulated, $n = 4$"},
        ),
    )
    end = axes.inset_axes((0.12, 0.1, 0.36, 0.33), xlim=(0.9, 1.0), ylim=(-22.1, -20.9))
    for each in (axes, end):
        for curve, style in curves:
            each.plot(study["time"], curve, **style)
    _dress_inset(end, [curve[-1] for curve, _ in curves])
    axes.indicate_inset((0.9, -22.1, 0.1, 1.2), edgecolor=QUIET)
    axes.set(
        xlabel="time / duration, $t / T$",
        ylabel=r"torso yaw $\phi_z$ [deg]",
        xlim=(0, 1.02),
        ylim=(-23.5, 1),
    )
    axes.set_title("(a) one swing of the tail", fontsize=8, loc="left")
    axes.legend(loc="upper right")


def _dress_inset(axes: "Axes", ends: list[float]) -> None:
    """A frame of its own, and the difference at the end as a double arrow."""
    axes.spines[:].set(visible=True, color=QUIET)
    axes.tick_params(labelsize=6, length=2)
    axes.set(xticks=[0.9, 0.95, 1.0], yticks=[-22, -21.5, -21])
    axes.grid(**GRID)
    axes.annotate(
        "",
        (0.994, ends[0]),
        (0.994, ends[1]),
        arrowprops={"arrowstyle": "<->", "shrinkA": 0, "shrinkB": 0},
    )
    axes.text(
        0.988,
        -21.6,
        f"{abs(ends[1] - ends[0]):.3f}\N{DEGREE SIGN}",
        ha="right",
        va="center",
        fontsize=6.5,
    )


def _difference(axes: "Axes", study: dict) -> None:
    """Fig. 8b."""
    from matplotlib.ticker import NullLocator

    rows = [row for row in study["articulated"] if FEWEST <= row["links"] <= MOST]
    links = [row["links"] for row in rows]
    axes.axhline(0, color=INK, linewidth=0.8)
    axes.plot(links, [row["difference"] for row in rows], **AS_BUILT)
    axes.plot(links, [row["thin_difference"] for row in rows], **THIN)
    worst = min(rows, key=lambda row: row["difference"])
    axes.annotate(
        f"{worst['difference']:.3f}\N{DEGREE SIGN} at $n = {worst['links']}$".replace(
            "-", "\N{MINUS SIGN}", 1
        ),
        (worst["links"], worst["difference"]),
        textcoords="offset points",
        xytext=(12, -9),
    )
    axes.set_xscale("log", base=2)
    axes.set_xticks([2, 4, 8, 16, 32, 64], ["2", "4", "8", "16", "32", "64"])
    axes.xaxis.set_minor_locator(NullLocator())
    axes.set(
        xlabel="links $n$",
        ylabel="final yaw, articulated\n\N{MINUS SIGN} continuum [deg]",
        ylim=(-0.5, 0.5),
    )
    axes.set_title("(b) difference of the final yaw", fontsize=8, loc="left")
    axes.legend(loc="upper right", fontsize=7)


def _cost(study: dict) -> "Figure":
    """Run time over difference, both logarithmic; the difference shrinks to the right."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.2, 3.9), layout="constrained")
    axes = figure.subplots()
    rows, arc = study["articulated"], study["continuum"]["ns"]
    times = [row["ns"] for row in rows]
    for key, style in (("thin_difference", THIN), ("difference", AS_BUILT)):
        axes.plot(*_joined_by_sign([row[key] for row in rows], times), **style)
    axes.axhline(arc, color=INK, linewidth=1.0)
    axes.annotate(
        f"continuum: {arc:.0f} ns, no difference",
        (0.995, arc),
        xycoords=("axes fraction", "data"),
        textcoords="offset points",
        xytext=(0, -10),
        ha="right",
    )
    axes.text(0.98, 0.3, SIGNS, transform=axes.transAxes, ha="right", fontsize=7)
    for row in rows:
        if row["links"] in LABELS:
            _label(axes, row)
    _log_axes(axes)
    axes.legend(*(reversed(each) for each in axes.get_legend_handles_labels()), loc="upper left")
    return figure


def _joined_by_sign(
    differences: list[float], times: list[float]
) -> tuple[list[float], list[float]]:
    """Sizes of the differences and the times, with a gap wherever the sign changes."""
    x, y = [abs(differences[0])], [times[0]]
    for before, after, time in zip(differences, differences[1:], times[1:], strict=False):
        if before * after < 0:
            x, y = [*x, math.nan], [*y, math.nan]
        x, y = [*x, abs(after)], [*y, time]
    return x, y


def _label(axes: "Axes", row: dict) -> None:
    """Write n beside a mark."""
    words = f"$n = {row['links']}$" if row["links"] in (1, 256) else str(row["links"])
    place = LABELS[row["links"]]
    axes.annotate(
        words,
        (abs(row["difference"]), row["ns"]),
        textcoords="offset points",
        xytext=place,
        color=TAIL,
        fontsize=7,
        ha="right" if place[0] else "center",
    )


def _log_axes(axes: "Axes") -> None:
    """Scales, labels and grid of the diagram of cost."""
    from matplotlib.ticker import FuncFormatter, NullFormatter

    axes.set(xscale="log", yscale="log", xlim=(4, 0.01), ylim=(50, 10_000))
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axis.set_minor_formatter(NullFormatter())
    axes.set_xlabel("|final yaw, articulated \N{MINUS SIGN} continuum| [deg], smaller to the right")
    axes.set_ylabel("forward dynamics, one call from C [ns]")
    axes.grid(which="major", **GRID)
    axes.set_axisbelow(True)
