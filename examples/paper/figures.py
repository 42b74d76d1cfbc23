"""Draws Figs. 8, 10, 11 and 13."""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter, NullLocator

import serpentail as st
from serpentail.basics.attitude import angle_deg, tilt_deg
from serpentail.show.pictures.panels import SINGULAR
from serpentail.show.pictures.style import HEAD, INK, QUIET, TAIL, drawn

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
BLUE = "#0072b2"
LOOKS = {  # a band, and the curve that may lie on it
    "planned": {"color": "#8fd3bd", "linewidth": 4.0},
    "tracked": {"color": BLUE, "linewidth": 1.0},
    "passive": {"color": "#d55e00", "linestyle": "--"},
}
WAYS = {"ours": ("#0072b2", "s-"), "paper": ("#d55e00", "o--")}
PANELS = (  # of Fig. 10
    *("$p_{b,y}$ [m]", "$p_{b,z}$ [m]"),
    *(r"pitch $\phi_x$ [deg]", r"roll $\phi_y$ [deg]"),
    *(r"yaw $\phi_z$ [deg]", "tilt of back [deg]"),
    *("bend in pitch [deg]", "bend in yaw [deg]"),
    *(r"$\tau_\alpha$ [mN m]", r"$\tau_\beta$ [mN m]"),
    *("tracked off planned:\nattitude [deg]", "tracked \N{MINUS SIGN} planned:\nbends [deg]"),
)


def draw_figure_8(study: dict, path: Path) -> tuple[Figure, np.ndarray]:
    """Draw (a) the torso's yaw over time and (b) the final difference over the number of links."""
    return drawn(lambda: _figure_8(study), path)


def _figure_8(study: dict) -> tuple[Figure, np.ndarray]:
    """Both panels."""
    figure = Figure(figsize=(7.2, 2.9), layout="constrained")
    motion, difference = both = figure.subplots(1, 2)
    _motion(motion, study)
    _difference(difference, study)
    for axes in both:
        axes.grid(**GRID)
        axes.set_axisbelow(True)
    return figure, both


def _motion(axes: Axes, study: dict) -> None:
    """Fig. 8a, and its end enlarged."""
    curves = (
        (study["continuum"], {"color": HEAD, "label": "continuum"}),
        (
            study["shown"],
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


def _dress_inset(axes: Axes, ends: list[float]) -> None:
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


def _difference(axes: Axes, study: dict) -> None:
    """Fig. 8b."""
    rows = study["articulated"]
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


def draw_figure_10(
    flights: dict[str, st.Trajectory], links: int, path: Path
) -> tuple[Figure, np.ndarray]:
    """Draw position, attitude, tail bends and torques of the planned, the tracked and the passive
    flight, and the difference of the tracked flight from the plan.
    """

    def draw() -> tuple[Figure, np.ndarray]:
        figure = Figure(figsize=(7.2, 8.6), layout="constrained")
        axes = figure.subplots(6, 2, sharex=True)
        for name, flight in flights.items():
            look = LOOKS[name] | {"label": name}
            like = flight if name == "passive" else flights["tracked"]
            for panel, curve in zip(axes.flat, _curves(flight, like, links), strict=False):
                panel.plot(flight.t, curve, **look)
        _draw_differences(axes[-1], flights["planned"], flights["tracked"], links)
        for panel, label in zip(axes.flat, PANELS, strict=True):
            panel.set_ylabel(label)
            panel.grid(color="#e6e6e6", linewidth=0.6)
        for panel in axes[-1]:
            panel.set_xlabel("time since 0.1 s after the kick [s]")
        keys = axes.flat[0].get_legend_handles_labels()
        figure.legend(*keys, loc="outside upper center", ncols=3)
        figure.align_ylabels()
        return figure, axes

    return drawn(draw, path)


def _draw_differences(
    panels: np.ndarray, planned: st.Trajectory, tracked: st.Trajectory, links: int
) -> None:
    """Tracked minus planned: the angle between the torsos, and the bends of the tail."""
    t = planned.t[planned.t <= tracked.t[-1]]
    planned, tracked = planned.resample(t), tracked.resample(t)
    panels[0].plot(t, angle_deg(planned.attitude, tracked.attitude), color=BLUE)
    bends = links * np.degrees(tracked.tail - planned.tail)
    for curve, name, dash in zip(bends.T, ("pitch", "yaw"), ("-", "--"), strict=True):
        panels[1].plot(t, curve, dash, color=BLUE, label=name)
    panels[1].legend(loc="upper left", fontsize=7)


def _curves(flight: st.Trajectory, like: st.Trajectory, links: int) -> list[np.ndarray]:
    angles = _angles_near(flight, like)
    # near the vertical, roll and yaw are ill-defined
    angles[np.abs(np.cos(angles[:, 0])) < SINGULAR, 1:] = np.nan
    bends = links * np.degrees(flight.tail)
    curves = [flight.q[:, 1], flight.q[:, 2], *np.degrees(angles).T, tilt_deg(flight.attitude)]
    return [*curves, *bends.T, *(1e3 * flight.tau).T]


def _angles_near(flight: st.Trajectory, like: st.Trajectory) -> np.ndarray:
    """Return pitch, roll, yaw (K, 3): of the two triples of each attitude, and their whole turns,
    those nearest to another flight.

    (pi - phi_x, phi_y + pi, phi_z + pi) is the same attitude: near pitches of 90 degrees, either
    may result.
    """
    angles, wanted = (st.pitch_roll_yaw(motion.q, unwrap=True) for motion in (flight, like))
    wanted = np.column_stack([np.interp(flight.t, like.t, column) for column in wanted.T])
    both = np.stack([angles, angles * (-1, 1, 1) + np.pi])
    both += 2 * np.pi * np.round((wanted - both) / (2 * np.pi))
    nearest = np.abs(both - wanted).sum(axis=2).argmin(axis=0)
    return both[nearest, np.arange(len(angles))]


def draw_figure_11(rows: dict[str, list[dict]], path: Path) -> tuple[Figure, np.ndarray]:
    """Draw iterations, effort, time and true error against the nodes a second, and time against
    error.
    """
    panels = {
        "iterations": "iterations",
        "effort": "effort [(mN m)$^2$ s]",
        "solve_cpu_s": "solver time [s]",
    }
    panels["open_loop_attitude_error_deg"] = "true error [deg]"

    def draw() -> tuple[Figure, np.ndarray]:
        figure = Figure(figsize=(7.2, 4.4), layout="constrained")
        axes = figure.subplots(2, 3)
        for way, points in rows.items():
            colour, mark = WAYS[way]
            look = {"color": colour, "markersize": 3.5, "label": way}
            good = [r | {"effort": 1e6 * r["effort"]} for r in points if r["converged"]]
            for panel, key in zip(axes.flat, panels, strict=False):
                panel.plot([r["frequency"] for r in good], [r[key] for r in good], mark, **look)
            errors = [r["open_loop_attitude_error_deg"] for r in good]
            axes.flat[4].plot([r["solve_cpu_s"] for r in good], errors, mark, **look)
            axes.flat[5].plot(
                [r["frequency"] for r in good], [r["dyn_err"] for r in good], mark, **look
            )
        for panel, name in zip(
            axes.flat, (*panels.values(), "true error [deg]", "Dyn.Err (Eq. 50)"), strict=True
        ):
            panel.set(ylabel=name, xlabel="nodes a second [1/s]", yscale="log")
            panel.yaxis.set_minor_formatter(NullFormatter())
            panel.grid(color="#e6e6e6", linewidth=0.6)
        axes.flat[4].set(xlabel="solver time [s]", xscale="log")
        for axis in (axes.flat[2].yaxis, axes.flat[4].xaxis):
            write_times(axis)
        for panel in axes.flat[:2]:
            panel.set(yscale="linear", ylim=(0, None))
        figure.legend(
            *axes.flat[0].get_legend_handles_labels(), loc="outside upper center", ncols=2
        )
        return figure, axes

    return drawn(draw, path)


def draw_figure_13(flights: dict[tuple, st.Trajectory], path: Path) -> tuple[Figure, np.ndarray]:
    """Attitude, bends and torques of plans for tails of one, two and three segments."""

    def draw() -> tuple[Figure, np.ndarray]:
        figure = Figure(figsize=(7.2, 5.4), layout="constrained")
        axes = figure.subplots(3, len(flights), squeeze=False, sharex="col")
        for column, ((m, n), flight) in zip(axes.T, flights.items(), strict=True):
            flight.plot("attitude", "tail", "torque", ax=column)
            column[0].set_title(f"$m = {m}$, $n = {n}$")
        for panel in axes[:, 1:].flat:
            panel.set_ylabel("")
        return figure, axes

    return drawn(draw, path)


def write_times(axis: Axis) -> None:
    """Write 1, 2 and 5 of each power of ten: times span few of these."""
    axis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    axis.set_major_formatter("{x:g}")
    axis.set_minor_formatter(NullFormatter())
