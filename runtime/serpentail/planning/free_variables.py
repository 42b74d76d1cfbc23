"""The model and the start of a solution, and of guesses, where a plan leaves some of them free."""

from dataclasses import replace
from typing import Any

import numpy as np

from serpentail_scene.layout import OMEGA, POSITION, TAIL_Q, TAIL_V, VELOCITY

from ..model.model import Model
from .free_start import part_of, with_parts
from .nlp.coordinates import attitude
from .nlp.program import NonlinearProgram
from .problem import PlanningProblem

Flown = tuple[Model, PlanningProblem]  # the problem's start is the one that is flown


def flown(model: Model, problem: PlanningProblem, nlp: NonlinearProgram, w: np.ndarray) -> Flown:
    """Return the model with the parameters of the unknowns w, and the problem with their start."""
    if not problem.is_free or not np.isfinite(w).all():
        return model, problem
    variables, indices, design = nlp.variables, nlp.indices, problem.design
    parts: dict[str, np.ndarray] = {}
    for blocks, places in (
        (variables.at_start, indices.at_start),
        (variables.states, indices.states[0]),
    ):
        values, first = w[places] * variables.scale(blocks), 0
        for name, size in blocks:
            parts[name] = values[first : first + size]
            first += size
    chosen = w[indices.common[: design.size]] * design.units
    return _changed(model, problem, chosen, parts)


def guessed(
    model: Model, problem: PlanningProblem, random: np.random.Generator | None = None
) -> Flown:
    """Return the model and the start of a first guess: the given ones, or others at random."""
    if not problem.is_free:
        return model, problem
    design = problem.design
    if random is None:
        return _changed(model, problem, design.of(model.parameters), {})
    chosen = random.uniform(design.least, design.most)
    parts = {
        name: random.uniform(least, most) for name, (least, most) in problem.free_start.items()
    }
    return _changed(model, problem, chosen, parts)


def _changed(
    model: Model, problem: PlanningProblem, chosen: np.ndarray, parts: dict[str, np.ndarray]
) -> Flown:
    """Return a model and a problem with numbers of the design, and with parts of the start."""
    design, free = problem.design, problem.free_start
    if design.size:
        # a solver may exceed bounds by rounding errors
        inside = np.clip(chosen, design.least, design.most)
        model = model._varied(design.split(inside))
    parts = {name: np.clip(parts[name], *free[name]) for name in free if name in parts}
    q0, v0 = with_parts((problem.q0, problem.v0), parts)
    return model, replace(problem, q0=q0, v0=v0)


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


def start_blocks(problem: PlanningProblem) -> dict[str, np.ndarray]:
    """Return the blocks of a problem's start, SI."""
    return {
        "position": problem.q0[POSITION],
        "attitude": attitude(problem.attitude).coordinates(problem.q0[None])[0],
        "tail": problem.q0[TAIL_Q],
        "velocity": problem.v0[VELOCITY],
        "torso_rate": problem.v0[OMEGA],
        "tail_rate": problem.v0[TAIL_V],
    }
