"""Searches for a plan, round by round, and returns the best one."""

from dataclasses import replace

from ..basics.errors import PlanningError
from ..basics.progress import Stage
from ..model.model import Model
from ..optimal.fork_gate import forks_wait
from ..optimal.interrupt import stoppable
from ..simulation.simulate import read_clocks
from .air import in_air, refuse_air
from .continuation import with_bound
from .momentum import refuse_impossible
from .paths_at_start import refuse_violated
from .problem import PlanningProblem
from .program.nodes import FUNCTIONS, is_compiled
from .result.plan import Plan
from .round import Round
from .search import Search
from .settings import PlanSettings
from .softening import SOFTENING
from .torso import goes_through_torso, off_torso

NEEDED = (  # functions of the model
    *("mass_matrix", "forward_dynamics", "rollout", "energy", "momentum"),
)
# of a search that keeps the tail off the torso: it begins near its end, or does not lead there
AROUND_ROUNDS, AROUND_OPTIONS = 2, {"fatrop.max_iter": 100}


def best_plan(model: Model, problem: PlanningProblem, settings: PlanSettings) -> Plan:
    """Search round by round, and return the best plan."""
    begun, easier = read_clocks(), None
    model.serve("plan")
    model.need(*NEEDED)
    if in_air(model):
        refuse_more_in_air(model, problem)
    refuse_impossible(model, problem)
    refuse_violated(model, problem)
    with forks_wait(), Stage("plan", model.name) as stage:
        with stoppable(settings.solver.time_limit, stage.tell):
            if problem.objective in SOFTENING and settings.guess.motion is None:
                # these objectives are seldom solved from passive flight
                calm = replace(problem, objective="effort")
                easier = Search(model, calm, settings.changed(track=False, watch=None))
                found = rounds_of(easier, stage)
                guess = easier.plan(easier.best(found), len(found), begun)
                settings = settings.changed(guess=guess)
            search = Search(model, problem, settings, easier)
            rounds = rounds_of(search, stage, begun)
            best, tried = search.best(rounds), search
            if not search.is_true(best):
                best, tried = explained(search, best, stage)
            elif not settings.tolerances.through_torso:
                best, tried = kept_off(search, best, stage, begun)
        return tried.plan(best, len(rounds), begun)


def refuse_more_in_air(model: Model, problem: PlanningProblem) -> None:
    """PlanningError for what plans in air do not have yet."""
    asked = {"design": problem.design.size, "free_start": problem.free_start}
    asked |= {"clearance": problem.clearance is not None, "legs": problem.legs is not None}
    for name in [name for name, here in asked.items() if here]:
        refuse_air(model, name)
    model.need(*FUNCTIONS.values())
    if not is_compiled(model, problem):
        raise PlanningError('model: a plan in air needs a compiled model of real = "double"')


def explained(search: Search, best: Round, stage: Stage) -> tuple[Round, Search]:
    """Return what a failed search ends with: the plan of an easier problem, and which bound it
    needs, if that plan is true; else what it has.
    """
    found = search.led
    if found is None or found.bracket is None or search.stopped:
        return best, search
    factor = found.bracket.suffices
    easier = with_bound(search.problem, found.bracket.bound, factor)
    motion = search.motion(found.program, found.solution)
    led_to = searched_on(search, easier, search.settings.roughly(motion), stage)
    if led_to is None:
        return best, search
    led_to[1].advice = found.bracket.words(search.problem)
    return led_to


def kept_off(
    search: Search, best: Round, stage: Stage, begun: tuple[float, float]
) -> tuple[Round, Search]:
    """Return a plan whose tail stays out of the torso where that of the best round does not."""
    if not goes_through_torso(best):
        return best, search
    problem = off_torso(search.model, search.problem)
    if problem is None:
        return best, search
    motion = search.motion(best.program, best.solution)
    settings = search.settings
    nearby = settings.changed(
        guess=motion,
        retries=0,
        multi_start=1,
        solver=settings.first_solver,
        rounds=AROUND_ROUNDS,
        most_intervals=2 * best.program.mesh.intervals,
        options=AROUND_OPTIONS | settings.solver.options,
    )
    return searched_on(search, problem, nearby, stage, begun) or (best, search)


def searched_on(
    search: Search,
    problem: PlanningProblem,
    settings: PlanSettings,
    stage: Stage,
    begun: tuple[float, float] = (0.0, 0.0),
) -> tuple[Round, Search] | None:
    """Return the best round of another search after one; None, its cost counted, if untrue."""
    later = Search(search.model, problem, settings, search)
    last = later.best(rounds_of(later, stage, begun))
    if later.is_true(last):
        return last, later
    search.attempts.share(later.attempts)
    return None


def rounds_of(search: Search, stage: Stage, begun: tuple[float, float] = (0.0, 0.0)) -> list[Round]:
    """Return all rounds of a search; each is reported and passed to ``watch`` when it is found."""
    watch, rounds = search.settings.solver.watch, list[Round]()
    for each in search.rounds():
        rounds.append(each)
        stage.tell(what=f"{search.model.name}: {each} after round {len(rounds)}")
        if watch is not None:
            watch(search.plan(each, len(rounds), begun))
    return rounds
