"""Fits on refined meshes, and estimates the noise if it is unknown."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..basics.progress import Stage
from ..model.model import Model
from . import trial as trials
from .certainty import spread_of_noise
from .point import Point
from .refine import parts_needed
from .solve import Fit, fit
from .start import on_mesh
from .torques import Known, TorquePrior
from .trial import Iterate, Trial
from .unknowns import Unknowns

ROUNDS = 4  # of refinement
NOISE_ROUNDS, SETTLED = 15, 0.003  # rounds that estimate the noise if there are priors


@dataclass(frozen=True, eq=False)
class Task:
    """What is to be found: unknowns, trials, torques of each, and whether the noise is known."""

    unknowns: Unknowns
    trials: tuple[Trial, ...]
    torques: tuple[Known | TorquePrior, ...]
    noise_known: bool


def first_iterate(model: Model, trial: Trial, states: np.ndarray) -> Iterate:
    """Return an iterate without torques through states (F, nx) at the frames."""
    mesh = on_mesh(model, states, trial.tracks.times, trial.times)
    torques = np.zeros((len(trial.knots), model.layout.nt))
    return Iterate(mesh, torques, np.repeat(mesh[:-1, None], 3, axis=1))


def refined(task: Task, start: Point, stage: Stage) -> tuple[Task, Fit]:
    """Return the best fit on meshes that are fine enough, with the noise if that is unknown."""
    task, found = with_noise(task, start, stage)
    for _ in range(ROUNDS):
        model = task.unknowns.model_at(found.point.values)
        parts = [
            parts_needed(model, trial, iterate)
            for trial, iterate in zip(task.trials, found.point.iterates, strict=True)
        ]
        if all(part is None for part in parts):
            break
        finer, iterates = [], []
        for trial, iterate, torque, part in zip(
            task.trials, found.point.iterates, task.torques, parts, strict=True
        ):
            new, at = cut(model, (trial, iterate), torque, part)
            finer.append(new)
            iterates.append(at)
        task = replace(task, trials=tuple(finer))
        task, found = with_noise(task, Point(found.point.values, tuple(iterates)), stage)
    return task, found


def cut(
    model: Model, parts: tuple[Trial, Iterate], torques: Known | TorquePrior, needed: Any
) -> tuple[Trial, Iterate]:
    """Return a trial and its iterate on a mesh whose intervals are cut into parts."""
    trial, iterate = parts
    if needed is None:
        return trial, iterate
    each = [
        int(needed[a:b].max()) * (b - a)
        for a, b in zip(trial.frames[:-1], trial.frames[1:], strict=True)
    ]
    finer = trials.meshed(trial.tracks, trial.noise, torques, (model.layout.nt, np.array(each)))
    mesh = on_mesh(model, iterate.states, trial.times, finer.times)
    return finer, Iterate(mesh, iterate.torques, np.repeat(mesh[:-1, None], 3, axis=1))


def with_noise(task: Task, start: Point, stage: Stage) -> tuple[Task, Fit]:
    """Return the best fit; with priors, fit and estimate of an unknown noise alternate."""
    found = fit(task.unknowns, task.trials, start, stage)
    believed = any(each.spread is not None for each in task.unknowns.each)
    weighs = believed or any(trial.unknown_torques for trial in task.trials)
    if task.noise_known or not weighs:
        return task, found
    for _ in range(NOISE_ROUNDS):
        scale, _ = spread_of_noise(task.unknowns, task.trials, found)
        scale = max(scale, 1e-6)
        task = replace(
            task,
            trials=tuple(replace(trial, noise=trial.noise * scale) for trial in task.trials),
        )
        found = fit(task.unknowns, task.trials, found.point, stage)
        if abs(np.log(scale)) < SETTLED:
            break
    return task, found
