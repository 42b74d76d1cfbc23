"""Where 0.5 s of impact of a (3, 4) tail by ros34pw2 at rtol 1e-4 spends its processor time.

Calls of the model's C, their times at the run's own states, and the rest of a call of st.simulate.
Rejected steps are given as their share of all tried steps. The search for touches and the sums of
work and impulses belong to the rest, as do stages, errors and samples.
"""

import time
from pathlib import Path

import numpy as np

import serpentail as st
from benchmarks.models import timed_function
from benchmarks.scenes import DAMPING, ERROR, error_at_end, exact_run, impact
from benchmarks.timing import States, time_rounds

SAMPLES, ROUNDS, RUNS = 400, 200, 40
STAGES = 4  # of ros34pw2, a solution each
HOW = {"method": "ros34pw2", "rtol": 1e-4}


def measured(folder: Path) -> list[dict]:
    """Return a row for each part of a run."""
    run, span = impact()
    exact, motions, calls = exact_run(run, span), [], []
    for _ in range(RUNS):
        begun = time.process_time()
        motions.append(run(output_step=span, **HOW))
        calls.append(time.process_time() - begun)
    info, error = motions[0].info, error_at_end(motions[0], exact)
    assert error < ERROR, error
    whole, inside = min(calls), min(motion.info["cpu_seconds"] for motion in motions)
    solved = info["factorisations"]
    counts = {"contact_rates": info["evaluations"], "implicit_factor": solved}
    counts["implicit_solve"] = STAGES * solved
    each = seconds_of_calls(run(output_step=span / SAMPLES, **HOW), folder)
    rows = [row(name, count, count * each[name], whole) for name, count in counts.items()]
    known = sum(counts[name] * each[name] for name in counts)
    rows.append(row("all else in C", "", inside - known, whole))
    rows.append(row("Python", "", whole - inside, whole))
    rows.append(row("all", "", whole, whole) | {"error": error})
    rejected = info["rejected"] / (info["steps"] + info["rejected"]) * inside
    return [*rows, row("of it rejected steps", info["rejected"], rejected, whole)]


def row(part: str, calls: object, seconds: float, whole: float) -> dict:
    """Return a row of the table."""
    return {"part": part, "calls": calls, "ms": 1e3 * seconds, "share": f"{seconds / whole:.0%}"}


def seconds_of_calls(motion: st.Trajectory, folder: Path) -> dict[str, float]:
    """Return seconds of one call of each function at the samples of a motion."""
    model, contact, count = motion.model, motion.contact, len(motion.t)
    given = {"q": motion.q, "v": motion.v, "tau": motion.tau}
    given["bristles"] = contact.bristles.reshape(count, -1)
    given["legs"] = np.hstack([contact.legs, 0 * contact.legs])
    given["damping"] = np.full((count, model.nv - 6), DAMPING)
    given["gains"] = np.zeros((count, 2))
    given["weight"] = np.tile([1e-5, 1.0], (count, 1))
    found = {}
    for name in ("contact_rates", "implicit_factor", "implicit_solve"):
        kernel = model.kernel(name)
        shapes = zip(kernel.names, kernel.shapes, strict=True)
        # right-hand sides may be any numbers
        inputs = [given.get(n, np.full((count, *shape), 1e-3)) for n, shape in shapes]
        rest = [x for n, x in zip(kernel.names, inputs, strict=True) if n not in ("q", "v")]
        ours = timed_function(model, folder, name)
        states = States(motion.q, motion.v, np.hstack([x.reshape(count, -1) for x in rest]))
        found[name] = 1e-9 * time_rounds([ours.closure], states, ROUNDS, count)[0]
        if name == "implicit_factor":
            given["factors"] = kernel(*inputs)
    return found
