"""``plan``: motions of the tail that bring the animal where it should be, found by collocation.

The search refines its mesh until the planned torques, applied to the model, do what was planned.
"""

import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from inspect import Parameter, signature
from typing import Any, Never

from .. import extras
from ..checks import Refusals, needed, none_of
from ..errors import PlanningError
from ..model.model import Model
from ..motion.trajectory import Trajectory
from ..simulation.schedules import Legs
from ..stages import Stage
from .momentum import refuse_impossible
from .nlp.fork_gate import forks_wait
from .nlp.interrupt import stoppable
from .nlp.node import equations_of_motion
from .problem import SMOOTHING, Bounds, Goal, PathConstraint, PlanningProblem, checked_problem
from .result.plan import Plan
from .rounds import SOFTENING, Round, Search
from .settings import PlanSettings, check_settings

NEEDED = ("mass_matrix", "inverse_dynamics", "rollout")  # functions of the model


def plan(  # noqa: PLR0913 - the public face names all that it takes
    model: Model,
    *,
    start: Any,
    goal: Goal | str | None = None,
    duration: float | tuple[float, float],
    bounds: Bounds | None = None,
    # the problem
    objective: str | Callable[[Any], Any] = "effort",
    smoothing: float = SMOOTHING,
    damping: float = 0.0,
    path: Sequence[PathConstraint] = (),
    clearance: float | None = None,
    legs: Legs | None = None,
    formulation: str = "airborne",
    attitude: str = "quaternion",
    # the mesh
    rule: str = "radau",
    degree: int | None = None,
    intervals: int = 12,
    most_intervals: int = 200,
    controls: int | None = None,
    rounds: int = 6,
    tolerance: float | None = 0.01,
    tail_tolerance: float | None = 0.1,
    rate_tolerance: float | None = 0.1,
    # the solver
    solver: str = "ipopt",
    options: dict[str, Any] | None = None,
    dynamics: str = "auto",
    time_limit: float | None = None,
    # where it begins
    guess: Plan | Trajectory | None = None,
    guess_damping: float = 1e-3,
    multi_start: int = 1,
    retries: int = 4,
    seed: int = 0,
    # what is told
    track: bool = True,
    watch: Callable[[Plan], object] | None = None,
    **unknown: Never,
) -> Plan:
    """Plan a motion of the tail by direct collocation (Sect. 3), and tell what its torques do.

    start: (q0 (nq,), v0 (nv,)).
    goal: a Goal, or "upright", which it is by default: the torso upright and at rest.
    duration: s, or (least, most) where it is free.
    bounds: a Bounds; by default |tau| <= 0.02 N m.

    The problem
    objective: "effort" (integral of tau^2 + (smoothing q_t_dot)^2), "energy" (of sum
    |tau q_t_dot|), "time", or a function of a point.
    smoothing: N m s; without it plans whirl a light tail.
    damping: N m s (Eq. 47), in addition to the planned torques.
    path: rows (function of a point, least, most).  A point has the CasADi blocks tail, tail_rate,
    torso_rate, torque, attitude, quaternion, time, duration, position, height, tip, tail_points,
    center_of_mass, contact_points, body_points in SI, parameters by name, and the blocks of its
    formulation.
    clearance: m, of all points of tail and torso that may touch the ground, in the whole flight.
    legs: of a model with feet, for path constraints on its contact_points; as they are at 0 s.
    formulation: "airborne" (angular momentum conserved by construction), "translation-free",
    "full".
    attitude: "quaternion", "euler".

    The mesh
    rule: "radau", "lobatto", "hermite-simpson", "trapezoidal"; degree: of the rule.
    intervals: of the first mesh; most_intervals: of the last; rounds: of refinement.
    controls: control intervals, in each of which torques are one polynomial, however fine the mesh;
    None: in each interval of the mesh.  With "time" they are straight there.
    tolerance: deg, of the true attitude at the end; None for no demand at all.
    tail_tolerance: deg, rate_tolerance: rad/s of torso and tail, of the truth at the end; None for
    no demand.  Between nodes, bounds hold to 1e-3 of them.

    The solver
    solver, options: "ipopt", or another of ``casadi.nlpsol``; "fatrop", on stages, takes airborne
    plans alone.
    dynamics: "auto", "compiled", "symbolic".
    time_limit: s, of the search.

    Where it begins
    guess: a Plan or a Trajectory; by default passive flight, with guess_damping (N m s).
    multi_start: guesses solved, the best is kept; retries: more guesses after failures; seed.

    What is told
    track: simulate with PFL, too.
    watch: a function that is given the Plan of each round as it is found; what it raises ends all.

    Programs and solvers are remembered: planning again on a plan's mesh, from another start,
    derives nothing.  Ctrl-C ends the search, as the time limit does, and the best so far is
    returned; a second one raises KeyboardInterrupt.
    Returns a Plan; look at its ``success`` and ``report``.  Raises PlanningError (fields, their
    values, remedies), ModelError (the scene lacks functions), ExtraMissing without the extra
    "plan".
    """
    extras.needed("casadi", "plan")
    model.refuse_fixed("plan")
    refused = Refusals(PlanningError)
    for name in unknown:
        refused.add(name, none_of("setting", name, NAMES))
    if watch is not None and not callable(watch):
        refused.add("watch", needed("watch", watch, "a function of a Plan, or None"))
    settings = PlanSettings(
        rule=rule,
        degree=degree,
        intervals=intervals,
        most_intervals=most_intervals,
        controls=controls,
        rounds=rounds,
        tolerance=tolerance,
        tail_tolerance=tail_tolerance,
        rate_tolerance=rate_tolerance,
        solver=solver,
        options={} if options is None else options,
        dynamics=dynamics,
        time_limit=time_limit,
        guess=guess,
        guess_damping=guess_damping,
        multi_start=multi_start,
        retries=retries,
        seed=seed,
        track=track,
    )
    check_settings(model, settings, refused)
    of_problem = {
        "objective": objective,
        "smoothing": smoothing,
        "damping": damping,
        "path": path,
        "clearance": clearance,
        "legs": legs,
        "formulation": formulation,
        "attitude": attitude,
    }
    task = (
        start,
        goal,
        duration,
        Bounds() if bounds is None else bounds,
    )
    problem = checked_problem(model, task, of_problem, refused)
    refused.tell()
    assert problem is not None  # all has been told
    return _found(model, problem, settings, watch)


def _found(
    model: Model,
    problem: PlanningProblem,
    settings: PlanSettings,
    watch: Callable[[Plan], object] | None,
) -> Plan:
    """Search, round by round, and return the best plan."""
    missing = [name for name in NEEDED if name not in model.generated]
    if missing:
        raise model.without(*missing)
    refuse_impossible(model, problem)
    begun, easier = time.perf_counter(), None
    with forks_wait(), Stage("plan", model.name) as stage:
        equations = equations_of_motion(model, settings.dynamics)
        with stoppable(settings.time_limit, stage.tell):
            if problem.objective in SOFTENING and settings.guess is None:
                # from passive flight these are seldom solved
                calm, untracked = (
                    replace(problem, objective="effort"),
                    replace(settings, track=False),
                )
                easier = Search(model, calm, untracked, equations)
                found = _rounds(easier, stage)
                guess = easier.plan(easier.best(found), len(found), 0.0)
                settings = replace(settings, guess=guess)
            search = Search(model, problem, settings, equations, easier)
            rounds = _rounds(search, stage, watch, begun)
        return search.plan(search.best(rounds), len(rounds), time.perf_counter() - begun)


def _rounds(
    search: Search,
    stage: Stage,
    watch: Callable[[Plan], object] | None = None,
    begun: float = 0.0,
) -> list[Round]:
    """Return all rounds of a search, each told, and watched, as it is found."""
    rounds: list[Round] = []
    for each in search.rounds():
        rounds.append(each)
        stage.tell(what=f"{search.model.name}: {each} after round {len(rounds)}")
        if watch is not None:
            watch(search.plan(each, len(rounds), time.perf_counter() - begun))
    return rounds


NAMES = [
    name
    for name, parameter in signature(plan).parameters.items()
    if parameter.kind == Parameter.KEYWORD_ONLY
]
