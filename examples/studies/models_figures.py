"""Draws the comparison of tail models: Fig. 8, and cost against difference."""

from pathlib import Path
from typing import TYPE_CHECKING

from serpentail.show.pictures.style import HEAD, INK, QUIET, TAIL, drawn

if TYPE_CHECKING:
    import numpy as np
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
FEWEST, MOST = 2, 64  # links in Fig. 8b
LABELLED = (1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 64, 128, 256)  # numbers of links that are written


def draw_figure_8(study: dict, path: Path) -> tuple["Figure", "np.ndarray"]:
    """Draw (a) the torso's yaw over time and (b) the final difference over the number of links."""
    return drawn(lambda: _figure_8(study), path)


def draw_cost(study: dict, path: Path) -> tuple["Figure", "Axes"]:
    """Draw the time of one forward dynamics over the difference of final yaw, n at each mark."""
    return drawn(lambda: _cost(study), path)


def _figure_8(study: dict) -> tuple["Figure", "np.ndarray"]:
    """Both panels."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.2, 2.9), layout="constrained")
    motion, difference = both = figure.subplots(1, 2)
    _motion(motion, study)
    _difference(difference, study)
    for axes in both:
        axes.grid(**GRID)
        axes.set_axisbelow(True)
    return figure, both


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
    """Draw a frame around the inset, and the difference at the end as a double arrow."""
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


def _cost(study: dict) -> tuple["Figure", "Axes"]:
    """Draw run time over difference, both logarithmic.

    Marks are not joined: the difference changes its sign, and neither it nor the time is steady.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.2, 3.9), layout="constrained")
    axes = figure.subplots()
    rows, arc = study["articulated"], study["continuum"]["ns"]
    for key, style in (("difference", AS_BUILT), ("thin_difference", THIN)):
        _draw_marks(axes, rows, key, style)
    axes.axhline(arc, color=INK, linewidth=1.0)
    axes.annotate(
        f"continuum: {arc:.0f} ns, no difference",
        (0.995, arc),
        xycoords=("axes fraction", "data"),
        textcoords="offset points",
        xytext=(0, -10),
        ha="right",
    )
    for row in rows:
        if row["links"] in LABELLED:
            _label(axes, row)
    _log_axes(axes)
    axes.legend(loc="upper right", fontsize=7)
    return figure, axes


def _draw_marks(axes: "Axes", rows: list[dict], key: str, style: dict) -> None:
    """A mark for each number of links: filled where it yaws more than the continuum, else hollow.

    Final yaws are negative, so that is a negative difference.
    """
    look = style | {"linestyle": ""}
    for more in (True, False):
        chosen = [row for row in rows if (row[key] < 0) == more]
        words = f"{style['label']}, yawing {'more' if more else 'less'}"
        face = style["color"] if more else "white"
        x, y = [abs(row[key]) for row in chosen], [row["ns"] for row in chosen]
        axes.plot(x, y, **look | {"markerfacecolor": face, "label": words})


def _label(axes: "Axes", row: dict) -> None:
    """Write n at the right of a mark."""
    words = f"$n = {row['links']}$" if row["links"] in (1, 256) else str(row["links"])
    place = (abs(row["difference"]), row["ns"])
    look = {"textcoords": "offset points", "color": TAIL, "fontsize": 7, "va": "center"}
    axes.annotate(words, place, xytext=(6, 0), **look)


def _log_axes(axes: "Axes") -> None:
    """Scales, labels and grid of the diagram of cost."""
    from matplotlib.ticker import FuncFormatter, NullFormatter

    axes.set(xscale="log", yscale="log", xlim=(0.01, 10), ylim=(50, 20_000))
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axis.set_minor_formatter(NullFormatter())
    axes.set_xlabel("|final yaw, articulated \N{MINUS SIGN} continuum| [deg]")
    axes.set_ylabel("forward dynamics, one call from C [ns]")
    axes.grid(which="major", **GRID)
    axes.set_axisbelow(True)
