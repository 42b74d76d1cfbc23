"""The model and the start of a solution, and of guesses, where a plan leaves some of them free."""

from dataclasses import replace
from typing import Any

import numpy as np

from ..model.model import Model
from ..optimal.samples import MeshSamples
from .free_start import part_of, with_parts
from .problem import PlanningProblem
from .program.build import PlanProgram
from .result.full_state import start_carrying

Flown = tuple[Model, PlanningProblem]  # the problem's start is the one that is flown


def flown(
    model: Model, problem: PlanningProblem, program: PlanProgram, found: MeshSamples
) -> Flown:
    """Return the model with the parameters of a motion, and the problem with its start."""
    if not problem.is_free or not found.is_motion:
        return model, problem
    variables, design = program.variables, problem.design
    constants = variables.split(variables.constants, found.constants)
    if design.size:
        # a solver may exceed bounds by rounding errors
        inside = np.clip(constants["design"], design.least, design.most)
        model = model._varied(design.split(inside))
    if not problem.free_start:
        return model, problem
    blocks = variables.split(variables.states, found.states[0])
    start = start_carrying(model, blocks, constants, (problem.q0, problem.v0))
    parts = {name: part_of(start, name) for name in problem.free_start}
    return model, _with_start(problem, parts)


def guessed(
    model: Model, problem: PlanningProblem, random: np.random.Generator | None = None
) -> Flown:
    """Return the model and the start of a first guess: the given ones, or others at random."""
    if not problem.is_free:
        return model, problem
    design, parts = problem.design, {}
    numbers = design.of(model.parameters)
    if random is not None:
        numbers = random.uniform(design.least, design.most)
        parts = {
            name: random.uniform(least, most) for name, (least, most) in problem.free_start.items()
        }
    if design.size:
        model = model._varied(design.split(numbers))
    return model, _with_start(problem, parts)


def _with_start(problem: PlanningProblem, parts: dict[str, np.ndarray]) -> PlanningProblem:
    """Return the problem with free parts of its start, moved into their ranges."""
    free = problem.free_start
    inside = {name: np.clip(parts[name], *free[name]) for name in free if name in parts}
    q0, v0 = with_parts((problem.q0, problem.v0), inside)
    return replace(problem, q0=q0, v0=v0)


def chosen(problem: PlanningProblem, model: Model) -> dict[str, Any]:
    """Return the numbers of the design by name that a model has, ready for JSON."""
    found: dict[str, Any] = {}
    for name in problem.design.names:
        value = model.parameters[name]
        found[name] = list(value) if isinstance(value, tuple) else value
    return found


def start_found(problem: PlanningProblem) -> dict[str, list[float]]:
    """Return the free parts of a problem's start, ready for JSON."""
    start = problem.q0, problem.v0
    return {name: part_of(start, name).tolist() for name in problem.free_start}
