"""How often the intervals of identified parameters cover the truth: 400 generated trials a case.

Known torques: the parameters of an elastic tail from noisy markers with gaps; the spread of the
estimates is compared with the Cramer-Rao bound. Unknown torques: each trial draws its own from the
stated prior; geometry, the position of a marker and the torques are estimated. Prints both tables.
"""

import json
import time
from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp
from scipy.special import ndtri

import serpentail as st
from serpentail.basics.progress import Stage
from serpentail.identification.placement import placements
from serpentail.identification.unknowns import unknowns

FRAMES, RATE, NOISE, GAPS = 31, 200.0, 5e-4, 0.1
KNOWN = ("tail_mass", "tail_length", "tail_stiffness[same]", "tail_damping[same]")
UNKNOWN = ("tail_mass", "tail_length", "marker:tail2")
STD, TIME = 1e-3, 0.03  # N m and s of the torques' prior
LEVEL = 0.95


def scene(segments: int, links: int | None):
    """Return the model, and the positions of its markers: four on the torso, four along the
    tail.
    """
    kind = {"tail": "articulated", "links": links} if links else {"tail": "continuum"}
    model = st.build(
        segments=segments,
        purpose=["identify"],
        tail_stiffness=2e-3,
        tail_damping=5e-5,
        tail_rest=0.0,
        **kind,
    )
    torso = {"nose": (0, 0.05, 0.01), "left": (-0.025, -0.02, 0.02)}
    torso |= {"right": (0.025, -0.02, 0.02), "back": (0, 0, 0.03)}
    markers = {name: st.Marker(torso=place) for name, place in torso.items()}
    for k in range(1, 5):
        markers[f"tail{k}"] = st.Marker(tail=k / 4, offset=(0, 0, 0.003))
    return model, markers


def start(model):
    """Return a tumbling state with a bent tail."""
    rng = np.random.default_rng(7)
    q = np.concatenate([[0, 0, 0.5, 1, 0, 0, 0], 0.2 * rng.standard_normal(model.nq - 7)])
    v = np.concatenate([[0, 0.3, 1.5, 4, 2, -3], 6 * rng.standard_normal(model.nq - 7)])
    return np.concatenate([q, v])


def flown(model, times, torques, fine):
    """Return states at times under torques (K, 2m) at fine times, linear in between, by SciPy."""

    def rate(t, x):
        return model.x_dot(x, [np.interp(t, fine, each) for each in torques.T])

    return solve_ivp(
        rate,
        (times[0], times[-1]),
        start(model),
        t_eval=times,
        rtol=1e-8,
        atol=1e-10,
        max_step=fine[1] - fine[0] if torques.any() else np.inf,
    ).y.T


def drawn(fine, nt, rng):
    """Return torques (K, 2m) of the prior: an Ornstein-Uhlenbeck process, exact at fine times."""
    decay = np.exp(-(fine[1] - fine[0]) / TIME)
    tau = STD * rng.standard_normal((len(fine), nt))
    for k in range(1, len(fine)):
        tau[k] = decay * tau[k - 1] + np.sqrt(1 - decay**2) * tau[k]
    return tau


def seen(model, markers, times, states, rng):
    """Return noisy tracks with gaps."""
    points = st.marker_positions(model, states[:, : model.nq], markers)
    points = points + NOISE * rng.standard_normal(points.shape)
    points[rng.random(points.shape[:2]) < GAPS] = np.nan
    return st.marker_tracks(times, points, list(markers), unit="m")


def coverage(count: int, case: str, size: tuple[int, int | None], folder: Path) -> dict:
    """Return coverage, spread and time of a number of trials, resuming from those that are
    stored.
    """
    model, markers = scene(*size)
    names = KNOWN if case == "known" else UNKNOWN
    kept = folder / f"{case}_{'x'.join(map(str, size))}.jsonl"
    rows = [json.loads(line) for line in kept.read_text().splitlines()] if kept.exists() else []
    with Stage("trials", case) as stage:
        for seed in range(len(rows), count):
            stage.tell(seed / count)
            rows.append(trial(model, markers, case, seed))
            with kept.open("a") as file:
                file.write(json.dumps(rows[-1]) + "\n")
    return judged(rows[:count], [each.name for each in found_names(model, markers, names)], model)


def trial(model, markers, case: str, seed: int) -> dict:
    """Return estimates, their standard deviations and the processor time of one trial."""
    rng, nt = np.random.default_rng([seed, 20]), model.nq - 7
    times = np.arange(FRAMES) / RATE
    fine = np.linspace(0, times[-1], 10 * (FRAMES - 1) + 1)
    known = case == "known"
    tau = np.zeros((len(fine), nt)) if known else drawn(fine, nt, rng)
    data = seen(model, markers, times, flown(model, times, tau, fine), rng)
    prior, names = (None, KNOWN) if known else (st.TorquePrior(STD, TIME), UNKNOWN)
    begun = time.process_time()
    found = st.identify(model, data, markers, names, torques=prior, noise=NOISE)
    row = {
        "seconds": time.process_time() - begun,
        "success": found.success,
        "values": [each.value for each in found.parameters],
        "std": [each.std for each in found.parameters],
    }
    if prior is not None:
        bands = found.trials[0].torques
        true = np.stack([np.interp(bands.times, fine, each) for each in tau.T], axis=1)
        row["torques"] = float(((bands.low < true) & (true < bands.high)).mean())
    return row


def found_names(model, markers, names):
    """Return the estimated numbers."""
    return unknowns(placements(model, markers), names).each


def judged(rows: list[dict], names: list[str], model) -> dict:
    """Return how often intervals cover the truth, and variances over the bound."""
    p, reach = model.parameters, ndtri((1 + LEVEL) / 2)
    known = {"tail_mass": p["tail_mass"], "tail_length": p["tail_length"]}
    known |= {"tail_stiffness[same]": p["tail_stiffness"][0]}
    known |= {"tail_damping[same]": p["tail_damping"][0], "marker:tail2.z": 0.003}
    truth = np.array([known.get(name, 0.0) for name in names])
    values, std = (np.array([row[key] for row in rows]) for key in ("values", "std"))
    covered = np.abs(values - truth) < reach * std
    report = {
        "trials": len(rows),
        "converged": sum(row["success"] for row in rows),
        "cpu_s": float(np.median([row["seconds"] for row in rows])),
        "coverage": dict(zip(names, covered.mean(axis=0).tolist(), strict=True)),
        "coverage of all": float(covered.mean()),
        "variance over bound": dict(
            zip(names, (values.var(axis=0, ddof=1) / (std**2).mean(axis=0)).tolist(), strict=True)
        ),
    }
    if "torques" in rows[0]:
        report["coverage of torques"] = float(np.mean([row["torques"] for row in rows]))
    return report


def study(folder: Path, trials: int, segments: int, links: int) -> None:
    """Run both cases and print them."""
    folder.mkdir(parents=True, exist_ok=True)
    for case in ("known", "unknown"):
        found = coverage(trials, case, (segments, links or None), folder)
        print(case, json.dumps(found, indent=1), flush=True)
