"""The value of a tail for righting, against its segments, length, mass and taper."""

import json
from functools import cache
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

import serpentail as st
from examples import righting
from examples.studies.morphology_figures import draw
from serpentail.bridges.sweeps.sweep import Sweep

LINKS = 6  # of every tail
SEGMENTS = (1, 2, 3)
LENGTH, MASS = 0.19466, 0.00351  # m, kg: the kangaroo rat's
DENSITY = 1000.0  # kg/m^3
SHORTEST = 0.15  # s
INTERVALS = 8
ITERATIONS, LIMIT = 120, 60.0  # of a plan's search, and s that a row may take
UPRIGHT = 10.0  # deg from upright at the landing, when the torques are applied
TAPERED = {
    "length": LENGTH,
    "radii": [0.003, 0.001],
    "density": DENSITY,
}  # gives links of their own
VERSION = 2  # of what makes a row
OVER = {
    "length": st.sobol(0.5, 1.5, "log"),  # of the rat's
    "mass": st.sobol(0.25, 4.0, "log"),  # of the rat's
    "taper": st.sobol(0.1, 1.0),  # radius of the tip over that of the base
    "pitch": st.sobol(0.0, 2 * np.pi),  # rad, of the torso at the start; R = Rz Rx Ry
    "roll": st.sobol(-0.3, 0.3),
    "yaw": st.sobol(-0.3, 0.3),
    "pitch_rate": st.sobol(10.0, 28.0),  # rad/s
    "other_rates": st.sobol([-6.0, -6.0], [6.0, 6.0]),
}


def cone(length: float, mass: float, taper: float) -> dict[str, np.ndarray]:
    """Return the links of a cone that is cut into equal lengths, as parameters.

    Its density is fixed, so that mass, length and taper determine its radii. Gauss's rule of five
    nodes is exact, because the inertia of a link is an integral of a polynomial of degree 4.
    """
    area = mass / (DENSITY * length * (1 + taper + taper**2) / 3)  # of the base
    nodes, weights = np.polynomial.legendre.leggauss(5)
    each = length / LINKS
    s = (np.arange(LINKS)[:, None] + (nodes + 1) / 2) * each
    section = area * (1 - (1 - taper) * s / length) ** 2
    dm = DENSITY * section * weights * each / 2
    masses = dm.sum(axis=1)
    centers = (dm * (s - np.arange(LINKS)[:, None] * each)).sum(axis=1) / masses
    off = s - (np.arange(LINKS)[:, None] * each + centers[:, None])
    axial = (dm * section / (2 * np.pi)).sum(axis=1)
    across = (dm * (off**2 + section / (4 * np.pi))).sum(axis=1)
    return {
        "link_masses": masses,
        "link_lengths": np.full(LINKS, each),
        "link_centers": centers,
        "link_inertias": np.stack([across, axial, across], axis=1).ravel(),
    }


@cache
def tail(segments: int) -> st.Model:
    """Return the model of a tail whose links have their own parameters."""
    shape = {"tail": "articulated", "segments": segments, "links": LINKS // segments}
    return st.build(**shape, taper=TAPERED, functions=righting.FUNCTIONS.split(","))


def start(model: st.Model, point: dict) -> tuple[np.ndarray, np.ndarray]:
    """Return q0, v0 of a tumble: the tail is straight and at rest on the torso."""
    q, v = np.zeros(model.nq), np.zeros(model.nv)
    attitude = Rotation.from_euler("ZXY", [point["yaw"], point["pitch"], point["roll"]])
    q[2], q[3:7] = righting.HEIGHT, attitude.as_quat(scalar_first=True)
    v[:3], v[3:6] = righting.VELOCITY, (point["pitch_rate"], *point["other_rates"])
    return q, v


def right(point: dict) -> dict:
    """Plan the righting from one tumble by one tail."""
    links = cone(LENGTH * point["length"], MASS * point["mass"], point["taper"])
    model = tail(point["segments"]).with_parameters(**links)
    plan = st.plan(
        model,
        start=start(model, point),
        goal=st.Goal(torso_rate=None),
        bounds=righting.bounds(model),
        duration=(SHORTEST, righting.FLIGHT),
        mesh=st.Mesh(intervals=INTERVALS),
        tolerances=st.Tolerances(attitude=None),
        solver=st.Solver(retries=0, track=False, options={"fatrop.max_iter": ITERATIONS}),
    )
    told = plan.report
    off = told["open_loop_attitude_error_deg"]
    return {
        "righted": bool(told["converged"] and off is not None and off < UPRIGHT),
        "off_deg": off,
        "energy_J": told["energy_J"],
        "duration_s": told["duration_s"],
        "cpu_s": told["solve_cpu_s"],
        "iterations": told["iterations"],
        "motion": plan,
    }


def swept(folder: Path, points: int, executor: str | None) -> Sweep:
    """Make the missing plans, and return all."""
    for segments in SEGMENTS:  # built once, before many processes need it
        tail(segments)
    given = {"store": folder / "rows", "limit": LIMIT, "executor": executor, "of": VERSION}
    over = {"segments": st.grid(SEGMENTS)} | OVER
    return st.sweep(None, over, right, points=points, seed=1, **given)


def table(rows: list[dict]) -> str:
    """Return a table of the results for each number of segments; medians are of the plans that
    right the animal.
    """
    lines = ["| segments | plans | righted | energy, median | duration, median |"]
    lines.append("|---" * 5 + "|")
    for segments in SEGMENTS:
        own = [row for row in rows if row["segments"] == segments]
        good = [row for row in own if row.get("righted")]
        if good:
            energy = 1e3 * np.median([row["energy_J"] for row in good])
            duration = 1e3 * np.median([row["duration_s"] for row in good])
            cells = f"{len(good) / len(own):.0%} | {energy:.1f} mJ | {duration:.0f} ms"
            lines.append(f"| {segments} | {len(own)} | {cells} |")
    return "\n".join(lines)


def study(folder: Path, points: int, executor: str | None) -> None:
    """Compute the missing plans of the study, and write its figure and summary."""
    folder.mkdir(parents=True, exist_ok=True)
    found = swept(folder, points, executor)
    rows = found.rows()
    draw(rows, folder / "morphology.png")
    told = table(rows)
    found.save(folder / "rows.csv")
    status = found.status()
    summary = {"plans": status.points, "failed": status.failed, "table": told.splitlines()}
    (folder / "summary.json").write_text(json.dumps(summary, indent=1) + "\n")
    print(f"{status}\n{told}\nwritten: morphology.png, rows.csv and summary.json in {folder}")
