"""Limits: a transcription and its guess go in; bounds of the unknowns and of the constraints come
out.
"""

from dataclasses import dataclass

import numpy as np

from .coordinates import Attitude
from .transcription import Transcription, goal_matrix


@dataclass(frozen=True, eq=False)
class Limits:
    """Bounds of w and of g, both in the program's units."""

    lbx: np.ndarray
    ubx: np.ndarray
    lbg: np.ndarray
    ubg: np.ndarray


def limits(program: Transcription, start: dict[str, np.ndarray], angles: np.ndarray) -> Limits:
    """Return the limits for a start (blocks in SI) and the Euler angles (3,) at the end of the
    guess.
    """
    problem, where = program.problem, program.places
    least, most = -np.full(where.size, np.inf), np.full(where.size, np.inf)
    least[0], most[0] = problem.duration
    _along(program, least, most)
    states = np.concatenate(
        [start[name] / program.form.units[name] for name, _ in program.form.states]
    )
    least[where.states[0]] = most[where.states[0]] = states
    _at_the_end(program, least, most)
    rows = _rows(program, angles)
    return Limits(least, most, *rows)


def columns(program: Transcription, name: str, where: np.ndarray, blocks) -> np.ndarray:
    """Places (K, size) of one block."""
    start = 0
    for block, size in blocks:
        if block == name:
            return where[:, start : start + size]
        start += size
    raise KeyError(name)


def _along(program: Transcription, least: np.ndarray, most: np.ndarray) -> None:
    """Bounds of angles, rates and torques at every point."""
    bounds, where, form = program.problem.bounds, program.places, program.form
    for name, bound in (("tail", bounds.angle), ("tail_rate", bounds.rate)):
        if bound is not None:
            place = columns(program, name, where.states, form.states)
            least[place], most[place] = -bound / form.units[name], bound / form.units[name]
    if bounds.torque is not None:
        bound = bounds.torque / form.units["torque"]
        least[where.controls], most[where.controls] = -bound, bound


def _at_the_end(program: Transcription, least: np.ndarray, most: np.ndarray) -> None:
    """Fix what the goal says of the tail and of rates."""
    goal, where, form = program.problem.goal, program.places, program.form
    for name in ("tail", "tail_rate", "torso_rate"):
        value = getattr(goal, name)
        if value is None:
            continue
        state = name in dict(form.states)
        place = columns(
            program,
            name,
            *((where.states, form.states) if state else (where.others, form.algebraic)),
        )[-1]
        given = np.isfinite(value)
        least[place[given]] = most[place[given]] = (value / form.units[name])[given]


def _rows(program: Transcription, angles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Bounds of the constraints, in the order of the transcription's rows."""
    problem, where, one = program.problem, program.places, program.node
    path = _path(problem, one.path)
    per_node = np.tile(np.column_stack([np.zeros((2, one.residuals)), path]), len(where.others))
    goal = _goal_values(problem.goal, program.attitude, angles)
    direct = (
        np.zeros(0)
        if problem.bounds.torque_rate is None
        else np.full(2 * where.controls[1:].size, -np.inf)
    )
    defects = np.zeros((len(where.states) - 1) * where.states.shape[1])
    least = np.concatenate([defects, per_node[0], goal, direct])
    return least, np.concatenate([defects, per_node[1], goal, np.zeros_like(direct)])


def _path(problem, size: int) -> np.ndarray:
    """Bounds (2, size) of path constraints, one pair for all entries of one function."""
    if not problem.path:
        return np.zeros((2, 0))
    each = size // len(problem.path)
    return np.repeat(
        [[a for _, a, _ in problem.path], [b for _, _, b in problem.path]], each, axis=1
    )


def _goal_values(goal, coordinates: Attitude, angles: np.ndarray) -> np.ndarray:
    """What the goal's rows of the attitude have to be: zero, or Euler angles nearest to the
    guess's.
    """
    count = len(goal_matrix(goal.attitude, coordinates))
    if coordinates.kind == "quaternion" or not count:
        return np.zeros(count)
    if isinstance(goal.attitude, str):
        turns = np.round(angles[:2] / (2 * np.pi)) if goal.turns is None else goal.turns
        return 2 * np.pi * turns
    from ...attitude import pitch_roll_yaw

    target = pitch_roll_yaw(np.concatenate([np.zeros(3), goal.attitude]))
    return target + 2 * np.pi * np.round((angles - target) / (2 * np.pi))
