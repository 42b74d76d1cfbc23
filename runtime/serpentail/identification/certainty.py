"""Certainty of estimates: noise, covariance, intervals, and what the data cannot determine."""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_triangular
from scipy.special import ndtri, stdtrit

from .point import prior_rows
from .solve import NULL, Fit, shared_rows
from .trial import Trial
from .unknowns import Unknowns

SHARE = 0.05  # of the largest part of a combination: smaller parts are not named
TOUCHED = 1e-6  # an unknown with this part in an undetermined direction has no interval
WIDE = 1.0  # relative standard deviation at which a combination counts as undetermined
FLAT = 1e3  # factor of a wider prior on torques, to find what only the prior determines


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


@dataclass(frozen=True, eq=False)
class Certainty:
    """Noise over the stated one, degrees of freedom left, covariance (P, P), singular values (P,)
    of relative changes, undetermined combinations.
    """

    scale: float
    freedom: float
    covariance: np.ndarray
    singular_values: np.ndarray
    undetermined: tuple[Combination, ...]


def spread_of_noise(unknowns: Unknowns, each: tuple[Trial, ...], fit: Fit) -> tuple[float, float]:
    """Return the noise over the assumed one, and the degrees of freedom that the data leave.

    Priors take a part of the freedom of the numbers that they are on.
    """
    square, rows, used = 0.0, 0, float(len(unknowns.each) - fit.pinned.sum())
    C = relative_covariance(unknowns, fit)
    believed = prior_rows(unknowns, fit.point.values)[:, :-1]
    used -= float(np.einsum("rp,pq,rq->", believed, C, believed))
    for trial, linear, R in zip(each, fit.linear, fit.triangles, strict=True):
        seen = 3 * int(trial.tracks.seen.sum())
        square += float(linear.residual[:seen] @ linear.residual[:seen])
        rows += seen
        own = len(R) - 1 - len(unknowns.each)
        used += own
        if trial.unknown_torques:
            part = linear.rows[seen:, :own]
            held = own_root(unknowns, R, C)
            used -= float(((part @ held) ** 2).sum())
    freedom = max(rows - used, 1.0)
    return float(np.sqrt(square / freedom)), freedom


def own_root(unknowns: Unknowns, R: np.ndarray, C: np.ndarray) -> np.ndarray:
    """Return B, such that B B^T is the covariance of a trial's own columns, with unit noise."""
    count = len(unknowns.each)
    own = len(R) - 1 - count
    scale = np.linalg.norm(R[:own, :own], axis=0)
    scale[scale == 0] = 1
    inverse = solve_triangular(R[:own, :own] / scale, np.eye(own)) / scale[:, None]
    values, vectors = np.linalg.eigh(C)
    root = unknowns.sizes[:, None] * vectors * np.sqrt(np.maximum(values, 0))
    return np.hstack([inverse, inverse @ R[:own, own:-1] @ root])


def relative_covariance(unknowns: Unknowns, fit: Fit) -> np.ndarray:
    """Return the covariance of the unknowns over their sizes with the assumed noise, (P, P).

    Directions that no data determine are left out: see ``certainty``.
    """
    free = np.flatnonzero(~fit.pinned)
    C = np.zeros((len(fit.pinned),) * 2)
    if len(free):
        s, Vt = _decomposed(unknowns, fit, free)
        told = s > NULL * s[0]
        C[np.ix_(free, free)] = (Vt[told].T / s[told] ** 2) @ Vt[told]
    return C


def _decomposed(unknowns: Unknowns, fit: Fit, free: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return singular values (P,) and directions (P, P) of the information, with priors."""
    rows = np.vstack(
        [shared_rows(unknowns, fit.triangles), prior_rows(unknowns, fit.point.values)]
    )[:, :-1]
    _, s, Vt = np.linalg.svd(rows[:, free], full_matrices=True)
    return np.concatenate([s, np.zeros(len(free) - len(s))]), Vt


def certainty(unknowns: Unknowns, fit: Fit, noise: tuple[float, float]) -> Certainty:
    """Return how certain the unknowns are; noise: over the assumed one, and freedom left."""
    scale, freedom = noise
    free = np.flatnonzero(~fit.pinned)
    covariance = relative_covariance(unknowns, fit) * scale**2
    singular, combinations = np.zeros(0), []
    if len(free):
        singular, Vt = _decomposed(unknowns, fit, free)
        singular = singular / scale if scale > 0 else singular
        null = singular <= NULL * singular[0]
        for s, direction in zip(singular, Vt, strict=True):
            std = np.inf if s <= NULL * singular[0] else 1 / s
            if std > WIDE:
                combinations.append(Combination(_parts(unknowns, fit, free, direction), float(std)))
        touched = free[(np.abs(Vt[null]) > TOUCHED).any(axis=0)]
        covariance[touched, touched] = np.inf
    covariance *= np.outer(unknowns.sizes, unknowns.sizes)
    return Certainty(scale, freedom, covariance, singular, tuple(combinations))


def _parts(
    unknowns: Unknowns, fit: Fit, free: np.ndarray, direction: np.ndarray
) -> dict[str, float]:
    """Return the parts of a direction by name, relative to the estimates; the largest is 1."""
    values, sizes = np.abs(fit.point.values[free]), unknowns.sizes[free]
    moving = np.array([not unknowns.each[k].is_offset for k in free]) & (values > 0)
    shares = direction * np.where(moving, sizes / np.where(moving, values, 1), 1)
    shares = shares / shares[np.abs(shares).argmax()]
    return {
        unknowns.each[k].name: float(share)
        for k, share in zip(free, shares, strict=True)
        if abs(share) > SHARE
    }


def from_prior_alone(
    unknowns: Unknowns, fit: Fit, each: tuple[Trial, ...], triangles: tuple[np.ndarray, ...]
) -> tuple[Combination, ...]:
    """Return combinations that a much wider prior on the torques leaves undetermined.

    triangles: those of the same linear problems with that prior.
    """
    if not any(trial.unknown_torques for trial in each):
        return ()
    free = np.flatnonzero(~fit.pinned)
    wide = Fit(fit.point, fit.linear, triangles, fit.pinned, fit.iterations, fit.converged)
    C = relative_covariance(unknowns, fit)
    s, Vt = _decomposed(unknowns, wide, free)
    found = []
    for value, direction in zip(s, Vt, strict=True):
        before = float(np.sqrt(direction @ C[np.ix_(free, free)] @ direction))
        # the prior's width passes on whole where nothing else is known
        if before > 0 and value * before < 30 / FLAT:
            parts = _parts(unknowns, fit, free, direction)
            found.append(Combination(parts, before, by_prior=True))
    return tuple(found)


def quantile(confidence: float, freedom: float, known_noise: bool) -> float:
    """Return the half width of an interval in standard deviations."""
    upper = (1 + confidence) / 2
    return float(ndtri(upper) if known_noise else stdtrit(freedom, upper))
