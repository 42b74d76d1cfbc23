"""Figs. 11 to 13 and Table 2: plans with more nodes, and of tails with more segments."""

from pathlib import Path

import numpy as np

import serpentail as st
from examples import righting
from examples.paper import truth
from examples.paper.figures import draw_figure_11, draw_figure_13
from serpentail.basics.attitude import tilt_deg

RAT = (1, 3)
TAILS = ((1, 6), (2, 3), (3, 2))
FREQUENCIES = (20, 40, 60, 80, 100, 150, 200)  # Hz, nodes a second
EXAMPLE = 4  # the random start of Fig. 11: both programs converge from it at all frequencies
SHOWN = (20, 100, 200)  # Hz
FREE = (0.3, righting.FLIGHT)  # s, t_N - t_1
RETRIES = 8  # of `st.plan`
LIMIT = 300.0  # s a plan


def nodes(folder: Path) -> dict:
    """Fig. 11: more nodes of a plan from one random start, by both programs."""
    model, flights = righting.model(*RAT), {}
    task = righting.tumbling(model, EXAMPLE), righting.FLIGHT, righting.bounds(model)
    given = dict(zip(("start", "duration", "bounds"), task, strict=True))
    free, once = st.Tolerances(attitude=None), st.Solver(retries=0, time_limit=LIMIT)
    rows: dict[str, list[dict]] = {"paper": [], "ours": []}
    for frequency in FREQUENCIES:
        steps, of = round(frequency * righting.FLIGHT), {"frequency": frequency}
        paper = truth.planned(model, *task, nodes=steps + 1, time_limit=LIMIT)
        rows["paper"].append(of | truth.row(model, paper) | truth.tracked(model, paper))
        if frequency in SHOWN:
            flights[f"{frequency} Hz"] = truth.followed(model, paper)
        given |= {"mesh": st.Mesh(intervals=max(2, steps // 3))}
        plan = st.plan(model, **given, tolerances=free, solver=once)
        rows["ours"].append(of | righting.row(plan))
    draw_figure_11(rows, folder / "fig11.png")
    st.view(list(flights.values()), folder / "fig11.html", names=list(flights))
    told = [of_figure_11(way) for way in rows.values()]
    return {"fig11": {name: [of[name] for of in told] for name in told[0]}}


def of_figure_11(rows: list[dict]) -> dict[str, bool]:
    """Return which sentences about Fig. 11 hold for one program."""
    errors, times = ([r[key] for r in rows] for key in ("dyn_err", "solve_cpu_s"))
    at = FREQUENCIES.index(100)
    told = {
        "error_falls": np.all(np.diff(errors[: at + 1]) < 0),
        "error_rests": errors[-1] > errors[at] / 2,
        "time_grows": times[-1] > times[0],
    }
    for name, key in (("iterations", "iterations"), ("objective", "effort")):
        values = [r[key] for r in rows]
        told[f"{name}_rests"] = max(values) < 2 * min(values)
    return {name: bool(x) for name, x in told.items()}


def segments(folder: Path) -> dict:
    """Figs. 12 and 13, Table 2: tails of six links, from the state 0.1 s after the kick."""
    found: dict[str, dict] = {"fig12": {}, "fig13": {}, "table2": {}}
    planned, true, efforts = {}, {}, []
    for size in TAILS:
        model, m = righting.model(*size), size[0]
        task = righting.kicked(model), FREE, righting.bounds(model, 2 * np.pi)
        paper = truth.searched(model, *task, time_limit=LIMIT)
        given = dict(zip(("start", "duration", "bounds"), task, strict=True))
        ours = st.plan(model, **given, solver=st.Solver(retries=RETRIES, time_limit=LIMIT))
        planned[size], true[size] = truth.as_motion(model, paper), ours.trajectory
        efforts.append((paper.stats["effort"], ours.report["effort"]))
        for name, pair in of_table_2(model, paper, planned[size], ours).items():
            found["table2"][f"{name}_{m}"] = pair
        ends = planned[size].attitude[-1], true[size].attitude[-1]
        found["fig12"][f"upright_{m}"] = [bool(tilt_deg(end) < 1) for end in ends]
    for name, less in (("two_less", efforts[1]), ("three_less", efforts[2])):
        found["fig13"][name] = [bool(a < b) for a, b in zip(less, efforts[0], strict=True)]
    draw_figure_13(planned, folder / "fig13.png")
    shown = {f"{m}x{n} paper": motion for (m, n), motion in planned.items()}
    shown |= {f"{m}x{n} st.plan": motion for (m, n), motion in true.items()}
    st.view(list(shown.values()), folder / "fig12.html", names=list(shown))
    for name, motion in shown.items():
        motion.filmstrip(folder / f"fig12_{name.replace(' ', '_')}.png")
    return found


def of_table_2(
    model: st.Model, paper: truth.PaperPlan, planned: st.Trajectory, ours: st.Plan
) -> dict[str, list[float]]:
    """Return the values of Table 2 for one tail."""
    row, report, errors = paper.stats, ours.report, truth.tracked(model, paper)
    energy, power = truth.work(planned)
    return {
        "iterations": [row["iterations"], report["iterations"]],
        "time": [row["solve_cpu_s"] / 60, report["solve_cpu_s"] / 60],
        "objective": [row["effort"], report["effort"]],
        "energy": [energy, report["energy_J"]],
        "power": [power, report["peak_power_W"]],
        "error": [errors["dyn_err"], report["dyn_err"]],
        "tracking": [errors["tracked_tail_error_rad"], report["tracked_tail_error_rad"]],
    }
