"""Fits on meshes that are fine enough beside the noise, and estimates an unknown noise."""

from dataclasses import replace

import numpy as np

from ..basics.progress import Stage
from ..model.model import Model
from . import radau_steps as radau
from .certainty import noise_level
from .solve import Fit, FitPoint, fit
from .trial import Iterate, iterate_through, meshed
from .unknowns import Unknowns

ROUNDS = 4  # of refinement
NOISE_ROUNDS, SETTLED = 15, 0.003  # rounds that estimate the noise if there are priors
SHARE = 0.05  # allowed error of all intervals together, relative to the noise
ORDER = 6  # of the local error
MOST = 8  # parts into which one interval is cut at once


def refined(unknowns: Unknowns, start: FitPoint, noise_known: bool, stage: Stage) -> Fit:
    """Return the best fit on meshes that are fine enough, with the noise if that is unknown."""
    found = _with_noise(unknowns, start, noise_known, stage)
    for _ in range(ROUNDS):
        point = found.point
        model = unknowns.model_at(point.values)
        parts = [parts_needed(model, iterate) for iterate in point.iterates]
        if all(part is None for part in parts):
            break
        finer = [
            iterate if part is None else _cut(iterate, part)
            for iterate, part in zip(point.iterates, parts, strict=True)
        ]
        found = _with_noise(unknowns, FitPoint(point.values, tuple(finer)), noise_known, stage)
    return found


def _with_noise(unknowns: Unknowns, start: FitPoint, noise_known: bool, stage: Stage) -> Fit:
    """Return the best fit; with priors, fit and estimate of an unknown noise alternate."""
    found = fit(unknowns, start, stage)
    believed = any(each.spread is not None for each in unknowns.each)
    if noise_known or not (believed or start.unknown_torques):
        return found
    for _ in range(NOISE_ROUNDS):
        scale = max(noise_level(found).scale, 1e-6)
        iterates = [
            replace(each, trial=replace(each.trial, noise=each.trial.noise * scale))
            for each in found.point.iterates
        ]
        found = fit(unknowns, FitPoint(found.point.values, tuple(iterates)), stage)
        if abs(np.log(scale)) < SETTLED:
            break
    return found


def _cut(iterate: Iterate, parts: np.ndarray) -> Iterate:
    """Return an iterate on a mesh whose intervals are cut into parts."""
    trial = iterate.trial
    between_frames = [
        int(parts[a:b].max()) * (b - a)
        for a, b in zip(trial.frames[:-1], trial.frames[1:], strict=True)
    ]
    finer = meshed(trial.tracks, trial.noise, trial.torques, np.array(between_frames))
    return iterate_through(finer, trial.times, iterate.states, iterate.torques)


def parts_needed(model: Model, iterate: Iterate) -> np.ndarray | None:
    """Return the number of parts for each interval, (K,); None if no interval must be cut.

    The error of an interval is the difference between one step and two half steps.
    """
    # two half steps
    trial, whole = iterate.trial, iterate.intervals
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
