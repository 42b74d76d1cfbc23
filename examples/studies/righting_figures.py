"""Draws the figures of the righting study."""

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter

import serpentail as st
from serpentail.pictures.style import write

LOOKS = {"planned": ("#009e73", "-"), "tracked": ("#0072b2", "-."), "passive": ("#d55e00", "--")}
WAYS = {"paper": ("#d55e00", "o--"), "ours": ("#0072b2", "s-")}
COLOURS = ("#0072b2", "#d55e00", "#009e73")


def draw_figure_10(flights: dict[str, st.Trajectory], path: Path) -> Path:
    """Position, attitude, tail and torques of the planned, the tracked and the passive flight."""

    def draw() -> Figure:
        figure = Figure(figsize=(7.2, 6.4), layout="constrained")
        axes = figure.subplots(4, 2, sharex=True)
        names = ("$p_{b,y}$ [m]", "$p_{b,z}$ [m]", r"pitch $\phi_x$ [deg]", r"roll $\phi_y$ [deg]")
        names += (
            r"$\alpha_1$ [deg]",
            r"$\beta_1$ [deg]",
            r"$\tau_\alpha$ [mN m]",
            r"$\tau_\beta$ [mN m]",
        )
        for name, flight in flights.items():
            colour, dash = LOOKS[name]
            for k, curve in enumerate(
                _curves(flight, flight if name == "passive" else flights["tracked"])
            ):
                axes.flat[k].plot(flight.t, curve, dash, color=colour, label=name)
        for panel, name in zip(axes.flat, names, strict=True):
            panel.set_ylabel(name)
            panel.grid(color="#e6e6e6", linewidth=0.6)
        for panel in axes[-1]:
            panel.set_xlabel("time since 0.1 s after the kick [s]")
        figure.legend(
            *axes.flat[0].get_legend_handles_labels(), loc="outside upper center", ncols=3
        )
        return figure

    return write(path, draw)


def _curves(flight: st.Trajectory, like: st.Trajectory) -> list[np.ndarray]:
    angles = np.degrees(_angles_near(flight, like))
    tail, tau = np.degrees(flight.tail), 1e3 * flight.tau
    return [
        flight.q[:, 1],
        flight.q[:, 2],
        angles[:, 0],
        angles[:, 1],
        tail[:, 0],
        tail[:, 1],
        tau[:, 0],
        tau[:, 1],
    ]


def _angles_near(flight: st.Trajectory, like: st.Trajectory) -> np.ndarray:
    """Pitch, roll, yaw (K, 3): of the two triples of each attitude, and turns of them, those
    nearest to another flight.

    (pi - phi_x, phi_y + pi, phi_z + pi) is the same attitude: near pitches of 90 degrees, either
    may come out.
    """
    angles, wanted = (st.pitch_roll_yaw(motion.q, unwrap=True) for motion in (flight, like))
    wanted = np.column_stack([np.interp(flight.t, like.t, column) for column in wanted.T])
    both = np.stack([angles, angles * (-1, 1, 1) + np.pi])
    both += 2 * np.pi * np.round((wanted - both) / (2 * np.pi))
    nearest = np.abs(both - wanted).sum(axis=2).argmin(axis=0)
    return both[nearest, np.arange(len(angles))]


def draw_figure_11(rows: dict[str, list[dict]], path: Path) -> Path:
    """Iterations, effort, time and true error against the nodes a second, and time against
    error.
    """
    panels = {
        "iterations": "iterations",
        "effort": "effort [N$^2$ m$^2$ s]",
        "solve_cpu_s": "solver time [s]",
    }
    panels["open_loop_attitude_error_deg"] = "true error [deg]"

    def draw() -> Figure:
        figure = Figure(figsize=(7.2, 4.4), layout="constrained")
        axes = figure.subplots(2, 3)
        for way, points in rows.items():
            colour, mark = WAYS[way]
            look = {"color": colour, "markersize": 3.5, "label": way}
            good = [r for r in points if r["converged"]]
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
        axes.flat[4].xaxis.set_minor_formatter(NullFormatter())
        axes.flat[0].set(yscale="linear", ylim=(0, None))
        axes.flat[1].yaxis.set_minor_formatter("{x:.0e}")
        figure.legend(
            *axes.flat[0].get_legend_handles_labels(), loc="outside upper center", ncols=2
        )
        return figure

    return write(path, draw)


def draw_figure_13(flights: dict, path: Path) -> Path:
    """Attitude, tail and torques of plans for tails of one, two and three segments."""

    def draw() -> Figure:
        figure = Figure(figsize=(7.2, 5.4), layout="constrained")
        axes = figure.subplots(3, len(flights), squeeze=False, sharey="row")
        for column, ((m, n), flight) in zip(axes.T, flights.items(), strict=True):
            angles = np.degrees(st.pitch_roll_yaw(flight.q, unwrap=True))
            for k, name in enumerate((r"$\phi_x$", r"$\phi_y$", r"$\phi_z$")):
                column[0].plot(flight.t, angles[:, k], color=COLOURS[k], label=name)
            for i in range(m):
                for j, dash in enumerate(("-", "--")):
                    name = f"{('pitch', 'yaw')[j]} {i + 1}"
                    column[1].plot(
                        flight.t,
                        np.degrees(flight.tail[:, 2 * i + j]),
                        dash,
                        color=COLOURS[i],
                        label=name,
                    )
                    column[2].plot(flight.t, 1e3 * flight.tau[:, 2 * i + j], dash, color=COLOURS[i])
            column[0].set_title(f"$m = {m}$, $n = {n}$")
            column[2].set_xlabel("time [s]")
            column[0].legend(fontsize=6, loc="upper left")
            column[1].legend(fontsize=6, ncols=3, loc="lower center")
            column[1].margins(y=0.4)
        for panel, name in zip(
            axes[:, 0], ("attitude [deg]", "tail [deg]", "torque [mN m]"), strict=True
        ):
            panel.set_ylabel(name)
        return figure

    return write(path, draw)


def draw_rates(rates: dict[str, list[dict]], path: Path) -> Path:
    """Share of random starts that have a true plan within a CPU time, and the true errors of all of
    them.
    """

    def draw() -> Figure:
        figure = Figure(figsize=(7.2, 3.2), layout="constrained")
        left, right = figure.subplots(1, 2)
        for k, (kind, rows) in enumerate(rates.items()):
            look = {"color": f"C{k}", "label": kind, "where": "post"}
            share = np.arange(1, len(rows) + 1) / len(rows)
            times = [r["cpu_s"] if r["success"] else np.inf for r in rows]
            left.step(np.sort(times), 100 * share, **look)
            right.step(
                np.sort([r["open_loop_attitude_error_deg"] for r in rows]), 100 * share, **look
            )
        left.set(
            xlabel="CPU time [s]", ylabel="starts with a true plan [%]", xscale="log", ylim=(0, 101)
        )
        right.set(
            xlabel="true error at the end [deg]", ylabel="starts [%]", xscale="log", ylim=(0, 101)
        )
        right.axvline(0.01, color="0.5", linestyle=":")
        for panel in (left, right):
            panel.grid(color="#e6e6e6", linewidth=0.6)
        left.legend(fontsize=6)
        return figure

    return write(path, draw)
