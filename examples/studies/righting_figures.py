"""Draws the figures of the righting study."""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter

import serpentail as st
from serpentail.attitude import angle_deg, tilt_deg
from serpentail.pictures.panels import SINGULAR
from serpentail.pictures.style import drawn

BLUE = "#0072b2"
LOOKS = {  # a band, and the curve that may lie on it
    "planned": {"color": "#8fd3bd", "linewidth": 4.0},
    "tracked": {"color": BLUE, "linewidth": 1.0},
    "passive": {"color": "#d55e00", "linestyle": "--"},
}
WAYS = {"paper": ("#d55e00", "o--"), "ours": ("#0072b2", "s-")}
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


def draw_rates(rates: dict[str, list[dict]], path: Path) -> tuple[Figure, np.ndarray]:
    """Draw the share of random starts that have a true plan within a CPU time, and the true errors
    of all.
    """
    times = {k: [r["cpu_s"] if r["success"] else np.inf for r in rows] for k, rows in rates.items()}
    errors = {k: [r["open_loop_attitude_error_deg"] for r in rows] for k, rows in rates.items()}

    def draw() -> tuple[Figure, np.ndarray]:
        figure = Figure(figsize=(7.2, 3.5), layout="constrained")
        left, right = axes = figure.subplots(1, 2)
        for panel, values in ((left, times), (right, errors)):
            panel.set(xscale="log", ylim=(0, 101))
            _draw_shares(panel, values)
            panel.grid(color="#e6e6e6", linewidth=0.6)
        left.set(xlabel="CPU time [s]", ylabel="starts with a true plan [%]")
        _write_times(left.xaxis)
        right.set(xlabel="true error at the end [deg]", ylabel="starts [%]")
        right.axvline(0.01, color="0.5", linestyle=":")
        keys = left.get_legend_handles_labels()
        figure.legend(*keys, loc="outside upper center", ncols=4, fontsize=7)
        return figure, axes

    return drawn(draw, path)


def _draw_shares(panel: Axes, values: dict[str, list[float]]) -> None:
    """Draw for each kind the share (%) of values up to a value: from 0, to the panel's edge."""
    known = {kind: np.sort(np.array(all_)[np.isfinite(all_)]) for kind, all_ in values.items()}
    most = 1.2 * max((x.max() for x in known.values() if len(x)), default=1.0)
    for k, (kind, found) in enumerate(known.items()):
        share = 100 * np.arange(len(found) + 1) / len(values[kind])
        x = np.concatenate([found[:1], found, [most]])
        y = np.concatenate([share, share[-1:]]) if len(found) else [0]
        panel.step(x, y, color=f"C{k}", label=f"{kind}: {len(values[kind])}", where="post")
    panel.set_xlim(None, most)


def _write_times(axis: Axis) -> None:
    """Write 1, 2 and 5 of each power of ten: times span few of these."""
    axis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    axis.set_major_formatter("{x:g}")
    axis.set_minor_formatter(NullFormatter())
