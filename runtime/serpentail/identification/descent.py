"""Length of a step: cost and defects must fall together, and positive numbers stay positive."""

import numpy as np

from . import trial as trials
from .point import Point, integrated, prior_rows
from .radau_steps import moved
from .trial import Iterate, Linear, Trial
from .unknowns import Unknowns

ARMIJO, SHORTEST = 1e-4, 1e-6
KEPT = 0.2  # of the way to a number's bound that a step must leave
PINNED = 1e-3  # of its size: from so near a number that wants below its bound is put there


def to_pin(unknowns: Unknowns, point: Point, step: np.ndarray) -> np.ndarray:
    """Tell which numbers are almost at their bounds and want below them."""
    least, values = unknowns.least, point.values
    near = values <= np.maximum(least, 0) + PINNED * unknowns.sizes
    return (least > -np.inf) & near & (values + step < least)


def _longest(unknowns: Unknowns, values: np.ndarray, step: np.ndarray) -> float:
    """Return how much of a step leaves numbers above their bounds."""
    most = 1.0
    for each, least, value, change in zip(unknowns.each, unknowns.least, values, step, strict=True):
        room = value - max(least, 0.0)
        if least > -np.inf and change < 0 < room:
            kept = 0.0 if room <= PINNED * each.size else KEPT
            most = min(most, (1 - kept) * room / -change)
    return most


State = tuple[Point, tuple[Linear, ...], float]


def search(
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
    """Return the factors that make defects of different units comparable."""
    return 1 / np.maximum(np.abs(move).max(axis=0), 1e-12)


def _at(
    unknowns: Unknowns,
    each: tuple[Trial, ...],
    point: Point,
    direction: tuple[float, np.ndarray, list[np.ndarray], list[np.ndarray]],
) -> Point | None:
    """Return the integrated point at some length along a step; None if that fails."""
    length, step, steps, moves = direction
    model, found = unknowns.model, []
    for iterate, own, move in zip(point.iterates, steps, moves, strict=True):
        states = moved(model, iterate.states, length * move)
        torques = iterate.torques + length * own[move.shape[1] :].reshape(iterate.torques.shape)
        shift = (states - iterate.states)[:-1, None]
        stages = iterate.stages + shift
        found.append(Iterate(states, torques, stages))
    return integrated(unknowns, each, Point(point.values + length * step, tuple(found)))


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
