"""Friction and stiffness of the ground from one landing, and how often their intervals are right.

Cameras see five markers on a rat that falls onto its feet and slides: 32 frames at 200 Hz, 11 of
them in flight, with 0.5 mm of noise. The start is estimated, too. All else is known: the legs'
angles, the body, the other parameters of the ground.
"""

import json
from functools import partial
from pathlib import Path

import numpy as np
from scipy.optimize import least_squares

import serpentail as st
from examples.front import ROOT
from examples.studies.landing import SOURCES
from examples.studies.parts import Part, digest, made

TRIALS, SEED = 60, 40
FRAMES, FLOWN, RATE, NOISE = 32, 8, 200.0, 5e-4  # FLOWN: surely in flight; Hz; m
WANTED = ("mu", "K_n")  # their logarithms are estimated, so intervals stay above 0
LEGS = st.Legs.fixed("230 deg", "-20 deg")
STEP, WIDTH = 1e-4, 1.959964  # of differences; of 95 %, in standard deviations
SPREAD = np.repeat([2e-3, 0.03, 0.03, 0.3], [3, 5, 3, 5])  # of starts: m, rad, m/s, rad/s
TORSO = {"nose": (0, 0.05, 0.01), "left": (-0.025, -0.02, 0.02), "right": (0.025, -0.02, 0.02)}
MARKERS = {name: st.Marker(torso=place) for name, place in TORSO.items()}
MARKERS |= {f"tail{k}": st.Marker(tail=k / 2) for k in (1, 2)}


def scene() -> tuple:
    """Return the model, and the start of a landing: q and v."""
    model = st.build("kick", purpose=["simulate"]).with_parameters(mu=0.5)
    return model, *model.state(height="100 mm", pitch="3 deg", velocity=[0, 0.6, -0.8])


def seen(
    model: st.Model, q: np.ndarray, v: np.ndarray, x: np.ndarray, frames: int = FRAMES
) -> np.ndarray:
    """Return the markers (frames, M, 3) of a landing, in m.

    x: changes of the logarithms of WANTED, then of the start q, v over SPREAD (nv numbers each).
    """
    ground = {
        name: model.parameters[name] * np.exp(by) for name, by in zip(WANTED, x, strict=False)
    }
    model, (dq, dv) = model.with_parameters(**ground), SPREAD.reshape(2, -1) * x[2:].reshape(2, -1)
    start, end = (model.integrate(q, dq, 1.0), v + dv), (frames - 1) / RATE
    motion = st.simulate(model, *start, end, legs=LEGS, rtol=1e-8, output_step=1 / RATE)
    return st.marker_positions(model, motion.q, MARKERS)


def identified(tracks: np.ndarray, model: st.Model, q: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Return low, value and high (3, 2) of the parameters WANTED: maximum likelihood, 95 %.

    tracks: markers (FRAMES, M, 3) in m; model, q, v: what the search begins with.
    """

    def missed(x: np.ndarray, frames: int) -> np.ndarray:
        return ((seen(model, q, v, x - 1, frames) - tracks[:frames]) / NOISE).ravel()

    # the start from the flight; SciPy's steps are shares of x, begun at 1
    x = np.ones(2 * model.nv)
    flown = least_squares(lambda x: missed(np.append([1, 1], x), FLOWN), x, diff_step=STEP)
    # all from there; from another mu if it ends where no foot slides, which tells no mu
    for mu in (1.0, 0.5, 1.5):
        begin = np.concatenate([[mu, 1.0], flown.x])
        found = least_squares(missed, begin, diff_step=STEP, args=(FRAMES,))
        if np.linalg.norm(found.jac[:, 0]) > 1:
            break
    else:
        raise ValueError("tracks: no foot slides, so mu has no interval: record a faster landing")
    std = np.sqrt(np.diag(np.linalg.inv(found.jac.T @ found.jac)))[:2]
    values = [model.parameters[name] for name in WANTED]
    return values * np.exp(found.x[:2] - 1 + WIDTH * np.outer([-1, 0, 1], std))


def landing(number: int) -> dict:
    """Return the truth and what is identified of one random landing: mu, and K_n in N/m^1.5."""
    random, (model, q, v) = np.random.default_rng([SEED, number]), scene()
    factors = random.uniform(0.6, 1.6), np.exp(random.uniform(-np.log(2), np.log(2)))
    true = np.append(np.log(factors), random.standard_normal(len(SPREAD)))
    exact = seen(model, q, v, true)
    found = identified(exact + NOISE * random.standard_normal(exact.shape), model, q, v)
    begin = [model.parameters[name] for name in WANTED]
    return {"truth": (begin * np.exp(true[:2])).tolist(), "found": found.tolist()}


def study(folder: Path) -> None:
    """Identify all landings, write summary.json and print how many intervals hold the truth."""
    scene()
    of = {"program": digest(*(ROOT / source for source in SOURCES))}
    parts = {f"landing_{k}": Part(partial(landing, k), of | {"landing": k}) for k in range(TRIALS)}
    rows = [*made("ground", folder / "parts", parts).values()]
    (folder / "summary.json").write_text(json.dumps(rows, indent=1) + "\n")
    truth = np.array([row["truth"] for row in rows])
    low, value, high = np.moveaxis(np.array([row["found"] for row in rows]), 1, 0)
    print("| parameter | intervals that hold the truth | median half width, % |\n|---|---|---|")
    held, half = ((low < truth) & (truth < high)).sum(axis=0), np.median(high / value - 1, axis=0)
    for name, count, width in zip(WANTED, held, half, strict=True):
        print(f"| {name} | {count} of {len(rows)} | {100 * width:.1f} |")
