"""Fits on meshes that are fine enough beside the noise, and estimates an unknown noise."""

from dataclasses import replace

import numpy as np

from ..basics.progress import Stage
from ..model.model import Model
from . import radau_steps as radau
from .certainty import noise_level
from .solve import Fit, FitPoint, FitProblem, fit
from .trial import Iterate, Trial, iterate_through, meshed

ROUNDS = 4  # of refinement
NOISE_ROUNDS, SETTLED = 15, 0.003  # rounds that estimate the noise if there are priors
SHARE = 0.05  # allowed error of all intervals together, relative to the noise
ORDER = 6  # of the local error
MOST = 8  # parts into which one interval is cut at once


def refined(problem: FitProblem, start: FitPoint, stage: Stage) -> Fit:
    """Return the best fit on meshes that are fine enough, with the noise if that is unknown."""
    found = _with_noise(problem, start, stage)
    for _ in range(ROUNDS):
        problem, point = found.problem, found.point
        model = problem.unknowns.model_at(point.values)
        pairs = [*zip(problem.trials, point.iterates, strict=True)]
        parts = [parts_needed(model, trial, iterate) for trial, iterate in pairs]
        if all(part is None for part in parts):
            break
        finer = [
            pair if part is None else _cut(*pair, part)
            for pair, part in zip(pairs, parts, strict=True)
        ]
        trials, iterates = zip(*finer, strict=True)
        found = _with_noise(
            replace(problem, trials=trials), FitPoint(point.values, iterates), stage
        )
    return found


def _with_noise(problem: FitProblem, start: FitPoint, stage: Stage) -> Fit:
    """Return the best fit; with priors, fit and estimate of an unknown noise alternate."""
    found = fit(problem, start, stage)
    believed = any(each.spread is not None for each in problem.unknowns.each)
    if problem.noise_known or not (believed or problem.unknown_torques):
        return found
    for _ in range(NOISE_ROUNDS):
        scale = max(noise_level(found).scale, 1e-6)
        trials = [replace(trial, noise=trial.noise * scale) for trial in found.problem.trials]
        found = fit(replace(problem, trials=tuple(trials)), found.point, stage)
        if abs(np.log(scale)) < SETTLED:
            break
    return found


def _cut(trial: Trial, iterate: Iterate, parts: np.ndarray) -> tuple[Trial, Iterate]:
    """Return a trial and its iterate on a mesh whose intervals are cut into parts."""
    between_frames = [
        int(parts[a:b].max()) * (b - a)
        for a, b in zip(trial.frames[:-1], trial.frames[1:], strict=True)
    ]
    finer = meshed(trial.tracks, trial.noise, trial.torques, np.array(between_frames))
    return finer, iterate_through(finer, trial.times, iterate.states, iterate.torques)


def parts_needed(model: Model, trial: Trial, iterate: Iterate) -> np.ndarray | None:
    """Return the number of parts for each interval, (K,); None if no interval must be cut.

    The error of an interval is the difference between one step and two half steps.
    """
    whole = iterate.intervals(trial)
    half, begin = whole.spans / 2, whole.begin
    for part in (0, 1):
        torques = _at_nodes(whole.torques, (radau.NODES + part) / 2)
        guess = np.repeat(begin[:, None], 3, axis=1)
        stages = radau.solved(model, radau.Intervals(half, begin, torques), guess)
        if stages is None:
            return np.full(len(half), 2)
        begin = stages[:, -1]
    error = np.abs(radau.difference(model, begin, iterate.ends))

    # as distances (m): of rotations over the tail's length, of rates over the duration
    reach = float(model.parameters["tail_length"])
    duration = trial.times[-1] - trial.times[0]
    sizes = np.concatenate([np.full(3, 1.0), np.full(model.nv - 3, reach)])
    distance = (error * np.concatenate([sizes, duration * sizes])).sum(axis=1)
    allowed = SHARE * float(np.median(trial.noise))
    if distance.sum() <= allowed:
        return None
    parts = np.ceil((distance / (allowed / len(half))) ** (1 / ORDER))
    return np.clip(parts, 1, MOST).astype(int)


def _at_nodes(torques: np.ndarray, nodes: np.ndarray) -> np.ndarray:
    """Return torques (K, 3, 2m) at other nodes, by the parabola through those at the stages."""
    V = np.vander(radau.NODES, 3)
    return np.einsum("ij,kjt->kit", np.vander(nodes, 3) @ np.linalg.inv(V), torques)
