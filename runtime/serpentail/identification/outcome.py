"""Makes the result of the best fit: estimates, intervals, motions, torques."""

import time
from dataclasses import replace

import numpy as np

from ..basics.errors import IdentificationError
from ..model.model import Model
from . import trial as trials
from .certainty import (
    FLAT,
    certainty,
    from_prior_alone,
    own_root,
    quantile,
    relative_covariance,
    spread_of_noise,
)
from .estimates import Estimate, EstimatedTorques, IdentifiedTrial
from .marker_swaps import tell_of_residuals
from .missing import torques_missing
from .placement import Placements
from .result import Identification, trajectory_of
from .search import Task
from .solve import Fit, triangle
from .torques import Known, TorquePrior
from .trial import Iterate, Trial
from .unknowns import Unknowns


def told(
    task: Task, found: Fit, confidence: float, before: tuple[float, list[tuple[int, ...]]]
) -> Identification:
    """Return the result of the best fit; before: when it began, swapped markers of each trial."""
    began, swaps = before
    wanted = task.unknowns
    model, placed = wanted.model_at(found.point.values), wanted.placed_at(found.point.values)
    refuse_unseen(model, task, found)
    scale, freedom = spread_of_noise(wanted, task.trials, found)
    weighs = task.noise_known or any(trial.unknown_torques for trial in task.trials)
    noise_scale = 1.0 if weighs else scale
    sure = certainty(wanted, found, (noise_scale, freedom))
    reach = quantile(confidence, freedom, task.noise_known)
    alone = from_prior_alone(wanted, found, task.trials, _wider(task, found))
    std = np.sqrt(np.diag(sure.covariance))
    if found.pinned.any():  # how far up they may be: as if they were free
        free = replace(found, pinned=np.zeros_like(found.pinned))
        loose = certainty(wanted, free, (noise_scale, freedom))
        std = np.where(found.pinned, np.sqrt(np.diag(loose.covariance)), std)
    values = found.point.values
    estimates = tuple(
        Estimate(
            each.name,
            float(x),
            float(s),
            *_interval(x, s * reach, (bool(least == -np.inf), bool(pinned))),
            each.unit,
            float(first),
            bool(pinned),
        )
        for each, x, s, first, pinned, least in zip(
            wanted.each, values, std, wanted.start, found.pinned, wanted.least, strict=True
        )
    )
    C = relative_covariance(wanted, found)
    done = tuple(
        _trial(model, placed, (trial, iterate, torque), _torque_std(wanted, trial, R, C), reach)
        for trial, iterate, torque, R in zip(
            task.trials, found.point.iterates, task.torques, found.triangles, strict=True
        )
    )
    for each, trial, at, linear, swapped in zip(
        done, task.trials, found.point.iterates, found.linear, swaps, strict=True
    ):
        missing = not trial.unknown_torques and torques_missing(model, placed, trial, at, linear)
        tell_of_residuals(each.tracks, each.modelled, missing, swapped)
    noise = float(np.median(np.concatenate([trial.noise.ravel() for trial in task.trials])))
    return Identification(
        model=model,
        placed=placed,
        parameters=estimates,
        covariance=sure.covariance,
        singular_values=sure.singular_values,
        undetermined=(*sure.undetermined, *alone),
        noise=noise if task.noise_known else noise * scale,
        confidence=confidence,
        trials=done,
        iterations=found.iterations,
        success=found.converged,
        seconds=time.perf_counter() - began,
    )


def _interval(value: float, reach: float, kind: tuple[bool, bool]) -> tuple[float, float]:
    """Return the ends of an interval, of a number that cannot be negative from 0 on.

    kind: whether the number may be negative, and whether it is at its bound.
    """
    signed, pinned = kind
    low = value - reach if signed else max(value - reach, 0.0)
    return (0.0 if pinned else float(low)), float(value + reach)


def refuse_unseen(model: Model, task: Task, found: Fit) -> None:
    """IdentificationError if the markers do not determine a rotation or a tail coordinate."""
    count = len(task.unknowns.each)
    names = ["x", "y", "z", *(f"turn about {axis}" for axis in "xyz")]
    names += [f"tail coordinate {k}" for k in range(model.layout.nt)]
    for trial, R in zip(task.trials, found.triangles, strict=True):
        own = len(R) - 1 - count
        scale = np.linalg.norm(R[:own, :own], axis=0)
        blind = scale == 0
        if not blind.any():
            _, s, Vt = np.linalg.svd(R[:own, :own] / scale)
            std = np.sqrt(((Vt / np.maximum(s, 1e-300)[:, None]) ** 2).sum(axis=0)) / scale
            blind = np.concatenate([[False] * 3, std[3 : model.nv] > 1.0])
        open_ones = [name for name, off in zip(names, blind, strict=False) if off]
        if open_ones:
            raise IdentificationError(
                f"data: too few markers in {trial.tracks.source}: they do not determine "
                f"{', '.join(open_ones)} to 1 rad: add markers there, or fill their gaps"
            )


def _wider(task: Task, found: Fit) -> tuple[np.ndarray, ...]:
    """Return the triangles that a prior on the torques a thousand times wider would leave."""
    wide = []
    for trial, linear in zip(task.trials, found.linear, strict=True):
        seen = 3 * int(trial.tracks.seen.sum())
        rows = linear.rows.copy()
        rows[seen:] /= FLAT
        wide.append(triangle(rows, linear.right))
    return tuple(wide)


def _torque_std(wanted: Unknowns, trial: Trial, R: np.ndarray, C: np.ndarray) -> np.ndarray | None:
    """Return standard deviations of the torques at the knots, flat; None if these are known."""
    if not trial.unknown_torques:
        return None
    std = np.sqrt((own_root(wanted, R, C) ** 2).sum(axis=1))
    return std[2 * wanted.model.nv :]


def _trial(
    model: Model,
    placed: Placements,
    parts: tuple[Trial, Iterate, Known | TorquePrior],
    std: np.ndarray | None,
    reach: float,
) -> IdentifiedTrial:
    """Return the results of a trial."""
    trial, iterate, known = parts
    states = iterate.states[trial.frames]
    torques = None
    if not isinstance(known, TorquePrior):
        tau = known(trial.tracks.times)
    elif std is not None:
        at, values = trial.times[trial.knots], iterate.torques
        std = std.reshape(values.shape)
        torques = EstimatedTorques(at, values, std, values - reach * std, values + reach * std)
        tau = np.stack([np.interp(trial.tracks.times, at, row) for row in values.T], axis=-1)
    return IdentifiedTrial(
        trial.tracks,
        trajectory_of(model, trial.tracks.times, states, tau),
        trials.seen_points(model, placed, trial, iterate.states),
        torques,
    )
