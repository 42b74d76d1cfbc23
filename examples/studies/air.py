"""What the air does to righting: a thousand tumbles of a rat with a bare tail and with a tuft, by
plans that know the air and by one that ignores it.
"""

import json
from functools import cache
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import serpentail as st
from examples import righting
from examples.studies import morphology
from serpentail.bridges.sweeps.sweep import Sweep
from serpentail.show.pictures.style import drawn

DENSITY = 1.2  # kg/m^3
TUFT = ["5.8 mm", "5.8 mm", "20 mm", "20 mm"]  # widths of the tail; the tuft's is assumed
INTERVALS = 16
VERSION = 1  # of what makes a row
TUMBLE = {name: morphology.OVER[name] for name in ("pitch", "roll", "yaw", "pitch_rate")}
OVER = TUMBLE | {"other_rates": morphology.OVER["other_rates"]}
BODIES = ("no air", "bare tail", "tuft")
IGNORING = {"bare, ignored": "bare tail", "tuft, ignored": "tuft"}  # flown in the air of a body
FOLLOWED = {"bare, followed": "bare tail", "tuft, followed": "tuft"}  # the plan's tail, by PFL
COLORS = dict(zip(BODIES, ("#0072b2", "#d55e00", "#009e73"), strict=True))


@cache
def bodies() -> dict[str, st.Model]:
    """Return the rat without air, in air, and in air with a tuft that weighs nothing."""
    bare = st.build("righting_m1_n3", air_density=DENSITY)
    tuft = st.build("righting_m1_n3", air_density=DENSITY, tail_widths=TUFT)
    return dict(zip(BODIES, (st.build("righting_m1_n3"), bare, tuft), strict=True))


def planned(body: st.Model, start: tuple) -> st.Plan:
    """Plan the righting of a body by least effort, any rate of the torso at the end."""
    return st.plan(
        body,
        start=start,
        goal=st.Goal(torso_rate=None),
        bounds=righting.bounds(body),
        duration=(morphology.SHORTEST, righting.FLIGHT),
        mesh=st.Mesh(intervals=INTERVALS),
        tolerances=st.Tolerances(attitude=None),
        solver=st.Solver(retries=0, track=False),
    )


def tilt(body: st.Model, start: tuple, law: object, duration: float) -> float:
    """Return the tilt (deg) at the end of a flight by a law, just before the plan ends."""
    flight = st.simulate(body, *start, controller=law, t_span=np.nextafter(duration, 0))
    return float(st.summary(body, flight)["tilt_end_deg"])


def right(point: dict) -> dict:
    """Plan a tumble for each body, and fly the plan without air in the air of the others."""
    start = morphology.start(bodies()["no air"], point)
    plans = {name: planned(body, start) for name, body in bodies().items()}
    told = {}
    for name, plan in plans.items():
        report = plan.report
        off = report["open_loop_attitude_error_deg"] if report["converged"] else None
        told[f"{name}: tilt_deg"] = 180.0 if off is None else off
        told |= {f"{name}: {what}": report[what] for what in ("energy_J", "duration_s")}
    plain = plans["no air"]
    motion, length = plain.trajectory, plain.duration
    for name, body in IGNORING.items():
        torques = st.TorqueTable(motion.t, motion.tau)
        told[f"{name}: tilt_deg"] = tilt(bodies()[body], start, torques, length)
    for name, body in FOLLOWED.items():
        law = st.Pfl(bodies()[body], plain)
        told[f"{name}: tilt_deg"] = tilt(bodies()[body], start, law, length)
    return told


def swept(folder: Path, tumbles: int) -> Sweep:
    """Make the missing rows, and return all."""
    bodies()  # built once, before many processes need them
    given = {"store": folder / "rows", "executor": "processes", "of": VERSION}
    return st.sweep(None, OVER, right, points=tumbles, seed=1, **given)


def column(rows: list[dict], name: str, what: str) -> np.ndarray:
    """Return the values of a column, NaN where a row failed."""
    return np.array([row.get(f"{name}: {what}", np.nan) for row in rows], float)


def righted(rows: list[dict], name: str) -> np.ndarray:
    """Tell for each row if it ends upright."""
    return column(rows, name, "tilt_deg") < morphology.UPRIGHT


def compared(rows: list[dict]) -> np.ndarray:
    """Tell for each row if all three plans right the rat: of these energies are compared."""
    return np.all([righted(rows, name) for name in BODIES], axis=0)


def table(rows: list[dict]) -> list[dict]:
    """Return for each way to plan the share righted (%), the median tilt (deg), and the median
    energy (mJ) and duration (ms) of the tumbles that all three plans right.
    """
    found, both = [], compared(rows)
    for name in (*BODIES, *IGNORING, *FOLLOWED):
        each = {"plan": name, "righted_percent": 100 * righted(rows, name).mean()}
        each["tilt_deg"] = np.median(column(rows, name, "tilt_deg"))
        if name in BODIES:
            each["energy_mJ"] = 1e3 * np.median(column(rows, name, "energy_J")[both])
            each["duration_ms"] = 1e3 * np.median(column(rows, name, "duration_s")[both])
        found.append({key: v if key == "plan" else round(float(v), 2) for key, v in each.items()})
    return found


def draw(rows: list[dict], path: Path) -> tuple[Figure, np.ndarray]:
    """Draw how far tumbles end from upright, and the energies and durations of the plans."""

    def make() -> tuple[Figure, np.ndarray]:
        figure = Figure(figsize=(7.2, 3.2), layout="constrained")
        axes = figure.subplots(1, 3, width_ratios=(2, 1, 1))
        draw_tilts(axes[0], rows)
        both = compared(rows)
        for panel, what, factor, label in (
            (axes[1], "energy_J", 1e3, "energy (mJ)"),
            (axes[2], "duration_s", 1e3, "duration (ms)"),
        ):
            values = [factor * column(rows, name, what)[both] for name in BODIES]
            panel.boxplot(values, whis=(5, 95), showfliers=False, medianprops={"color": "k"})
            panel.set_xticks(range(1, 4), ["none", "bare", "tuft"])
            panel.set_ylabel(label)
        return figure, axes

    return drawn(make, path)


def draw_tilts(panel: Axes, rows: list[dict]) -> None:
    """Draw the share of tumbles that end within a tilt."""
    share = 100 * np.arange(1, len(rows) + 1) / len(rows)
    for name in (*BODIES, *IGNORING, *FOLLOWED):
        body = (IGNORING | FOLLOWED).get(name, name)
        style = "--" if name in IGNORING else ":" if name in FOLLOWED else "-"
        ends = np.sort(column(rows, name, "tilt_deg"))
        panel.plot(ends, share, style, color=COLORS[body], label=name)
    panel.axvline(morphology.UPRIGHT, color="0.6", lw=0.8)
    panel.set(xlim=(-2, 180), ylim=(0, 101), xlabel="tilt at the end (deg)")
    panel.set_ylabel("tumbles within (%)")
    panel.legend(fontsize="x-small", loc="lower right")


def study(folder: Path, tumbles: int) -> None:
    """Compute the missing tumbles of the study, and write its figure and summary."""
    folder.mkdir(parents=True, exist_ok=True)
    found = swept(folder, tumbles)
    rows = found.rows()
    draw(rows, folder / "air.png")
    summary = {"tumbles": len(rows), "compared": int(compared(rows).sum()), "table": table(rows)}
    (folder / "summary.json").write_text(json.dumps(summary, indent=1) + "\n")
    print("\n".join([str(found.status()), *(str(each) for each in summary["table"])]))
    print(f"written: air.png and summary.json in {folder}")
