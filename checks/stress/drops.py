"""Drops animals on the ground by every method: none may gain energy."""

from collections import Counter
from functools import cache

import numpy as np

import serpentail as st
from checks.stress.figure import Figure
from tests.support.models import model_folder

METHODS = {
    "ros34pw2": 60,
    "tsit5": 60,
    "rk4": 40,
    "implicit_euler": 60,
    "lsoda": 8,
    "dop853": 8,
}  # drops each
DURATION = 0.5  # s
GAIN = 1e-6  # gain of energy by integration that is allowed, relative to the energy at the start
RANGE = "bent beyond the scene's bend_range"


@cache
def falling(segments: int, links: int | None, bend_range: float = 4 * np.pi) -> st.Model:
    """Return a model whose feet, tail and torso touch the ground."""
    options = {} if links else {"bend_range": bend_range}
    return st.load(model_folder(segments, links, contacts=["feet", "tail", "torso"], **options))


def start(model: st.Model, rng) -> tuple[np.ndarray, np.ndarray]:
    """Return q0, v0 above the ground, thrown and spinning."""
    quaternion = rng.normal(size=4)
    nt = model.nv - 6
    q = np.concatenate([[0, 0, rng.uniform(0.35, 0.6)], quaternion, rng.uniform(-0.5, 0.5, nt)])
    return q, np.concatenate([rng.uniform(-s, s, n) for s, n in ((2, 3), (20, 3), (10, nt))])


def dropped(model: st.Model, method: str, count: int, seed: int) -> tuple[list[float], Counter]:
    """Return the relative gain of energy of each drop that finished, and the number of refusals of
    each kind.
    """
    rng, gains, refusals = np.random.default_rng(seed), [], Counter()
    for _ in range(count):
        q, v = start(model, rng)
        legs = st.Legs.fixed(rng.uniform(2, 4.5), rng.uniform(-1.5, 1))
        settings = {
            "controller": st.Damping(1e-4),
            "legs": legs,
            "t_span": DURATION,
            "output_step": 0.01,
        }
        try:
            gains.append(gain(st.simulate(model, q, v, method=method, **settings)))
        except st.SimulationError as refusal:
            refusals[str(refusal).partition(" s ")[2]] += 1
    return gains, refusals


def gain(motion: st.Trajectory) -> float:
    """Return the largest excess of the energy over that at the start, relative to it; NaN if a
    value is not finite.

    The ground, its friction and the joints only take energy, and fixed legs give none.
    """
    arrays = (motion.q, motion.v, motion.tau, motion.contact.forces, motion.contact.bristles)
    energy = motion.kinetic + motion.potential
    if not all(np.isfinite(a).all() for a in arrays):
        return np.nan
    return float((energy.max() - energy[0]) / abs(energy[0]))


def measured() -> list[Figure]:
    """Return the largest gain, and the number of refused drops, by tail and method."""
    found = []
    for size in ((1, 3), (1, None)):
        model = falling(*size)
        for method, count in METHODS.items():
            gains, refusals = dropped(model, method, count, seed=11)
            note = "; ".join(f"{n} of {count} refused: {words}" for words, n in refusals.items())
            what = f"{model.name} by {method}, {count} drops"
            found.append(Figure(f"{what}: gain of energy", np.max(gains, initial=0.0), GAIN, note))
            unnamed = sum(n for words, n in refusals.items() if RANGE not in words)
            found.append(Figure(f"{what}: refused for other reasons than bend_range", unnamed, 0))
    return found
