"""``plan``: motions of the tail that bring the animal where it should be, found by collocation.

The search refines its mesh until the planned torques, applied to the model, do what was planned.
"""

import time
from collections.abc import Callable
from dataclasses import fields
from typing import Any

from ..checks import Refusals, none_of, refusal
from ..errors import PlanningError
from ..extras import needed
from ..model.model import Model
from .nlp.fork_gate import forks_wait
from .nlp.interrupt import stoppable
from .nlp.node import equations_of_motion
from .nlp.rules import collocation_rule
from .problem import SETTINGS as PROBLEM_SETTINGS
from .problem import Bounds, Goal, PlanningProblem, checked_problem
from .result.plan import Plan
from .rounds import Search
from .settings import PlanSettings, check_settings

NEEDED = ("mass_matrix", "inverse_dynamics", "rollout")  # functions of the model


def plan(
    model: Model,
    *,
    start: Any,
    goal: Goal | str | None = None,
    duration: float | tuple[float, float],
    bounds: Bounds | None = None,
    **settings: Any,
) -> Plan:
    """Plan a motion of the tail by direct collocation (Sect. 3), and tell what its torques do.

    start: (q0 (nq,), v0 (nv,)).
    goal: a Goal, or "upright", which it is by default: the torso upright and at rest.
    duration: s, or (least, most) where it is free.
    bounds: a Bounds; by default |tau| <= 0.02 N m.

    Settings of the problem:
    objective: "effort" (integral of tau^2 + (smoothing q_t_dot)^2), "energy" (of sum
    |tau q_t_dot|), "time", or a function of a point.
    smoothing: N m s; without it plans whirl a light tail.
    damping: N m s (Eq. 47), in addition to the planned torques.
    path: rows (function of a point, least, most).  A point has the CasADi blocks tail, tail_rate,
    torso_rate, torque, attitude, quaternion in SI.
    formulation: "airborne" (angular momentum conserved by construction), "translation-free",
    "full".
    attitude: "quaternion", "euler".

    Settings of the search:
    rule: "radau" (default), "lobatto", "hermite-simpson", "trapezoidal"; degree: of the rule.
    intervals: of the first mesh; most_intervals: of the last.
    tolerance: deg, of the true attitude at the end, None for no demand; rounds: of refinement.
    solver, options: of ``casadi.nlpsol``.
    guess: a Plan or a Trajectory; by default passive flight, with guess_damping (N m s).
    multi_start: guesses solved, the best is kept; retries: more guesses after failures; seed.
    dynamics: "auto", "compiled", "symbolic".
    time_limit: s, of the search.
    track: simulate with PFL, too.
    watch: a function that is given the Plan of each round as it is found; what it raises ends all.

    Programs and solvers are remembered: planning again on a plan's mesh, from another start,
    derives nothing.  Ctrl-C ends the search, as the time limit does, and the best so far is
    returned; a second one raises KeyboardInterrupt.
    Returns a Plan; look at its ``success`` and ``report``.  Raises PlanningError (a field, its
    value, the remedy), ModelError (the scene lacks functions), ExtraMissing without the extra
    "plan".
    """
    needed("casadi", "plan")
    watch = _watch(settings.pop("watch", None))
    problem, checked = _checked(model, (start, goal, duration, bounds), settings)
    missing = [name for name in NEEDED if name not in model.generated]
    if missing:
        raise model.without(*missing)
    begun = time.perf_counter()
    rule = collocation_rule(checked.rule, checked.degree)
    with forks_wait():
        equations = equations_of_motion(model, checked.dynamics)
        search = Search(model, problem, checked, equations, rule)
        with stoppable(checked.time_limit):
            rounds = []
            for each in search.rounds():
                rounds.append(each)
                if watch is not None:
                    watch(search.plan(each, len(rounds), time.perf_counter() - begun))
        return search.plan(search.best(rounds), len(rounds), time.perf_counter() - begun)


def _watch(watch: Any) -> Callable[[Plan], object] | None:
    """What is called after each round; PlanningError where it cannot be."""
    if watch is not None and not callable(watch):
        raise refusal("watch", watch, "a function of a Plan, or None", PlanningError)
    return watch


def _checked(
    model: Model, task: tuple, settings: dict[str, Any]
) -> tuple[PlanningProblem, PlanSettings]:
    """Return the problem, of (start, goal, duration, bounds), and the settings of its search.

    PlanningError has a line for each thing that is wrong.
    """
    refused = Refusals(PlanningError)
    names = (*PROBLEM_SETTINGS, *(entry.name for entry in fields(PlanSettings)))
    for name in settings:
        unknown = none_of("setting", name, names)
        if unknown:
            refused.add(name, unknown)
    known = {name: value for name, value in settings.items() if name in names}
    of_problem = {name: value for name, value in known.items() if name in PROBLEM_SETTINGS}
    of_search = {name: value for name, value in known.items() if name not in PROBLEM_SETTINGS}
    start, goal, duration, bounds = task
    goal = Goal() if goal is None else goal
    bounds = Bounds() if bounds is None else bounds
    search = PlanSettings(**of_search)
    check_settings(model, search, refused)
    problem = checked_problem(model, (start, goal, duration, bounds), of_problem, refused)
    refused.tell()
    assert problem is not None  # all has been told
    return problem, search
