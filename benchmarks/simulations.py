"""The fastest run of a generated method in each of four scenes of a (3, 4) tail.

Its error, largest of q at the end, is at most 1e-4. Times: least of five runs, for the caller, and
of the processor in the run itself. Beside it SciPy's LSODA on the compiled model, for the same
bound of the error, and for our actual error, which is far below the bound where stability, not
accuracy, limits our steps. Flight and tracking 0.6 s, sliding and impact 0.5 s.
"""

import time
from collections.abc import Callable
from pathlib import Path

import serpentail as st
from benchmarks.scenes import ERROR, SCENES, error_at_end, exact_run

RUNS = 5
SETTINGS = {
    "tsit5": [{"rtol": r} for r in (1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-8)],
    "ros34pw2": [{"rtol": r} for r in (1e-2, 1e-3, 3e-4, 1e-4, 3e-5, 1e-5, 1e-6)],
    "implicit_euler": [{"step": h} for h in (1e-3, 1e-4, 2e-5)],
    "rk4": [{"step": h} for h in (1e-3, 1e-4, 2e-5)],
    "lsoda": [{"rtol": r, "atol": r} for r in (1e-2, 1e-3, 3e-4, 1e-4, 3e-5, 1e-5, 1e-6, 1e-8)],
}


def measured(folder: Path) -> list[dict]:
    """Return a row for each scene."""
    found = []
    for name in SCENES:
        rows = scene_rows(name)
        ours = [row for row in rows if row["method"] != "lsoda"]
        lsoda = [row for row in rows if row["method"] == "lsoda"]
        own, beside = fastest(ours, ERROR), fastest(lsoda, ERROR)
        equal = fastest(lsoda, own["error"])
        row = (
            {"scene": name, "model": "(3, 4)"}
            | own
            | {"LSODA, ms": beside["ms"], "its error": beside["error"]}
        )
        row |= {"LSODA, ratio": beside["ms"] / own["ms"]}
        found.append(row | {"at our error": equal["ms"] / own["ms"]})
    return found


def scene_rows(name: str) -> list[dict]:
    """Return run time and error of every method and setting in one scene, of those that succeed."""
    run, span = SCENES[name]()
    exact, rows = exact_run(run, span), []
    for method, settings in SETTINGS.items():
        for options in settings:
            first, value = next(iter(options.items()))
            row = {"method": method, "setting": f"{first} {value:g}"}
            how = options | {"method": method, "output_step": span}
            try:
                rows.append(row | timed(run, how, exact, span))
            except st.SimulationError:  # its steps are too long
                continue
    return rows


def timed(run: Callable, how: dict, exact: st.Trajectory, span: float) -> dict:
    """Return the least times of some runs, and their error."""
    waits, motions = [], []
    for _ in range(RUNS):
        begun = time.perf_counter()
        motions.append(run(**how))
        waits.append(1e3 * (time.perf_counter() - begun))
    cpu = 1e3 * min(motion.info["cpu_seconds"] for motion in motions)
    row = {"ms": min(waits), "in C, ms": cpu, "error": error_at_end(motions[0], exact)}
    return row | {"times real time": 1e3 * span / min(waits)}


def fastest(rows: list[dict], error: float) -> dict:
    """Return the fastest run whose error does not exceed a bound."""
    return min((row for row in rows if row["error"] <= error), key=lambda row: row["ms"])
