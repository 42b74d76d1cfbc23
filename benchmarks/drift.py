"""Relative drift of energy and angular momentum in 10 s of undamped flight, and its run time.

RK4 at 0.1 ms.
"""

from pathlib import Path

import numpy as np

import serpentail as st
from benchmarks.models import built, label


def measured(folder: Path) -> list[dict]:
    """Return a row for each tail."""
    rows = []
    for size in ((1, 3), (3, 4)):
        model = built(*size)
        flight = st.simulate(model, *thrown(model), t_span=10.0, step=1e-4)
        energy, momentum = internal_energy(flight), flight.angular_momentum
        off, norm = np.abs(momentum - momentum[0]).max(), np.linalg.norm(flight.attitude, axis=1)
        row = {"model": label(*size), "energy": float(np.abs(energy / energy[0] - 1).max())}
        row |= {"angular momentum": float(off / np.linalg.norm(momentum[0]))}
        row |= {"quaternion's norm": float(np.abs(norm - 1).max())}
        rows.append(row | {"run time, s": flight.info["seconds"]})
    return rows


def thrown(model: st.Model) -> tuple[np.ndarray, np.ndarray]:
    """Return a state that spins about all axes with a bent tail."""
    q, v = np.zeros(model.nq), np.zeros(model.nv)
    q[3], q[7::2], q[8::2] = 1.0, 0.4 / model.links, 0.2 / model.links
    v[2], v[3:6] = 2.0, (6.0, 1.0, -2.0)
    return q, v


def internal_energy(flight: st.Trajectory) -> np.ndarray:
    """Return the kinetic energy about the centre of mass: constant in flight without torques."""
    mass = sum(flight.model.parameters[name] for name in ("torso_mass", "tail_mass"))
    return flight.kinetic - (flight.linear_momentum**2).sum(axis=1) / (2 * mass)
