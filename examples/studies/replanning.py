"""Tumbling starts whose plans are flown by three laws, under conditions that the plans do
not know.
"""

import json
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from itertools import pairwise
from pathlib import Path

import numpy as np

import serpentail as st
from examples import righting
from examples.front import ROOT
from examples.righting import TORQUE, tumbling
from examples.studies.parts import Part, digest, made
from serpentail.basics.attitude import product, tilt_deg

RATE = 100.0  # Hz, of the ticks
SOURCES = ("codegen", "runtime")
LAWS = ("open loop", "PFL", "MPC")
NOISE = np.radians(0.5), 0.05, np.radians(0.2), 0.5  # rad, rad/s of the torso; rad, rad/s: tail
PUSHED = 1.0  # rad/s, the torso's, at once, about a random axis, in the middle of the flight
STEP = 1e-3  # s, of the flights' RK4


@dataclass(frozen=True)
class Trial:
    """How a flight differs from its plan: factors of parameters, noise of measurements (in units of
    NOISE), delay (s) of the controller, a push (rad/s).
    """

    factors: dict = field(default_factory=dict)
    noise: float = 0.0
    delay: float = 0.0
    push: float = 0.0


def bodies(part: float) -> dict:
    """Return trials of bodies with parameters that are wrong by a fraction."""
    found = {}
    for name in ("tail_mass", "torso_inertia", "tail_length"):
        for sign in (1, -1):
            told = f"{name} {sign * part:+.0%}"
            found[told] = Trial({name: 1 + sign * part})
    return found


ALL = {"tail_mass": 1.15, "torso_inertia": 0.85}
TRIALS = {
    "as planned": Trial(),
    **bodies(0.15),
    "noise": Trial(noise=1.0),
    "push": Trial(push=PUSHED),
    "delay 5 ms, body": Trial(ALL, delay=5e-3),
    "delay 10 ms, body": Trial(ALL, delay=1e-2),
    "body, noise, push, delay 5 ms": Trial(ALL, 1.0, 5e-3, PUSHED),
}


def rat() -> st.Model:
    """Return the model of (1, 3) for which the flights are planned."""
    return righting.model(1, 3)


def body_of(model: st.Model, trial: Trial) -> st.Model:
    """Return the body that flies."""
    changes = {
        name: np.asarray(model.parameters[name]) * factor for name, factor in trial.factors.items()
    }
    return model.with_parameters(**changes) if changes else model


def measured(q: np.ndarray, v: np.ndarray, off: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the measured state; off (6 + 2 * 2m) are errors of attitude, angular velocity, angles
    and rates.
    """
    q, v, nt = q.copy(), v.copy(), len(q) - 7
    turn, spin, angles, rates = np.split(off, [3, 6, 6 + nt])
    q[3:7] = product(q[3:7], [1.0, *turn / 2])
    q[3:7] /= np.linalg.norm(q[3:7])
    q[7:] += angles
    v[3:6] += spin
    v[6:] += rates
    return q, v


def laws(model: st.Model, plan: st.Plan, trial: Trial) -> dict[str, tuple]:
    """Return laws by name: the action at a tick, and the torques (t, q, v) at any time."""
    pfl = st.Pfl(model, plan, torque=TORQUE)
    mpc = st.Mpc(model, plan, rate=RATE, delay=trial.delay)

    def nothing(_t: float, _q: np.ndarray, _v: np.ndarray) -> None:
        return None

    def tick(t: float, q: np.ndarray, v: np.ndarray) -> None:
        if t <= plan.duration - mpc.settings.rest - trial.delay + 1e-9:
            mpc.tick(t, q, v)

    return {
        "open loop": (nothing, lambda t, _q, _v: plan.torque(min(t, plan.duration))[0]),
        "PFL": (nothing, pfl),
        "MPC": (tick, lambda t, _q, _v: mpc.torque(min(t, plan.duration))),
    }


def flown(body: st.Model, plan: st.Plan, law: tuple, trial: Trial, seed: int) -> float:
    """Return the tilt (deg) at the end of a flight."""
    tick, torque = law
    random = np.random.default_rng([3, seed])
    q, v = plan.problem.q0, plan.problem.v0
    edges = np.append(np.arange(0.0, plan.duration - 1e-6, 1 / RATE), plan.duration)
    sizes = np.repeat(NOISE, [3, 3, len(q) - 7, len(q) - 7]) * trial.noise
    axis = random.normal(size=3)
    pushed = (len(edges) - 1) // 2
    for k, (begin, end) in enumerate(pairwise(edges)):
        if k == pushed:
            v = v.copy()
            v[3:6] += trial.push * axis / np.linalg.norm(axis)
        off = sizes * random.normal(size=len(sizes))
        tick(begin, *measured(q, v, off))
        law_now = _with_noise(torque, off)
        settings = {"controller": law_now, "method": "rk4", "step": STEP}
        span = (begin, end)
        run = st.simulate(body, q, v, t_span=span, output_step=end - begin, **settings)
        q, v = run.q[-1], run.v[-1]
    return float(tilt_deg(q[3:7]))


def _with_noise(torque: Callable, off: np.ndarray) -> Callable:
    """Return torques for measured states, with an error that is constant until the next tick."""

    def law(t: float, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        return torque(t, *measured(q, v, off))

    return law


def trials_of(seed: int) -> dict:
    """Return the tilts (deg) of a start by trial and law; empty if there is no true plan."""
    model = rat()
    plan = st.plan(
        model,
        start=tumbling(model, seed),
        duration=(0.3, 0.58),
        goal=st.Goal(torso_rate=None),
        bounds=st.Bounds(angle=np.pi / 3, torque=TORQUE),
    )
    if not plan.success:
        return {}
    return {
        title: {
            name: flown(body_of(model, trial), plan, law, trial, seed)
            for name, law in laws(model, plan, trial).items()
        }
        for title, trial in TRIALS.items()
    }


def flown_from(
    name: str, folder: Path, starts: int, trials: Callable[[int], dict], file: Path
) -> list[dict]:
    """Return the trials of all starts that have any, made in parallel; file: the study's own."""
    of = {"program": digest(file, *(ROOT / source for source in SOURCES))}
    rat()
    parts = {
        f"start_{seed}": Part(partial(trials, seed), of | {"seed": seed})
        for seed in range(900, 900 + starts)
    }
    return [rows for rows in made(name, folder / "parts", parts).values() if rows]


def study(folder: Path, starts: int) -> None:
    """Make all flights, write summary.json and tilts.png, and print a table."""
    found = flown_from("replanning", folder, starts, trials_of, Path(__file__))
    told = {
        title: {name: [rows[title][name] for rows in found] for name in LAWS} for title in TRIALS
    }
    (folder / "summary.json").write_text(json.dumps(told, indent=1) + "\n")
    _draw(told, folder / "tilts.png")
    print(f"{len(found)} true plans from {starts} starts; tilt at the end, deg: median, largest")
    print("| | " + " | ".join(LAWS) + " |\n|---" + "|---" * len(LAWS) + "|")
    for title, row in told.items():
        cells = (f"{np.median(row[name]):.2g}, {max(row[name]):.2g}" for name in LAWS)
        print(f"| {title} | " + " | ".join(cells) + " |")


def _draw(told: dict, path: Path) -> None:
    """Draw the tilts of all flights."""
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(figsize=(8, 4.5), layout="constrained")
    for k, name in enumerate(LAWS):
        for x, row in enumerate(told.values()):
            tilts = np.maximum(row[name], 1e-4)
            place = np.full(len(tilts), x + 0.25 * (k - 1))
            axes.plot(place, tilts, f"C{k}o", ms=3, label=name if x == 0 else None)
    axes.set_yscale("log")
    axes.set_ylabel("tilt at the end, deg")
    axes.set_xticks(range(len(told)), told, rotation=35, ha="right")
    axes.axhline(1.0, color="0.7", lw=0.8)
    axes.legend()
    figure.savefig(path, dpi=130)
    plt.close(figure)
