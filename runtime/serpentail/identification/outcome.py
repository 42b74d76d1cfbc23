"""Makes the result of the best fit: estimates with intervals, motions and torques."""

import time
from dataclasses import replace

import numpy as np
from scipy.special import ndtri, stdtrit

from .certainty import (
    by_prior_alone,
    certainty,
    local_root,
    noise_level,
    refuse_unseen,
    relative_covariance,
)
from .data_checks import torques_missing, warn_of_residuals
from .placement import Placements
from .result import Estimate, EstimatedTorques, Identification, IdentifiedTrial, trajectory_of
from .solve import Fit
from .torques import TorquePrior


def identification_of(
    found: Fit,
    noise_known: bool,
    confidence: float,
    swapped: list[tuple[int, ...]],
    began: float,
) -> Identification:
    """Return the result of the best fit, and warn of what fits badly.

    swapped: markers of each trial that are known to look swapped; began: on the clock (s).
    """
    refuse_unseen(found)
    placed, level = found.unknowns.placed_at(found.point.values), noise_level(found)
    upper = (1 + confidence) / 2
    reach = float(ndtri(upper) if noise_known else stdtrit(level.freedom, upper))
    scale = 1.0 if noise_known or found.point.unknown_torques else level.scale
    sure = certainty(found, scale)
    noises = [iterate.trial.noise.ravel() for iterate in found.point.iterates]
    noise = float(np.median(np.concatenate(noises)))
    return Identification(
        model=placed.model,
        placed=placed,
        parameters=_estimates(found, sure.covariance, scale, reach),
        covariance=sure.covariance,
        singular_values=sure.singular_values,
        undetermined=(*sure.undetermined, *by_prior_alone(found)),
        noise=noise if noise_known else noise * level.scale,
        confidence=confidence,
        trials=_trials(found, placed, reach, swapped),
        iterations=found.iterations,
        success=found.converged,
        seconds=time.perf_counter() - began,
    )


def _estimates(
    found: Fit, covariance: np.ndarray, scale: float, reach: float
) -> tuple[Estimate, ...]:
    """Return the shared unknowns with their intervals."""
    wanted, values = found.unknowns, found.point.values
    std = np.sqrt(np.diag(covariance))
    if found.pinned.any():  # how far up they may be: as if they were free
        free = certainty(replace(found, pinned=np.zeros_like(found.pinned)), scale)
        std = np.where(found.pinned, np.sqrt(np.diag(free.covariance)), std)

    # intervals of numbers that cannot be negative begin at 0 or above
    low, high = values - reach * std, values + reach * std
    low = np.where(np.isinf(wanted.least), low, np.maximum(low, 0.0))
    low = np.where(found.pinned, 0.0, low)
    rows = np.stack([values, std, low, high], axis=1).tolist()
    return tuple(
        Estimate(each.name, value, s, least, most, each.unit, each.start, bool(pinned))
        for each, (value, s, least, most), pinned in zip(
            wanted.each, rows, found.pinned, strict=True
        )
    )


def _trials(
    found: Fit, placed: Placements, reach: float, swapped: list[tuple[int, ...]]
) -> tuple[IdentifiedTrial, ...]:
    """Return the results of all trials, and warn of markers and torques that do not fit."""
    model, C, results = placed.model, relative_covariance(found), []
    for iterate, linear, pair in zip(found.point.iterates, found.linear, swapped, strict=True):
        trial = iterate.trial
        times, known, torques = trial.tracks.times, trial.torques, None
        if isinstance(known, TorquePrior):  # torques at the knots, linear between
            at, u = trial.times[trial.knots], iterate.torques
            std = np.sqrt((local_root(found, linear, C) ** 2).sum(axis=1))
            std = std[2 * model.nv :].reshape(u.shape)
            torques = EstimatedTorques(at, u, std, u - reach * std, u + reach * std)
            tau = np.stack([np.interp(times, at, row) for row in u.T], axis=-1)
            missing = False
        else:
            tau = known(times)
            missing = torques_missing(placed, linear)
        motion = trajectory_of(model, times, iterate.states[trial.frames], tau)
        modelled = iterate.modelled(placed)
        warn_of_residuals(trial.tracks, modelled, missing, pair)
        results.append(IdentifiedTrial(trial.tracks, motion, modelled, torques))
    return tuple(results)
