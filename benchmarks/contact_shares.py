"""Where a run on the ground spends its time: in calls of the model's C, and elsewhere."""

if __name__ == "__main__":
    from benchmarks import alone

    alone.main("contact_shares", __doc__)

import time
from pathlib import Path

import numpy as np

import serpentail as st
from benchmarks.simulations import DAMPING, ERROR, impact
from serpentail.model.kernel import RunKernel

SAMPLES, ROUNDS, RUNS = 400, 200, 40
STAGES = 4  # of ros34pw2, a solution each
RTOL = 1e-4


def contact_shares(folder: Path) -> list[dict]:
    """0.5 s of impact of a (3, 4) tail by ros34pw2 at rtol 1e-4: calls of the model's C, their
    times at the run's own states, and the rest of a call of st.simulate; processor time. Rejected
    steps are given as their share of all tried steps. The search for touches and the sums of work
    and impulses belong to the rest, as do stages, errors and samples.
    """
    run, span = impact()
    exact = run(method="tsit5", rtol=1e-12, atol=1e-13, output_step=span)
    motions, calls = [], []
    for _ in range(RUNS):
        begun = time.process_time()
        motions.append(run(method="ros34pw2", rtol=RTOL, output_step=span))
        calls.append(time.process_time() - begun)
    info, error = motions[0].info, float(np.abs(motions[0].q[-1] - exact.q[-1]).max())
    assert error < ERROR, error
    whole, inside = min(calls), min(motion.info["cpu_seconds"] for motion in motions)
    counts = {
        "contact_rates": info["evaluations"],
        "implicit_factor": info["factorisations"],
        "implicit_solve": STAGES * info["factorisations"],
    }
    each = unit_times(run(method="ros34pw2", rtol=RTOL, output_step=span / SAMPLES))
    rows = [row(name, count, count * each[name], whole) for name, count in counts.items()]
    known = sum(counts[name] * each[name] for name in counts)
    rows.append(row("all else in C", "", inside - known, whole))
    rows.append(row("Python", "", whole - inside, whole))
    rows.append(row("all", "", whole, whole) | {"error": error})
    tried = info["steps"] + info["rejected"]
    rejected = info["rejected"] / tried * inside
    return [*rows, row("of it rejected steps", info["rejected"], rejected, whole)]


def row(part: str, calls: object, seconds: float, whole: float) -> dict:
    """Return a row of the table."""
    return {"part": part, "calls": calls, "ms": 1e3 * seconds, "share": f"{seconds / whole:.0%}"}


def unit_times(motion: st.Trajectory) -> dict[str, float]:
    """Return seconds of one call of each function at the samples of a motion, with the factors
    found there.
    """
    model, contact, count = motion.model, motion.contact, len(motion.t)
    given = {
        "q": motion.q,
        "v": motion.v,
        "tau": motion.tau,
        "bristles": contact.bristles.reshape(count, -1),
        "legs": np.hstack([contact.legs, 0 * contact.legs]),
        "damping": np.full((count, model.nv - 6), DAMPING),
        "gains": np.zeros((count, 2)),
        "weight": np.tile([1e-5, 1.0], (count, 1)),
    }
    found = {}
    for name in ("contact_rates", "implicit_factor", "implicit_solve"):
        kernel = model.kernel(name)
        shapes = zip(kernel.names, kernel.shapes, strict=True)
        inputs = [
            np.array(given.get(field, np.full((count, *shape), 1e-3)))[None]
            for field, shape in shapes
        ]
        outputs = [np.zeros((1, count, *shape)) for shape in kernel.out_shapes]
        evaluate = RunKernel(kernel, model.parameter_vector[None], inputs, outputs)
        found[name] = min(timed(evaluate, count) for _ in range(ROUNDS)) / count
        if name == "implicit_factor":
            given["factors"] = outputs[0][0]
    return found


def timed(evaluate: RunKernel, count: int) -> float:
    """Return seconds of a number of rows."""
    begun = time.process_time()
    evaluate(0, count)
    return time.process_time() - begun
