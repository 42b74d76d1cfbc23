"""Continuation: an easier problem is solved, whose bound is then led back to the wanted one.

It is the first retry of a search. Where it gets stuck, it knows which bound is too hard: one value
suffices, and with a slightly smaller one no plan was found.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ..optimal.mesh import TimeMesh
from ..optimal.solution import Solution
from .attempts import Attempts
from .problem import PlanningProblem
from .program.build import PlanProgram
from .program.guess import GuessMotion

FACTORS = (2.0, 8.0)  # of a bound, of easier problems
GUESSES = 3  # of an easier problem
CLOSE = 1.1  # factor between two values of a bound that need not be told apart
MOST = 14  # steps back
EASIER = ("bounds.torque", "duration")  # what makes a problem easier, in turn
UNITS = {"bounds.torque": "N m", "duration": "s"}

Finish = Callable[[PlanProgram, Solution], GuessMotion]  # the motion of a solution


@dataclass(frozen=True)
class Bracket:
    """A bound that is too hard: with one factor of it a plan was found, with a smaller one none."""

    bound: str
    suffices: float
    fails: float

    def words(self, problem: PlanningProblem) -> str:
        """Return which value suffices, and which does not."""
        value, unit = _value(problem, self.bound), UNITS[self.bound]
        enough = f"{self.bound}: {value * self.suffices:.3g} {unit} suffices"
        return f"{enough}; with {value * self.fails:.3g} {unit} no plan was found"


@dataclass(frozen=True, eq=False)
class Led:
    """Where a continuation ended: a solution and its program, at a factor of the bound; a bracket
    if that is not the wanted one.
    """

    program: PlanProgram
    solution: Solution
    bracket: Bracket | None


def with_bound(problem: PlanningProblem, bound: str, factor: float) -> PlanningProblem:
    """Return the problem with a bound that is larger by a factor."""
    if factor == 1.0:
        return problem
    if bound == "duration":
        least, most = problem.duration
        return replace(
            problem, duration=(least * factor if least == most else least, most * factor)
        )
    torque = problem.bounds.torque * factor
    return replace(problem, bounds=replace(problem.bounds, torque=torque))


def _value(problem: PlanningProblem, bound: str) -> float:
    """Return a bound's value: of the torques, the largest one."""
    return problem.duration[1] if bound == "duration" else float(np.max(problem.bounds.torque))


def led(
    attempts: Attempts, problem: PlanningProblem, mesh: TimeMesh, softening: float, finish: Finish
) -> Led | None:
    """Return where the first continuation that finds anything ends; None if none does."""
    for bound in EASIER:
        if bound == "bounds.torque" and problem.bounds.torque is None:
            continue
        for k in range(GUESSES):
            for factor in FACTORS:
                easier = with_bound(problem, bound, factor)
                program = attempts.program(easier, mesh, softening)
                found = attempts.solved(program, attempts.pushed(easier, k), quick=True)
                if attempts.stopped:
                    return None
                if found.success:
                    begun = Led(program, found, Bracket(bound, factor, 1.0))
                    return _back(attempts, problem, begun, softening, finish)
    return None


def _back(
    attempts: Attempts, problem: PlanningProblem, begun: Led, softening: float, finish: Finish
) -> Led:
    """Lead a bound back to 1 from where an easier problem is solved, by bisection."""
    best, bracket = begun, begun.bracket
    assert bracket is not None
    factor = 1.0
    for _ in range(MOST):
        easier = with_bound(problem, bracket.bound, factor)
        program = attempts.program(easier, best.program.mesh, softening)
        motion = finish(best.program, best.solution)
        found = attempts.solved(program, motion, "close", quick=True)
        if not found.success and not attempts.stopped:
            found = attempts.solved(program, motion, quick=True)
        if attempts.stopped:
            break
        if found.success and factor == 1.0:
            return Led(program, found, None)
        if found.success:
            bracket = replace(bracket, suffices=factor)
        else:
            bracket = replace(bracket, fails=factor)
        if found.success:
            best = Led(program, found, bracket)
        if bracket.suffices <= CLOSE * bracket.fails:
            if bracket.fails > 1.0 or factor == 1.0:
                break
            factor = 1.0
        else:
            factor = float(np.sqrt(bracket.suffices * bracket.fails))
    return replace(best, bracket=bracket)
