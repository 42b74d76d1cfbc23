"""Errors of exact derivatives against differences, at folded, straight and fast poses."""

import numpy as np

from stress.figures import Figure
from stress.poses import FAST, folds
from stress.subjects import Subject, state, subject
from tests.references.metrics import block_error

STEP = 2.0**-7
STENCIL = {1: 4 / 5, 2: -1 / 5, 3: 4 / 105, 4: -1 / 280}  # central differences of order 8
LIMIT = 1e-11  # of the differences of a reference that is rounded to double


def moved(q: np.ndarray, u: np.ndarray, t: float) -> np.ndarray:
    """Return q moved for t along the velocity u, the torso turned by Exp(t omega)."""
    half = t * u[3:6] / 2
    angle = np.linalg.norm(half)
    w, e = np.cos(angle), half * np.sinc(angle / np.pi)
    a, b = q[3], q[4:7]
    turned = np.concatenate([[a * w - b @ e], a * e + w * b + np.cross(b, e)])
    return np.concatenate([q[:3] + t * u[:3], turned, q[7:] + t * u[6:]])


def slope(force) -> np.ndarray:
    """Return the derivative of a function of a number at 0."""
    return (
        sum(weight * (force(k * STEP) - force(-k * STEP)) for k, weight in STENCIL.items()) / STEP
    )


def errors(of: Subject, rng, bends: np.ndarray, speeds) -> dict[str, float]:
    """Return the errors of dq and dv of H v_dot + C along a direction, each relative to its largest
    block.
    """
    q, v, _ = state(of, rng, bends, speeds)
    v_dot, u = rng.normal(size=of.model.nv), rng.uniform(-1, 1, of.model.nv)
    dq, dv = of.model.inverse_dynamics_derivatives(q, v, v_dot)
    by_q = slope(lambda t: of.exact.inverse_dynamics(moved(q, u, t), v, v_dot))
    by_v = (
        slope(lambda t: of.exact.inverse_dynamics(q, v + t * np.abs(v).max() * u, v_dot))
        / np.abs(v).max()
    )
    return {"dq": block_error(dq @ u, by_q), "dv": block_error(dv @ u, by_v)}


def measured() -> list[Figure]:
    """Return errors at straight, nearly straight, folded and coiled tails, and at 1e3 rad/s."""
    rng, found = np.random.default_rng(10), []
    for size in ((1, 3), (2, 2), (1, None)):
        of = subject(*size)
        reach = (
            0.95 if of.model.links is None else 1.0
        )  # the differences keep within the bend range
        poses = {name: reach * bends for name, bends in folds(of).items()}
        poses |= {f"theta {t:g}": t * np.ones(of.model.nv - 6) for t in (0.0, 1e-300, 1e-12, 1e-4)}
        for name, bends in poses.items():
            rows = errors(of, rng, bends, (2.0, 20.0, 10.0))
            found += [
                Figure(f"{of.name}, {name}: {key}", error, LIMIT) for key, error in rows.items()
            ]
        rows = errors(of, rng, rng.uniform(-1, 1, of.model.nv - 6), FAST)
        found += [
            Figure(f"{of.name}, 1e3 rad/s: {key}", error, LIMIT) for key, error in rows.items()
        ]
    return found
