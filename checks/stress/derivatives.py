"""Errors of exact derivatives against differences, at folded, straight and fast poses."""

import numpy as np

from checks.stress.figure import Figure
from checks.stress.poses import FAST, folds
from checks.stress.subjects import Subject, state, subject
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
        of, usual = subject(*size), (2.0, 20.0, 10.0)
        nt, reach = of.model.nv - 6, 1.0 if of.model.links else 0.95  # within the bend range
        cases = {name: (reach * bends, usual) for name, bends in folds(of).items()}
        for theta in (0.0, 1e-300, 1e-12, 1e-4):
            cases[f"theta {theta:g}"] = theta * np.ones(nt), usual
        cases["1e3 rad/s"] = rng.uniform(-1, 1, nt), FAST
        for name, (bends, speeds) in cases.items():
            for key, error in errors(of, rng, bends, speeds).items():
                found.append(Figure(f"{of.name}, {name}: {key}", error, LIMIT))
    return found
