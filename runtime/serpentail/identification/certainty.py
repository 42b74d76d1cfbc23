"""Certainty of estimates: noise, covariance, intervals, and what the data cannot determine."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import solve_triangular

from ..basics.errors import IdentificationError
from .linear import NULL, Linear
from .solve import Fit, shared_rows

SHARE = 0.05  # of the largest part of a combination: smaller parts are not named
TOUCHED = 1e-6  # an unknown with this part in an undetermined direction has no interval
WIDE = 1.0  # relative standard deviation at which a combination counts as undetermined
FLAT = 1e3  # factor of a wider prior on torques, to find what only the prior determines
PASSED = 30  # a standard deviation that grows by FLAT / PASSED or more is the prior's


@dataclass(frozen=True)
class Combination:
    """Parameters that change together without much effect on the data.

    parts: relative change of each parameter; std: relative standard deviation of the combination,
    inf if no data determine it; by_prior: only a prior determines it.
    """

    parts: dict[str, float]
    std: float
    by_prior: bool = False

    def __str__(self) -> str:
        words = " ".join(f"{value:+.3g} {name}" for name, value in self.parts.items())
        if self.by_prior:
            return f"{words}: known from the prior on the torques alone"
        if np.isinf(self.std):
            return f"{words}: not determined by the data at all"
        return f"{words}: known to a factor only, relative standard deviation {self.std:.2g}"


@dataclass(frozen=True)
class NoiseLevel:
    """The noise over the assumed one, and the degrees of freedom that the data leave."""

    scale: float
    freedom: float


@dataclass(frozen=True, eq=False)
class Certainty:
    """Covariance (P, P), singular values (P,) of relative changes, undetermined combinations."""

    covariance: np.ndarray
    singular_values: np.ndarray
    undetermined: tuple[Combination, ...]


def noise_level(fit: Fit) -> NoiseLevel:
    """Return the level of the noise. Priors take a part of the freedom of their numbers."""
    square, rows, used = 0.0, 0, float((~fit.pinned).sum())
    C = relative_covariance(fit)
    believed = fit.unknowns.prior_rows(fit.point.values)[:, :-1]
    used -= float(np.einsum("rp,pq,rq->", believed, C, believed))

    # each trial's local numbers take freedom, too, but for the part that its prior determines
    for linear in fit.linear:
        trial, seen = linear.iterate.trial, linear.iterate.trial.coordinates
        square += float(linear.residual[:seen] @ linear.residual[:seen])
        rows += seen
        used += linear.local
        if trial.unknown_torques:
            part = linear.rows[seen:, : linear.local]
            used -= float(((part @ local_root(fit, linear, C)) ** 2).sum())
    freedom = max(rows - used, 1.0)
    return NoiseLevel(float(np.sqrt(square / freedom)), freedom)


def local_root(fit: Fit, linear: Linear, C: np.ndarray) -> np.ndarray:
    """Return B, such that B B^T is the covariance of a trial's local columns, with unit noise."""
    R, local = linear.triangle, linear.local
    scale = np.linalg.norm(R[:local, :local], axis=0)
    scale[scale == 0] = 1
    inverse = solve_triangular(R[:local, :local] / scale, np.eye(local)) / scale[:, None]
    values, vectors = np.linalg.eigh(C)
    sizes = fit.unknowns.sizes
    root = sizes[:, None] * vectors * np.sqrt(np.maximum(values, 0))
    return np.hstack([inverse, inverse @ R[:local, local:-1] @ root])


def relative_covariance(fit: Fit) -> np.ndarray:
    """Return the covariance of the unknowns over their sizes with the assumed noise, (P, P).

    Directions that no data determine are left out: see ``certainty``.
    """
    free = np.flatnonzero(~fit.pinned)
    C = np.zeros((len(fit.pinned),) * 2)
    if len(free):
        s, Vt = _decomposed(fit, fit.linear)
        determined = s > NULL * s[0]
        C[np.ix_(free, free)] = (Vt[determined].T / s[determined] ** 2) @ Vt[determined]
    return C


def _decomposed(fit: Fit, linear: tuple[Linear, ...]) -> tuple[np.ndarray, np.ndarray]:
    """Return singular values (P,) and directions (P, P) of the information on the free unknowns."""
    rows = shared_rows(fit.unknowns, fit.point.values, linear)[:, :-1][:, ~fit.pinned]
    _, s, Vt = np.linalg.svd(rows, full_matrices=True)
    return np.concatenate([s, np.zeros(len(Vt) - len(s))]), Vt


def certainty(fit: Fit, scale: float = 1.0) -> Certainty:
    """Return how certain the unknowns are; scale: the noise over the assumed one."""
    free = np.flatnonzero(~fit.pinned)
    covariance = relative_covariance(fit) * scale**2
    singular, combinations = np.zeros(0), []
    if len(free):
        singular, Vt = _decomposed(fit, fit.linear)
        singular = singular / scale if scale > 0 else singular
        null = singular <= NULL * singular[0]
        for s, unknown, direction in zip(singular, null, Vt, strict=True):
            std = np.inf if unknown else float(1 / s)
            if std > WIDE:
                combinations.append(Combination(_parts(fit, direction), std))

        # what undetermined directions touch has no interval
        touched = free[(np.abs(Vt[null]) > TOUCHED).any(axis=0)]
        covariance[touched, touched] = np.inf
    sizes = fit.unknowns.sizes
    return Certainty(covariance * np.outer(sizes, sizes), singular, tuple(combinations))


def _parts(fit: Fit, direction: np.ndarray) -> dict[str, float]:
    """Return the parts of a direction by name, relative to the estimates; the largest is 1."""
    free = np.flatnonzero(~fit.pinned)
    each = [fit.unknowns.each[k] for k in free]
    values = np.abs(fit.point.values[free])
    sizes = fit.unknowns.sizes[free]
    moving = np.array([not x.is_offset for x in each]) & (values > 0)
    shares = direction * np.where(moving, sizes / np.where(moving, values, 1), 1)
    shares = shares / shares[np.abs(shares).argmax()]
    return {
        x.name: float(share) for x, share in zip(each, shares, strict=True) if abs(share) > SHARE
    }


def by_prior_alone(fit: Fit) -> tuple[Combination, ...]:
    """Return combinations that a much wider prior on the torques leaves undetermined."""
    free = np.flatnonzero(~fit.pinned)
    if not fit.point.unknown_torques or not len(free):
        return ()

    # the same linear problems under a wider prior
    wide = []
    for linear in fit.linear:
        rows = linear.rows.copy()
        rows[linear.iterate.trial.coordinates :] /= FLAT
        wide.append(replace(linear, rows=rows))
    C = relative_covariance(fit)[np.ix_(free, free)]
    combinations = []

    # the prior's width passes on whole where nothing else is known
    for value, direction in zip(*_decomposed(fit, tuple(wide)), strict=True):
        std = float(np.sqrt(direction @ C @ direction))
        if std > 0 and value * std < PASSED / FLAT:
            combinations.append(Combination(_parts(fit, direction), std, by_prior=True))
    return tuple(combinations)


def refuse_unseen(fit: Fit) -> None:
    """IdentificationError if the markers do not determine a rotation or a tail coordinate."""
    model = fit.unknowns.model
    names = ["x", "y", "z", *(f"turn about {axis}" for axis in "xyz")]
    names += [f"tail coordinate {k}" for k in range(model.layout.nt)]
    for linear in fit.linear:
        R = linear.triangle[: linear.local, : linear.local]
        scale = np.linalg.norm(R, axis=0)
        blind = scale == 0
        if not blind.any():
            _, s, Vt = np.linalg.svd(R / scale)
            std = np.sqrt(((Vt / np.maximum(s, 1e-300)[:, None]) ** 2).sum(axis=0)) / scale
            blind = np.concatenate([[False] * 3, std[3 : model.nv] > 1.0])
        open_ones = [name for name, off in zip(names, blind, strict=False) if off]
        if open_ones:
            source = linear.iterate.trial.tracks.source
            raise IdentificationError(
                f"data: too few markers in {source}: they do not determine "
                f"{', '.join(open_ones)} to 1 rad: add markers there, or fill their gaps"
            )
