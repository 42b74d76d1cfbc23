"""Finds the motion, the torques and the unknowns that fit best: Gauss-Newton with a line search.

Every iteration linearises all trials, eliminates the states and torques of each by an orthogonal
decomposition, and solves for the unknowns that they share. The remaining rows of the decompositions
give the information about the shared unknowns. Along a step, cost and defects must fall together,
and positive numbers stay positive.
"""

from dataclasses import dataclass

import numpy as np

from ..basics.errors import IdentificationError, ModelError
from ..basics.progress import Stage
from .linear import NULL, Linear, linearised
from .radau_steps import moved
from .trial import Iterate
from .unknowns import Unknowns

ITERATIONS = 60
CLOSE = 1e-4  # last step, in standard deviations of the estimates
ROUNDING = 1e-9  # last step over the size of the data
ARMIJO, SHORTEST = 1e-4, 1e-6
MARGIN = 0.2  # of the way to a number's bound that a step must leave
PINNED = 1e-3  # of its size: from so near a number that wants below its bound is put there


@dataclass(frozen=True, eq=False)
class FitPoint:
    """Values of the shared unknowns (P,) and an iterate of each trial."""

    values: np.ndarray
    iterates: tuple[Iterate, ...]

    @property
    def unknown_torques(self) -> bool:
        """Whether the torques of any trial are estimated."""
        return any(iterate.trial.unknown_torques for iterate in self.iterates)


@dataclass(frozen=True, eq=False)
class FitStep:
    """A step of the shared unknowns (P,), and of local columns and states of each trial."""

    shared: np.ndarray
    local: list[np.ndarray]
    states: list[np.ndarray]


@dataclass(frozen=True, eq=False)
class Fit:
    """Where the search ended: the point, each trial's linear problem there, which unknowns are at
    their bounds, iterations, and whether the last step was small.
    """

    unknowns: Unknowns
    point: FitPoint
    linear: tuple[Linear, ...]
    pinned: np.ndarray
    iterations: int
    converged: bool


def fit(unknowns: Unknowns, start: FitPoint, stage: Stage) -> Fit:
    """Return the best fit near a start; IdentificationError if no step is possible."""
    pinned = np.zeros(len(unknowns.each), bool)
    point = _integrated(unknowns, start)
    if point is None:
        raise IdentificationError(
            "data: the model cannot be integrated from the motion that the markers show: check "
            "units, placements of markers and the parameters to begin with"
        )
    weight, converged = 1.0, False
    for iteration in range(1, ITERATIONS + 1):
        placed = unknowns.placed_at(point.values)
        linear = tuple(linearised(unknowns, placed, iterate) for iterate in point.iterates)
        step = _step(unknowns, point.values, linear, pinned)
        stage.tell(iteration / ITERATIONS)
        if _length(linear, step) < 1:
            converged = True
            break

        # along the step, with numbers at their bounds pinned there
        pinned |= _to_pin(unknowns, point.values, step.shared)
        advanced, weight = _line_search(unknowns, point, linear, step, weight)
        if advanced is None:
            break
        point = advanced
        if pinned.any():
            values = np.where(pinned, unknowns.least, point.values)
            point = _integrated(unknowns, FitPoint(values, point.iterates)) or advanced
    return Fit(unknowns, point, linear, pinned, iteration, converged)


def _integrated(unknowns: Unknowns, point: FitPoint) -> FitPoint | None:
    """Return a point with its intervals integrated; None if that fails."""
    try:
        model = unknowns.model_at(point.values)
    except ModelError:
        return None
    iterates = []
    for iterate in point.iterates:
        integrated = iterate.integrated(model)
        if integrated is None:
            return None
        iterates.append(integrated)
    return FitPoint(point.values, tuple(iterates))


def shared_rows(unknowns: Unknowns, values: np.ndarray, linear: tuple[Linear, ...]) -> np.ndarray:
    """Return the rows (R, P + 1) of all trials and priors about the shared unknowns, relative to
    their sizes, right-hand side last.
    """
    rows = np.vstack([each.triangle[each.local : -1, each.local :] for each in linear])
    rows[:, :-1] *= unknowns.sizes
    return np.vstack([rows, unknowns.prior_rows(values)])


def _step(
    unknowns: Unknowns, values: np.ndarray, linear: tuple[Linear, ...], pinned: np.ndarray
) -> FitStep:
    """Return the step to the optimum of the linear problems.

    Directions that the data do not determine are not changed.
    """
    shared, free = np.zeros(len(pinned)), np.flatnonzero(~pinned)
    if len(free):
        rows = shared_rows(unknowns, values, linear)
        U, s, Vt = np.linalg.svd(rows[:, free], full_matrices=False)
        determined = s > NULL * max(s[0], 1e-300)
        inner = (U.T @ rows[:, -1])[determined] / s[determined]
        shared[free] = unknowns.sizes[free] * (Vt[determined].T @ inner)
    local = [each.local_step(shared) for each in linear]
    states = [each.state_steps(part, shared) for each, part in zip(linear, local, strict=True)]
    return FitStep(shared, local, states)


def _length(linear: tuple[Linear, ...], step: FitStep) -> float:
    """Return how far the step moves the model's markers, relative to the limit of convergence."""
    total, rows, square, floor = 0.0, 0, 0.0, 0.0
    for each, local in zip(linear, step.local, strict=True):
        trial, change = each.iterate.trial, each.change(local, step.shared)
        total += change @ change
        square += each.residual @ each.residual
        rows += len(change)
        floor += (ROUNDING * np.nanmax(np.abs(trial.tracks.positions)) / trial.noise.min()) ** 2
    scale = np.sqrt(square / max(rows, 1))
    return float(np.sqrt(total) / (CLOSE * scale + np.sqrt(floor)))


def _to_pin(unknowns: Unknowns, values: np.ndarray, step: np.ndarray) -> np.ndarray:
    """Tell which numbers are almost at their bounds and want below them."""
    least = unknowns.least
    near = values <= np.maximum(least, 0) + PINNED * unknowns.sizes
    return (least > -np.inf) & near & (values + step < least)


def _longest(unknowns: Unknowns, values: np.ndarray, step: np.ndarray) -> float:
    """Return how much of a step leaves numbers above their bounds."""
    least = unknowns.least
    room = values - np.maximum(least, 0)
    falls = (least > -np.inf) & (step < 0) & (room > 0)
    margin = np.where(room <= PINNED * unknowns.sizes, 0.0, MARGIN)
    most = ((1 - margin) * room)[falls] / -step[falls]
    return float(most.min(initial=1.0))


def _line_search(
    unknowns: Unknowns,
    point: FitPoint,
    linear: tuple[Linear, ...],
    step: FitStep,
    weight: float,
) -> tuple[FitPoint | None, float]:
    """Return the point along a step that lowers cost and defects together, and their weight.

    The weight of the defects' sizes is large enough for the step to go down (Nocedal and Wright,
    Eq. 18.36).
    """
    # slope of the cost; sizes of the defects, over those of the steps
    priors = unknowns.prior_rows(point.values)
    slope = -float(priors[:, -1] @ (priors[:, :-1] @ (step.shared / unknowns.sizes)))
    for each, local in zip(linear, step.local, strict=True):
        slope -= float(each.residual @ each.change(local, step.shared))
    scales = [1 / np.maximum(np.abs(move).max(axis=0), 1e-12) for move in step.states]
    off = sum(
        float((np.abs(each.defects) * scale).sum())
        for each, scale in zip(linear, scales, strict=True)
    )
    if off > 0:
        weight = max(weight, 2 * max(slope, 0.0) / off)
    before = _merit(unknowns, point, weight, scales)
    expected = slope - weight * off

    # half as far, until cost and defects have fallen enough
    length = _longest(unknowns, point.values, step.shared)
    while length > SHORTEST:
        candidate = _integrated(unknowns, _moved(unknowns, point, step, length))
        if candidate is not None:
            after = _merit(unknowns, candidate, weight, scales)
            if after <= before + ARMIJO * length * expected + 1e-12 * abs(before):
                return candidate, weight
        length /= 2
    return None, weight


def _moved(unknowns: Unknowns, point: FitPoint, step: FitStep, length: float) -> FitPoint:
    """Return the point at some length along a step."""
    iterates = []
    for iterate, local, move in zip(point.iterates, step.local, step.states, strict=True):
        states = moved(unknowns.model, iterate.states, length * move)
        torques = length * local[move.shape[1] :].reshape(iterate.torques.shape)
        iterates.append(iterate.moved(states, iterate.torques + torques))
    return FitPoint(point.values + length * step.shared, tuple(iterates))


def _merit(unknowns: Unknowns, point: FitPoint, weight: float, scales: list[np.ndarray]) -> float:
    """Return the cost and the weighed sizes of the defects at a point."""
    placed = unknowns.placed_at(point.values)
    total = float((unknowns.prior_rows(point.values)[:, -1] ** 2).sum()) / 2
    for iterate, scale in zip(point.iterates, scales, strict=True):
        total += float((iterate.residuals(placed) ** 2).sum()) / 2
        total += float(((iterate.trial.prior @ iterate.torques) ** 2).sum()) / 2
        total += weight * float((np.abs(iterate.defects(placed.model)) * scale).sum())
    return total
