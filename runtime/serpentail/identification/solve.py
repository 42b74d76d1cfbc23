"""Finds the motion, the torques and the unknowns that fit best: Gauss-Newton with a line search.

Every iteration linearises all trials, eliminates their states and torques by an orthogonal
decomposition each, and solves for what they share. What is left of the decompositions tells the
information about the shared unknowns.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_triangular

from ..errors import IdentificationError, ModelError
from ..stages import Stage
from . import trial as trials
from .stages import moved
from .trial import Iterate, Linear, Trial
from .unknowns import Unknowns

ITERATIONS = 60
CLOSE = 1e-4  # last step, in standard deviations of the estimates
ROUNDING = 1e-9  # last step over the size of the data
NULL = 1e-9  # singular values below, over the largest, are of what no data can tell
DEPENDENT = 1e-5  # of a column's length that is left: below, columns depend on each other
ARMIJO, SHORTEST = 1e-4, 1e-6
KEPT = 0.2  # of a positive number that a step must leave
PINNED = 1e-3  # of its size: from here a number that wants below 0 is put there


@dataclass(frozen=True, eq=False)
class Point:
    """Values of the unknowns (P,) and an iterate of each trial."""

    values: np.ndarray
    iterates: tuple[Iterate, ...]


@dataclass(frozen=True, eq=False)
class Fit:
    """Where the search ended: the point, linear problems there, the triangles (C, C) of each trial,
    which unknowns are pinned to 0, iterations, and whether the last step was small.
    """

    point: Point
    linear: tuple[Linear, ...]
    triangles: tuple[np.ndarray, ...]
    pinned: np.ndarray
    iterations: int
    converged: bool


def fit(unknowns: Unknowns, each: tuple[Trial, ...], start: Point, stage: Stage | None) -> Fit:
    """Return the best fit near a start; IdentificationError where no step can be made."""
    pinned = np.zeros(len(unknowns.each), bool)
    point = _integrated(unknowns, each, start)
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
        pinned |= _to_pin(unknowns, point, step)
        advanced, weight = _search(unknowns, each, (point, linear, weight), (step, steps))
        if advanced is None:
            break
        point = advanced
        if pinned.any():
            point = Point(np.where(pinned, 0.0, point.values), point.iterates)
            point = _integrated(unknowns, each, point) or advanced
    return Fit(point, linear, triangles, pinned, iteration, converged)


def _integrated(unknowns: Unknowns, each: tuple[Trial, ...], point: Point) -> Point | None:
    """Return a point with its intervals integrated; None where that fails."""
    try:
        model = unknowns.model_at(point.values)
    except ModelError:
        return None
    found = []
    for trial, iterate in zip(each, point.iterates, strict=True):
        solved = trials.solved(model, trial, iterate)
        if solved is None:
            return None
        found.append(solved)
    return Point(point.values, tuple(found))


def _decomposed(
    unknowns: Unknowns, each: tuple[Trial, ...], point: Point
) -> tuple[tuple[Linear, ...], tuple[np.ndarray, ...]]:
    """Return each trial's linear problem, and its triangle with the right-hand side beside it."""
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
    """Return what all trials tell about the shared unknowns, rows (R, P + 1), right-hand side last.

    The unknowns are over their sizes.
    """
    count = len(unknowns.each)
    rows = np.vstack([R[-1 - count : -1, -1 - count :] for R in triangles])
    rows[:, :count] *= unknowns.sizes
    return rows


def prior_rows(unknowns: Unknowns, values: np.ndarray) -> np.ndarray:
    """Return the rows of priors on shared unknowns, right-hand side last."""
    spread = [
        (k, each.size / each.spread, (unknowns.start[k] - values[k]) / each.spread)
        for k, each in enumerate(unknowns.each)
        if each.spread is not None
    ]
    rows = np.zeros((len(spread), len(unknowns.each) + 1))
    for row, (k, weight, off) in zip(rows, spread, strict=True):
        row[k], row[-1] = weight, off
    return rows


def _step(
    unknowns: Unknowns, point: Point, triangles: tuple[np.ndarray, ...], pinned: np.ndarray
) -> tuple[np.ndarray, list[np.ndarray]]:
    """Return the step of the shared unknowns, and of each trial's own.

    Directions that the data cannot tell are left as they are.
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
    """Return how far the step moves the model's markers, over what counts as converged."""
    total, rows, square, floor = 0.0, 0, 0.0, 0.0
    for trial, of_trial, own in zip(each, linear, steps, strict=True):
        change = of_trial.rows @ np.concatenate([own, step]) + of_trial.residual - of_trial.right
        total += change @ change
        square += of_trial.residual @ of_trial.residual
        rows += len(change)
        floor += (ROUNDING * np.nanmax(np.abs(trial.tracks.positions)) / trial.noise.min()) ** 2
    scale = np.sqrt(square / max(rows, 1))
    return float(np.sqrt(total) / (CLOSE * scale + np.sqrt(floor)))


def _to_pin(unknowns: Unknowns, point: Point, step: np.ndarray) -> np.ndarray:
    """Tell which numbers that cannot be negative are almost 0 and want below it."""
    checks = {p["name"]: p["check"] for p in unknowns.model.manifest["parameters"]}
    return np.array(
        [
            checks.get(each.of) == "not_negative"
            and value <= PINNED * each.size
            and value + change < 0
            for each, value, change in zip(unknowns.each, point.values, step, strict=True)
        ],
        bool,
    )


def _longest(unknowns: Unknowns, values: np.ndarray, step: np.ndarray) -> float:
    """Return how much of a step leaves positive numbers positive."""
    checks = {p["name"]: p["check"] for p in unknowns.model.manifest["parameters"]}
    most = 1.0
    for each, value, change in zip(unknowns.each, values, step, strict=True):
        if checks.get(each.of, "finite") != "finite" and change < 0 < value:
            least = 0.0 if value <= PINNED * each.size else KEPT
            most = min(most, (1 - least) * value / -change)
    return most


State = tuple[Point, tuple[Linear, ...], float]


def _search(
    unknowns: Unknowns,
    each: tuple[Trial, ...],
    state: State,
    direction: tuple[np.ndarray, list[np.ndarray]],
) -> tuple[Point | None, float]:
    """Return the point along a step that lowers cost and defects together, and their weight.

    The weight of the defects' sizes is large enough for the step to go down (Nocedal and Wright,
    Eq. 18.36).
    """
    point, linear, weight = state
    step, steps = direction
    moves = [
        each_linear.states(trial, own, step)
        for each_linear, trial, own in zip(linear, each, steps, strict=True)
    ]
    # slope of the cost, and the size of the defects
    believed = prior_rows(unknowns, point.values)
    slope = -float(believed[:, -1] @ (believed[:, :-1] @ (step / unknowns.sizes)))
    for each_linear, own in zip(linear, steps, strict=True):
        change = each_linear.rows @ np.concatenate([own, step])
        change += each_linear.residual - each_linear.right
        slope -= float(each_linear.residual @ change)
    scales = [_scales(move) for move in moves]
    off = sum(float((np.abs(lin.defects) * s).sum()) for lin, s in zip(linear, scales, strict=True))
    if off > 0:
        weight = max(weight, 2 * max(slope, 0.0) / off)
    before = _cost(unknowns, point, linear) + weight * off
    expected = slope - weight * off
    length = _longest(unknowns, point.values, step)
    while length > SHORTEST:
        found = _at(unknowns, each, point, (length, step, steps, moves))
        if found is not None:
            after = _merit(unknowns, each, found, (weight, scales))
            if after <= before + ARMIJO * length * expected + 1e-12 * abs(before):
                return found, weight
        length /= 2
    return None, weight


def _scales(move: np.ndarray) -> np.ndarray:
    """Return by what defects are multiplied so that numbers of different units compare."""
    return 1 / np.maximum(np.abs(move).max(axis=0), 1e-12)


def _at(
    unknowns: Unknowns,
    each: tuple[Trial, ...],
    point: Point,
    direction: tuple[float, np.ndarray, list[np.ndarray], list[np.ndarray]],
) -> Point | None:
    """Return the point at some length along a step, integrated; None where that fails."""
    length, step, steps, moves = direction
    model, found = unknowns.model, []
    for trial, iterate, own, move in zip(each, point.iterates, steps, moves, strict=True):
        states = moved(model, iterate.states, length * move)
        torques = iterate.torques + length * own[move.shape[1] :].reshape(iterate.torques.shape)
        shift = (states - iterate.states)[:-1, None]
        stages = iterate.stages + shift
        found.append(Iterate(states, torques, stages))
    return _integrated(unknowns, each, Point(point.values + length * step, tuple(found)))


def _cost(unknowns: Unknowns, point: Point, linear: tuple[Linear, ...]) -> float:
    """Return half the sum of squares."""
    own = float((prior_rows(unknowns, point.values)[:, -1] ** 2).sum())
    return (own + sum(float(each.residual @ each.residual) for each in linear)) / 2


def _merit(
    unknowns: Unknowns,
    each: tuple[Trial, ...],
    point: Point,
    weights: tuple[float, list[np.ndarray]],
) -> float:
    """Return the cost and the weighed sizes of the defects at a point."""
    weight, scales = weights
    model = unknowns.model_at(point.values)
    placed = unknowns.placed_at(point.values)
    total = float((prior_rows(unknowns, point.values)[:, -1] ** 2).sum()) / 2
    for trial, iterate, scale in zip(each, point.iterates, scales, strict=True):
        r = trials.residuals(model, placed, trial, iterate.states)
        total += float((r**2).sum()) / 2
        believed = trial.prior @ iterate.torques
        total += float((believed**2).sum()) / 2
        total += weight * float((np.abs(trials.defects(model, iterate)) * scale).sum())
    return total
