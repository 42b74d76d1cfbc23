"""Flies for 1000 s and measures how far energy, momentum and attitude drift."""

from functools import cache

import numpy as np

import serpentail as st
from checks.stress.figure import Figure
from checks.stress.subjects import subject

TOLERANCE = 1e-8
DRIFT = 1e-5  # of energy and of angular momentum, without damping
FLOWN = [
    (size, damping)
    for size, damped in (((1, 3), 1e-6), ((3, 4), 1e-6), ((2, None), 1e-7))
    for damping in (0, damped)
]


def starting(model: st.Model) -> tuple[np.ndarray, np.ndarray]:
    """Return a moderate tumble."""
    rng = np.random.default_rng(9)
    q = np.concatenate([np.zeros(3), [1.0, 0, 0, 0], rng.uniform(-0.3, 0.3, model.nv - 6)])
    return q, np.concatenate([np.zeros(3), rng.uniform(-2, 2, 3), np.zeros(model.nv - 6)])


@cache
def flown(size: tuple, damping: float, duration: float) -> st.Trajectory:
    """Return a flight without gravity, so that potential energy does not hide changes of kinetic
    energy; if it is refused, return the part before.
    """
    model = subject(*size).model.with_parameters(gravity=0.0)
    settings = {
        "controller": st.Damping(damping),
        "t_span": duration,
        "output_step": duration / 200,
    }
    try:
        return st.simulate(
            model, *starting(model), method="tsit5", rtol=TOLERANCE, most_steps=2e7, **settings
        )
    except st.SimulationError as refusal:
        if refusal.trajectory is None:
            raise
        refusal.trajectory.info["refused"] = str(refusal)
        return refusal.trajectory


def measured(duration: float) -> list[Figure]:
    """Return drifts, each over the whole flight."""
    found = []
    for size, damping in FLOWN:
        motion = flown(size, damping, duration)
        name = f"{subject(*size).name}, damping {damping:g}, {motion.t[-1]:g} s"
        found += [
            *drifts(name, motion, damping),
            Figure(f"{name}: time not flown, s", duration - motion.t[-1], 0),
        ]
    return found


def drifts(name: str, motion: st.Trajectory, damping: float) -> list[Figure]:
    """Return drifts of energy (damped: its gain between samples), of angular momentum and of the
    quaternion.
    """
    energy = motion.kinetic / motion.kinetic[0]
    off = np.max(np.diff(energy)) if damping else np.max(np.abs(energy - 1))
    turning = np.linalg.norm(motion.angular_momentum - motion.angular_momentum[0], axis=1).max()
    turning /= np.linalg.norm(motion.angular_momentum[0])
    note = motion.info.get("refused", f"{motion.info['steps']} steps")
    return [
        Figure(
            f"{name}: energy gained" if damping else f"{name}: energy",
            off,
            0.0 if damping else DRIFT,
            note,
        ),
        Figure(f"{name}: angular momentum", turning, DRIFT),
        Figure(
            f"{name}: |quaternion| - 1",
            np.abs(np.linalg.norm(motion.q[:, 3:7], axis=1) - 1).max(),
            1e-15,
        ),
    ]
