"""Tells whether residuals look as where joint torques are missing, and not as those of markers.

A marker that is elsewhere than stated leaves residuals that are constant in the axes of its offset.
A missing torque leaves residuals that change smoothly over time, most of all at the tip.
"""

import numpy as np

from ..model.model import Model
from .placement import Placements
from .points import offset_axes
from .trial import Iterate, Linear, Trial

SMOOTH = 1.2  # squares of steps over squares of values; 2 for noise
SURE = 3.5  # standard deviations of this ratio of noise
FEWEST = 5  # steps of the marker at the tip
GROWS = 1.4  # of the residual at the tip over that on the torso


def torques_missing(
    model: Model, placed: Placements, trial: Trial, iterate: Iterate, linear: Linear
) -> bool:
    """Tell whether residuals are smooth and grow to the tip, whatever the markers' offsets are."""
    seen = trial.tracks.seen
    rows = 3 * int(seen.sum())
    q = iterate.states[trial.frames, : model.nq]
    axes = offset_axes(model, placed, q) / trial.noise[..., None, None]
    # offsets of all markers as further columns
    markers = seen.shape[1]
    offsets = np.einsum("fmij,mn->fminj", axes, np.eye(markers))[seen].reshape(rows, -1)
    columns = np.hstack([linear.rows[:rows], offsets])
    scale = np.linalg.norm(columns, axis=0)
    columns = columns / np.where(scale > 0, scale, 1)
    residual = linear.residual[:rows]
    left = residual - columns @ np.linalg.lstsq(columns, residual, rcond=1e-9)[0]
    remainder = np.full((*seen.shape, 3), np.nan)
    remainder[seen] = left.reshape(-1, 3)
    sizes = np.sqrt(np.nanmean(remainder**2, axis=(0, 2)))
    torso, tip = placed.on_torso, int(np.argmax(placed.piece + placed.fraction))
    steps = np.diff(remainder[seen[:, tip], tip], axis=0)
    if torso[tip] or not torso.any() or len(steps) < FEWEST:
        return False
    smooth = min(SMOOTH, 2 * (1 - SURE / np.sqrt(steps.size))) * sizes[tip] ** 2
    return bool(np.mean(steps**2) < smooth and sizes[tip] > GROWS * np.median(sizes[torso]))
