"""Refines the mesh of a trial where integration errors are not small beside the noise."""

import numpy as np

from ..model.model import Model
from . import radau_steps as radau
from .radau_steps import difference
from .trial import Iterate, Trial

SHARE = 0.05  # allowed error of all intervals together, relative to the noise
ORDER = 6  # of the local error
MOST = 8  # parts into which one interval is cut at once


def parts_needed(model: Model, trial: Trial, iterate: Iterate) -> np.ndarray | None:
    """Return the number of parts for each interval, (K,); None if no interval must be cut.

    The error of an interval is the difference between one step and two half steps.
    """
    half = trial.spans / 2
    torques = iterate.over(model, trial)
    begin = iterate.states[:-1]
    ends = []
    for part in (0, 1):
        nodes = (radau.NODES + part) / 2
        over = _at(torques, nodes)
        guess = np.repeat(begin[:, None], 3, axis=1)
        found = radau.solved(model, half, begin, over, guess)
        if found is None:
            return np.full(len(half), 2)
        begin = found[:, -1]
        ends.append(begin)
    error = np.abs(difference(model, ends[1], iterate.stages[:, -1]))
    reach = float(model.parameters["tail_length"])
    duration = trial.times[-1] - trial.times[0]
    sizes = np.concatenate([np.full(3, 1.0), np.full(model.nv - 3, reach)])
    moved = (error * np.concatenate([sizes, duration * sizes])).sum(axis=1)
    allowed = SHARE * float(np.median(trial.noise)) / len(half)
    if moved.sum() <= SHARE * float(np.median(trial.noise)):
        return None
    parts = np.ceil((moved / allowed) ** (1 / ORDER))
    return np.clip(parts, 1, MOST).astype(int)


def _at(torques: np.ndarray, nodes: np.ndarray) -> np.ndarray:
    """Return torques (K, 3, 2m) at other nodes, by the parabola through those at the stages."""
    V = np.vander(radau.NODES, 3)
    return np.einsum("ij,kjt->kit", np.vander(nodes, 3) @ np.linalg.inv(V), torques)
