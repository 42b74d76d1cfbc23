"""Finds the motion, the torques and the unknowns that fit best: Gauss-Newton with a line search.

Every iteration linearises all trials, eliminates the states and torques of each by an orthogonal
decomposition, and solves for the unknowns that they share. The remaining rows of the decompositions
give the information about the shared unknowns.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_triangular

from ..basics.errors import IdentificationError
from ..basics.progress import Stage
from . import trial as trials
from .descent import search, to_pin
from .point import Point, integrated, prior_rows
from .trial import Linear, Trial
from .unknowns import Unknowns

ITERATIONS = 60
CLOSE = 1e-4  # last step, in standard deviations of the estimates
ROUNDING = 1e-9  # last step over the size of the data
NULL = 1e-9  # directions with smaller singular values (relative) are undetermined
DEPENDENT = 1e-5  # of a column's length that is left: below, columns depend on each other


@dataclass(frozen=True, eq=False)
class Fit:
    """Where the search ended: the point, linear problems there, the triangles (C, C) of each trial,
    which unknowns are at their bounds, iterations, and whether the last step was small.
    """

    point: Point
    linear: tuple[Linear, ...]
    triangles: tuple[np.ndarray, ...]
    pinned: np.ndarray
    iterations: int
    converged: bool


def fit(unknowns: Unknowns, each: tuple[Trial, ...], start: Point, stage: Stage | None) -> Fit:
    """Return the best fit near a start; IdentificationError if no step is possible."""
    pinned = np.zeros(len(unknowns.each), bool)
    point = integrated(unknowns, each, start)
    if point is None:
        raise IdentificationError(
            "data: the model cannot be integrated from the motion that the markers show: check "
            "units, placements of markers and the parameters to begin with"
        )
    weight, converged = 1.0, False
    for iteration in range(1, ITERATIONS + 1):
        linear, triangles = _decomposed(unknowns, each, point)
        step, steps = _step(unknowns, point, triangles, pinned)
        length = _change(each, linear, step, steps)
        if stage is not None:
            stage.tell(iteration / ITERATIONS)
        if length < 1:
            converged = True
            break
        pinned |= to_pin(unknowns, point, step)
        advanced, weight = search(unknowns, each, (point, linear, weight), (step, steps))
        if advanced is None:
            break
        point = advanced
        if pinned.any():
            point = Point(np.where(pinned, unknowns.least, point.values), point.iterates)
            point = integrated(unknowns, each, point) or advanced
    return Fit(point, linear, triangles, pinned, iteration, converged)


def _decomposed(
    unknowns: Unknowns, each: tuple[Trial, ...], point: Point
) -> tuple[tuple[Linear, ...], tuple[np.ndarray, ...]]:
    """Return each trial's linear problem, and its triangular factor with the right-hand side."""
    model, placed = unknowns.model_at(point.values), unknowns.placed_at(point.values)
    linear = tuple(
        trials.linearised(unknowns, model, placed, trial, iterate)
        for trial, iterate in zip(each, point.iterates, strict=True)
    )
    return linear, tuple(triangle(each.rows, each.right) for each in linear)


def triangle(rows: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Return R (C+1, C+1) of the decomposition of [rows, right]; rows of zeros where few are.

    Two Cholesky decompositions are as accurate as Householder's (Yamamoto et al., 2015) and take a
    tenth of the time, unless columns almost depend on each other.
    """
    both = np.column_stack([rows, right])
    size = both.shape[1]
    scale = np.linalg.norm(both, axis=0)
    if len(both) > size and scale.all():
        Q = both / scale
        try:
            first = np.linalg.cholesky(Q.T @ Q).T
            diagonal = np.diag(first)
            if diagonal.min() > DEPENDENT:
                Q = solve_triangular(first, Q.T, trans="T").T
                return np.linalg.cholesky(Q.T @ Q).T @ first * scale
        except np.linalg.LinAlgError:  # dependent columns
            pass
    R = np.linalg.qr(both, mode="r")
    return np.vstack([R, np.zeros((max(size - len(R), 0), size))])


def shared_rows(unknowns: Unknowns, triangles: tuple[np.ndarray, ...]) -> np.ndarray:
    """Return the rows (R, P + 1) of all trials about the shared unknowns, right-hand side last.

    The unknowns are divided by their sizes.
    """
    count = len(unknowns.each)
    rows = np.vstack([R[-1 - count : -1, -1 - count :] for R in triangles])
    rows[:, :count] *= unknowns.sizes
    return rows


def _step(
    unknowns: Unknowns, point: Point, triangles: tuple[np.ndarray, ...], pinned: np.ndarray
) -> tuple[np.ndarray, list[np.ndarray]]:
    """Return the step of the shared unknowns, and of each trial's own.

    Directions that the data do not determine are not changed.
    """
    count, step = len(unknowns.each), np.zeros(len(unknowns.each))
    free = np.flatnonzero(~pinned)
    if len(free):
        rows = np.vstack([shared_rows(unknowns, triangles), prior_rows(unknowns, point.values)])
        U, s, Vt = np.linalg.svd(rows[:, free], full_matrices=False)
        told = s > NULL * max(s[0], 1e-300)
        inner = (U.T @ rows[:, -1])[told] / s[told]
        step[free] = unknowns.sizes[free] * (Vt[told].T @ inner)
    return step, [own_step(R, count, step) for R in triangles]


def own_step(R: np.ndarray, count: int, step: np.ndarray) -> np.ndarray:
    """Return the step of a trial's own columns that belongs to one of the shared unknowns."""
    own = len(R) - 1 - count
    scale = np.linalg.norm(R[:, :own], axis=0)
    scale[scale == 0] = 1
    right = R[:own, -1] - R[:own, own:-1] @ step
    square = R[:own, :own] / scale
    if np.abs(np.diag(square)).min() > NULL:
        return solve_triangular(square, right) / scale
    return np.linalg.lstsq(square, right, rcond=NULL)[0] / scale


def _change(
    each: tuple[Trial, ...],
    linear: tuple[Linear, ...],
    step: np.ndarray,
    steps: list[np.ndarray],
) -> float:
    """Return how far the step moves the model's markers, relative to the limit of convergence."""
    total, rows, square, floor = 0.0, 0, 0.0, 0.0
    for trial, of_trial, own in zip(each, linear, steps, strict=True):
        change = of_trial.rows @ np.concatenate([own, step]) + of_trial.residual - of_trial.right
        total += change @ change
        square += of_trial.residual @ of_trial.residual
        rows += len(change)
        floor += (ROUNDING * np.nanmax(np.abs(trial.tracks.positions)) / trial.noise.min()) ** 2
    scale = np.sqrt(square / max(rows, 1))
    return float(np.sqrt(total) / (CLOSE * scale + np.sqrt(floor)))
