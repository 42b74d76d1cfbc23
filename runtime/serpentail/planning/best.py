"""Searches for a plan, round by round, and returns the best one."""

from collections.abc import Callable
from dataclasses import replace

from ..basics.progress import Stage
from ..model.model import Model
from ..optimal.fork_gate import forks_wait
from ..optimal.interrupt import stoppable
from ..simulation.simulate import read_clocks
from .momentum import refuse_impossible
from .paths_at_start import refuse_violated
from .problem import PlanningProblem
from .result.plan import Plan
from .round import Round
from .search import Search
from .settings import PlanSettings
from .softening import SOFTENING

NEEDED = (  # functions of the model
    *("mass_matrix", "inverse_dynamics", "forward_dynamics"),
    *("rollout", "energy", "momentum"),
)


def best_plan(
    model: Model,
    problem: PlanningProblem,
    settings: PlanSettings,
    watch: Callable[[Plan], object] | None,
) -> Plan:
    """Search round by round, and return the best plan."""
    begun, easier = read_clocks(), None
    missing = [name for name in NEEDED if name not in model.generated]
    if missing:
        raise model.without(*missing)
    refuse_impossible(model, problem)
    refuse_violated(model, problem)
    with forks_wait(), Stage("plan", model.name) as stage:
        with stoppable(settings.time_limit, stage.tell):
            if problem.objective in SOFTENING and settings.guess is None:
                # these objectives are seldom solved from passive flight
                calm, untracked = (
                    replace(problem, objective="effort"),
                    replace(settings, track=False),
                )
                easier = Search(model, calm, untracked)
                found = rounds_of(easier, stage)
                guess = easier.plan(easier.best(found), len(found), begun)
                settings = replace(settings, guess=guess)
            search = Search(model, problem, settings, easier)
            rounds = rounds_of(search, stage, watch, begun)
        return search.plan(search.best(rounds), len(rounds), begun)


def rounds_of(
    search: Search,
    stage: Stage,
    watch: Callable[[Plan], object] | None = None,
    begun: tuple[float, float] = (0.0, 0.0),
) -> list[Round]:
    """Return all rounds of a search; each is reported and passed to ``watch`` when it is found."""
    rounds: list[Round] = []
    for each in search.rounds():
        rounds.append(each)
        stage.tell(what=f"{search.model.name}: {each} after round {len(rounds)}")
        if watch is not None:
            watch(search.plan(each, len(rounds), begun))
    return rounds
