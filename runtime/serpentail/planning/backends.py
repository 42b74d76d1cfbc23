"""The two ways to solve a problem on a mesh: a sparse program by IPOPT or another solver of
CasADi, and stages by FATROP.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ..basics.errors import PlanningError
from .free_variables import start_blocks
from .nlp.bounds import limits
from .nlp.mesh import Mesh, uniform
from .nlp.multipliers import Multipliers, carried
from .nlp.program import NonlinearProgram
from .nlp.solver import Solution, solve, solver
from .nlp.transcription import Transcription, transcription_of
from .staged.fatrop import engine_of, solve_stages
from .staged.node import lacking
from .staged.stages import Stages, stages_of

if TYPE_CHECKING:
    from .mesh_refinement import Search

FATROP = "fatrop"
INTERVALS, MOST = 12, 200  # of a sparse program: of its first mesh, and the most
CONTROL_INTERVALS, MOST_STAGED = 12, 400  # of stages: control intervals, and the most intervals
# (most segments, intervals in each control interval at first): with fewer, optima of long tails
# exploit the errors of the mesh; a search that fails begins again with FINE
PIECES, FINE = ((2, 1), (4, 4), (np.inf, 12)), 12


@dataclass(frozen=True, eq=False)
class Begin:
    """Where a solve begins: unknowns, how near they are to a solution ("far", "close", "warm"),
    Euler angles (3,) at the end, and multipliers if it is "warm".
    """

    w: np.ndarray
    guess: str
    angles: np.ndarray
    multipliers: Multipliers | None = None


@dataclass(frozen=True, eq=False)
class Way:
    """How to make first meshes, the program of a mesh, its solver, to solve it, and to carry
    multipliers to another mesh.

    most: intervals of a mesh.
    """

    most: int
    meshes: "Callable[[Search], tuple[Mesh, ...]]"
    program: "Callable[[Search, Mesh], Any]"
    engine: "Callable[[Search, Any, str], Any]"
    solved: "Callable[[Search, Any, Any, Begin], Solution]"
    carried: Callable[[Multipliers, Any, Any], Multipliers | None]


def way_of(search: "Search") -> Way:
    """Return the way of a search's solver; PlanningError if that cannot solve the problem."""
    if search.settings.solver != FATROP:
        return SPARSE
    reason = _beyond(search)
    if reason is not None:
        raise PlanningError(f"solver: value 'fatrop': {reason}, or take solver='ipopt'")
    return STAGED


def _beyond(search: "Search") -> str | None:
    """Return what stages cannot do for a problem, and the remedy; None if they can solve it."""
    problem, settings = search.problem, search.settings
    needed = {
        "formulation": (problem.formulation, "airborne"),
        "attitude": (problem.attitude, "quaternion"),
        "rule": (settings.rule, "radau"),
    }
    for field, (value, only) in needed.items():
        if value != only:
            return f"{field} is {value!r}: it takes {only!r}"
    if callable(problem.objective):
        return "objective is a function: it takes 'effort', 'energy' and 'time'"
    if problem.path:
        return "path or clearance is given: it takes bounds alone, so leave it out"
    if problem.is_free:
        name = "design" if problem.design.size else "free_start"
        return f"{name} is given: it takes known parameters and a known start, so leave it out"
    if problem.bounds.torque_rate is not None:
        return "bounds.torque_rate is given: leave it out"
    return lacking(search.model)


def _sparse_meshes(search: "Search") -> tuple[Mesh, ...]:
    settings = search.settings
    return (uniform(settings.intervals or INTERVALS, settings.controls),)


def _staged_meshes(search: "Search") -> tuple[Mesh, ...]:
    """States have a mesh of their own: several intervals in each control interval."""
    settings = search.settings
    if settings.intervals:
        controls = settings.controls or min(CONTROL_INTERVALS, settings.intervals)
        return (uniform(settings.intervals, controls),)
    controls, most = settings.controls or CONTROL_INTERVALS, settings.most_intervals or MOST_STAGED
    pieces = next(count for segments, count in PIECES if search.model.segments <= segments)
    first, finer = (uniform(controls * each, controls) for each in (pieces, FINE))
    return (first, finer) if first.intervals < finer.intervals <= most else (first,)


def _sparse_program(search: "Search", mesh: Mesh) -> Transcription:
    return transcription_of(search.model, search.problem, mesh, search.rule, search.equations)


def _sparse_engine(search: "Search", nlp: Transcription, guess: str) -> Any:
    return solver(nlp, search.settings.solver, search.settings.options, guess)


def _sparse_solved(search: "Search", nlp: Transcription, engine: Any, begin: Begin) -> Solution:
    bounds = limits(nlp, start_blocks(search.problem), begin.angles)
    return solve(engine, bounds, begin.w, search.parameters, begin.multipliers)


def _staged_program(search: "Search", mesh: Mesh) -> Stages:
    return stages_of(search.model, search.problem, mesh, search.rule)


def _staged_engine(search: "Search", _stages: Stages, guess: str) -> Any:
    return engine_of(search.settings.options, guess)


def _staged_solved(search: "Search", stages: Stages, engine: Any, begin: Begin) -> Solution:
    return solve_stages(stages, start_blocks(search.problem), begin.w, search.parameters, engine)


def _not_carried(_multipliers: Multipliers, _old: NonlinearProgram, _new: NonlinearProgram) -> None:
    """FATROP's interface takes no multipliers."""


SPARSE = Way(MOST, _sparse_meshes, _sparse_program, _sparse_engine, _sparse_solved, carried)
STAGED = Way(
    MOST_STAGED, _staged_meshes, _staged_program, _staged_engine, _staged_solved, _not_carried
)
