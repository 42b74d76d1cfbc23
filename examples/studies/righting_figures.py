"""Draws the figures of the righting study."""

from pathlib import Path

import numpy as np
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter

import serpentail as st
from examples.studies.righting_kinds import TRUE, is_true
from serpentail.basics.attitude import angle_deg, tilt_deg
from serpentail.show.pictures.panels import SINGULAR
from serpentail.show.pictures.style import drawn

BLUE = "#0072b2"
LOOKS = {  # a band, and the curve that may lie on it
    "planned": {"color": "#8fd3bd", "linewidth": 4.0},
    "tracked": {"color": BLUE, "linewidth": 1.0},
    "passive": {"color": "#d55e00", "linestyle": "--"},
}
WAYS = {"ours": ("#0072b2", "s-"), "paper": ("#d55e00", "o--")}
RATES = {"auto": (BLUE, "s"), "IPOPT": ("#009e73", "D"), "paper": ("#d55e00", "o")}
PANELS = (  # of Fig. 10
    *("$p_{b,y}$ [m]", "$p_{b,z}$ [m]"),
    *(r"pitch $\phi_x$ [deg]", r"roll $\phi_y$ [deg]"),
    *(r"yaw $\phi_z$ [deg]", "tilt of back [deg]"),
    *("bend in pitch [deg]", "bend in yaw [deg]"),
    *(r"$\tau_\alpha$ [mN m]", r"$\tau_\beta$ [mN m]"),
    *("tracked off planned:\nattitude [mdeg]", "tracked \N{MINUS SIGN} planned:\nbends [mdeg]"),
)


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
    panels[0].plot(t, 1e3 * angle_deg(planned.attitude, tracked.attitude), color=BLUE)
    bends = 1e3 * links * np.degrees(tracked.tail - planned.tail)
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
            _write_times(axis)
        for panel in axes.flat[:2]:
            panel.set(yscale="linear", ylim=(0, None))
        figure.legend(
            *axes.flat[0].get_legend_handles_labels(), loc="outside upper center", ncols=2
        )
        return figure, axes

    return drawn(draw, path)


def draw_figure_13(
    flights: dict[tuple, st.Trajectory], rats: dict[tuple, st.Model], path: Path
) -> tuple[Figure, np.ndarray]:
    """Attitude, bends and torques of plans for tails of one, two and three segments."""

    def draw() -> tuple[Figure, np.ndarray]:
        figure = Figure(figsize=(7.2, 5.4), layout="constrained")
        axes = figure.subplots(3, len(flights), squeeze=False, sharex="col")
        for column, ((m, n), flight) in zip(axes.T, flights.items(), strict=True):
            flight.plot("attitude", "tail", "torque", ax=column, model=rats[m, n])
            column[0].set_title(f"$m = {m}$, $n = {n}$")
        for panel in axes[:, 1:].flat:
            panel.set_ylabel("")
        return figure, axes

    return drawn(draw, path)


def draw_rates(rates: dict[str, dict[str, list[dict]]], path: Path) -> tuple[Figure, np.ndarray]:
    """Draw, for each kind of random start and each way of planning, the share of true plans, and
    CPU time and true error of all plans: medians, and the range of nine tenths of them.
    """
    spans = {"cpu_s": "CPU time [s]", "open_loop_attitude_error_deg": "true error [deg]"}

    def draw() -> tuple[Figure, np.ndarray]:
        figure = Figure(figsize=(7.2, 1.2 + 0.3 * len(rates)), layout="constrained")
        axes = figure.subplots(1, 3, sharey=True)
        for shift, (way, (colour, mark)) in zip((0.22, 0, -0.22), RATES.items(), strict=True):
            places = [k for k, ways in enumerate(rates.values()) if way in ways]
            at = shift - np.array(places)
            rows = [ways[way] for ways in rates.values() if way in ways]
            shares = [100 * np.mean([is_true(row) for row in of]) for of in rows]
            look = {"color": colour, "label": way}
            axes[0].plot(shares, at, mark, markersize=3.5, linestyle="none", **look)
            for panel, key in zip(axes[1:], spans, strict=True):
                low, middle, high = np.transpose([_middle([r[key] for r in of]) for of in rows])
                panel.hlines(at, low, high, color=colour, linewidth=1)
                panel.plot(middle, at, mark, markersize=3.5, linestyle="none", **look)
        axes[0].set(xlabel="true plans [%]", xlim=(-4, 104))
        names = [f"{kind}: {len(ways['IPOPT'])}" for kind, ways in rates.items()]
        axes[0].set_yticks(-np.arange(len(rates)), names)
        for panel, name in zip(axes[1:], spans.values(), strict=True):
            panel.set(xlabel=name, xscale="log")
        _write_times(axes[1].xaxis)
        axes[2].axvline(TRUE, color="0.5", linestyle=":")
        for panel in axes:
            panel.grid(color="#e6e6e6", linewidth=0.6)
        keys = axes[0].get_legend_handles_labels()
        figure.legend(*keys, loc="outside upper center", ncols=len(RATES))
        return figure, axes

    return drawn(draw, path)


def _middle(values: list[float]) -> np.ndarray:
    """Return the percentiles 5, 50 and 95 of the finite ones of values."""
    finite = np.array(values)[np.isfinite(values)]
    return np.percentile(finite, (5, 50, 95)) if len(finite) else np.full(3, np.nan)


def _write_times(axis: Axis) -> None:
    """Write 1, 2 and 5 of each power of ten: times span few of these."""
    axis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    axis.set_major_formatter("{x:g}")
    axis.set_minor_formatter(NullFormatter())
