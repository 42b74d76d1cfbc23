"""How to search for a plan: mesh, tolerances, solver, guess; keys of [plan] for these; checks."""

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np

from ..basics.checks import Refusals, needed, number, one_of, refusal, shown, whole_number
from ..basics.errors import PlanningError
from ..basics.short_repr import brief
from ..model.model import Model
from ..motion.trajectory import Trajectory
from ..optimal.rules import collocation_rule
from .magnitudes import HUGE
from .result.plan import Plan

ROUGHLY = 10.0  # times the tolerances
CHOSEN = ("intervals", "controls")  # None: the planner chooses
WHOLE_NUMBERS = {  # least and most of each; beyond the most a search would not end
    **dict.fromkeys((*CHOSEN, "most_intervals"), (1, 10_000)),
    "rounds": (0, 1000),
    "multi_start": (1, 10_000),
    "retries": (0, 10_000),
    "seed": (0, 2**63 - 1),
}
SOLVERS = ("auto", "fatrop", "ipopt")
SWITCH = bool | np.bool_, "True or False"
WATCH = Callable | None, "a function of a Plan, or None"
OF_KIND = {"track": SWITCH, "through_torso": SWITCH, "watch": WATCH}
# of numbers above 0, or None
UNITS = {"tolerance": "deg", "tail_tolerance": "deg", "rate_tolerance": "rad/s", "time_limit": "s"}


@dataclass(frozen=True)
class Mesh:
    """The mesh of a plan: where it begins, and how often it is refined.

    Parameters
    ----------
    degree : int, optional
        Degree of Radau's collocation rule, from 1 to 5. Default: 3.
    intervals : int, optional
        Number of intervals of the first mesh. Default: in each control interval 1 if the tail has
        up to two segments, 4 up to four segments, else 12; a search that finds no true plan begins
        again with 12.
    most_intervals : int, default 400
        Largest number of intervals.
    controls : int, optional
        Number of equal control intervals; in each, the torques are one polynomial, however fine
        the mesh is. With the objective "time" torques are linear in each. Default: 12, or
        ``intervals`` if that is less.
    rounds : int, default 6
        Largest number of refinements.
    """

    degree: int | None = None
    intervals: int | None = None
    most_intervals: int = 400
    controls: int | None = None
    rounds: int = 6


@dataclass(frozen=True)
class Tolerances:
    """What makes a plan true: largest errors at the end of its simulation; None demands nothing.

    Each is a number, or text with a unit, such as "0.0002 rad".

    Parameters
    ----------
    attitude : float, str or None, default 0.01
        Error of the attitude (deg). With None, bounds may be exceeded between nodes, too.
    tail : float, str or None, default 0.1
        Error of the tail coordinates (deg).
    rate : float, str or None, default 0.1
        Error of the rates of torso and tail (rad/s).
    through_torso : bool, default False
        Whether the tail may go through the torso. Otherwise a plan in which it does is made again
        with a constraint; if that finds none, ``plan.warnings`` tells.
    """

    attitude: Any = 0.01
    tail: Any = 0.1
    rate: Any = 0.1
    through_torso: bool = False


@dataclass(frozen=True)
class Solver:
    """What solves the program of a plan, from how many guesses, and what it reports.

    Parameters
    ----------
    name : {"auto", "fatrop", "ipopt"}, default "auto"
        "auto" is FATROP, and IPOPT from the same guesses if FATROP finds nothing;
        ``report["solver"]`` says which.
    options : dict, optional
        Options of the solvers, such as ``{"fatrop.max_iter": 500, "ipopt.max_iter": 500}``.
    time_limit : float or str, optional
        Time for the search (s, or text with a unit). If it leaves no time to track the plan, the
        report has no errors of tracking.
    multi_start : int, default 1
        Number of guesses that are solved; the best solution is kept.
    retries : int, default 4
        Number of further guesses if all of these fail, after a continuation: an easier problem is
        solved, whose bound is led back to the wanted one. At 0 there is none. A search that fails
        says in ``report["advice"]`` which value of the bound suffices.
    seed : int, default 0
        Seed of the random guesses.
    track : bool, default True
        Whether to simulate the plan tracked by ``Pfl`` too, for the report.
    watch : callable, optional
        Function that receives the Plan of each round when it is found. An exception that it
        raises ends the search.
    """

    name: str = "auto"
    options: dict[str, Any] = field(default_factory=dict)
    time_limit: Any = None
    multi_start: int = 1
    retries: int = 4
    seed: int = 0
    track: bool = True
    watch: Callable[[Plan], object] | None = None


@dataclass(frozen=True)
class Guess:
    """Where the search for a plan begins.

    Parameters
    ----------
    motion : Plan, Trajectory or sequence of Plan, optional
        First guess. Default: passive flight. Of a sequence of plans, that with the nearest start
        is tried if passive flight leads to none.
    damping : float or str, default 1e-3
        Damping of that passive flight (N m s, or text with a unit).
    """

    motion: Any = None
    damping: Any = 1e-3
    __repr__ = brief


@dataclass(frozen=True)
class PlanSettings:
    """How to search for a plan."""

    mesh: Mesh
    tolerances: Tolerances
    solver: Solver
    guess: Guess

    @property
    def allowed(self) -> dict[str, float]:
        """Largest true errors at the end: attitude and tail (deg), rates (rad/s)."""
        named = {name: getattr(self.tolerances, name) for name in ("attitude", "tail", "rate")}
        return {name: most for name, most in named.items() if most is not None}

    @property
    def first_solver(self) -> str:
        """The solver that is tried first."""
        return "ipopt" if self.solver.name == "ipopt" else "fatrop"

    def options_of(self, solver: str) -> dict[str, Any]:
        """Options whose names begin with a solver's."""
        return {k: v for k, v in self.solver.options.items() if str(k).startswith(f"{solver}.")}

    def roughly(self, motion: Any) -> "PlanSettings":
        """Return settings of a search that shows whether a problem has a plan, from a guess."""
        rougher: Any = {n: ROUGHLY * most for n, most in self.allowed.items()}
        tolerances, alone = replace(self.tolerances, **rougher), {"track": False, "watch": None}
        return self.changed(guess=motion, retries=0, multi_start=1, tolerances=tolerances, **alone)

    def changed(self, **fields: Any) -> "PlanSettings":
        """Return settings with other fields, by the keys of [plan]."""
        return PlanSettings(**joined(fields, vars(self)))


KINDS: dict[str, Any] = {"mesh": Mesh, "tolerances": Tolerances, "solver": Solver, "guess": Guess}
PLACES = {  # of keys of [plan], which were keywords of ``plan``, too: object and field
    **{name: ("mesh", name) for name in Mesh.__annotations__},
    "tolerance": ("tolerances", "attitude"),
    "tail_tolerance": ("tolerances", "tail"),
    "rate_tolerance": ("tolerances", "rate"),
    "through_torso": ("tolerances", "through_torso"),
    **{name: ("solver", name) for name in Solver.__annotations__ if name != "name"},
    "solver": ("solver", "name"),
    "guess": ("guess", "motion"),
    "guess_damping": ("guess", "damping"),
}


def joined(arguments: Mapping[str, Any], others: Mapping[str, Any]) -> dict[str, Any]:
    """Return arguments of ``plan`` over others; those named by keys of [plan] change one field."""
    fields = [n for n, each in arguments.items() if n in PLACES and type(each) is not KINDS.get(n)]
    whole = {**others, **{n: each for n, each in arguments.items() if n not in fields}}
    for name in fields:
        home, part = PLACES[name]
        whole[home] = replace(whole.get(home, KINDS[home]()), **{part: arguments[name]})
    return whole


def spelled(name: str) -> str:
    """Return how a field that a key of [plan] names is given to ``plan``."""
    home, part = PLACES[name]
    return f"{home}=st.{KINDS[home].__name__}({part}=...)"


def checked_settings(
    model: Model, given: Mapping[str, Any], old: Mapping[str, Any], refused: Refusals
) -> PlanSettings:
    """Return settings with numbers in their units; add each wrong one to ``refused``.

    given: mesh, tolerances, solver and guess as ``plan`` takes them; old: keywords in PLACES.
    """
    for home, kind in KINDS.items():
        value = given[home]
        if type(value) is not kind:
            if home not in PLACES and value is not None:
                refused.add(home, needed(home, value, f"st.{kind.__name__}(...), or None"))
            continue
        for name in old:
            if PLACES[name][0] == home:
                remedy = f"beside {home}: needs {spelled(name)} alone"
                refused.add(name, f"{name}: value {shown(old[name])}: {remedy}")
    known = {n: each for n, each in given.items() if each is not None and n not in refused.lines}
    usual = {home: kind() for home, kind in KINDS.items()}
    settings = PlanSettings(**joined({**known, **old}, usual))

    def check(name: str, make: Callable[..., Any], free: bool = False, **rule: Any) -> Any:
        home, part = PLACES[name]
        where, value = f"{home}.{part}", getattr(getattr(settings, home), part)
        if free and value is None:
            return None
        return refused.attempt(where, partial(make, where, value, **rule))

    wrong: Any = {"error": PlanningError}
    for name, (least, most) in WHOLE_NUMBERS.items():
        check(name, whole_number, name in CHOSEN, least=least, most=most, **wrong)
    for name, (of, needs) in OF_KIND.items():
        check(name, _check_kind, kind=of, needs=needs)
    check("degree", lambda _, degree: collocation_rule(degree), free=True)
    check("options", _check_options)
    check("solver", one_of, names=SOLVERS, **wrong)
    check("guess", _check_guess, free=True, model=model)
    numbers = {n: check(n, number, True, unit=unit, above=0, **wrong) for n, unit in UNITS.items()}
    damping: Any = {"unit": "N m s", "least": 0, "most": HUGE}
    numbers["guess_damping"] = check("guess_damping", number, **damping, **wrong)
    return settings.changed(**numbers)


def _check_kind(name: str, value: Any, kind: Any, needs: str) -> None:
    """PlanningError unless a value is of a kind."""
    if not isinstance(value, kind):
        raise refusal(name, value, needs, PlanningError)


def _check_options(name: str, options: Any) -> None:
    """PlanningError unless options are a dict of settings of FATROP and IPOPT."""
    needs = "a dict, such as {'fatrop.max_iter': 500, 'ipopt.max_iter': 500}"
    _check_kind(name, options, dict, needs)
    for option in options:
        if not re.fullmatch(r"(ipopt|fatrop)\.\w+", str(option)):
            needs = "a name that begins with 'fatrop.' or 'ipopt.'"
            raise PlanningError(f"{name}: {shown(option)}: needs {needs}")


def _check_guess(name: str, guess: Any, model: Model) -> None:
    """PlanningError unless a guess is a motion of such a model, or plans of it."""
    if isinstance(guess, tuple | list):
        for k, each in enumerate(guess):
            if not hasattr(each, "trajectory"):
                raise refusal(f"{name}[{k}]", each, "a Plan", PlanningError)
            _check_guess(f"{name}[{k}]", each, model)
        return
    motion = getattr(guess, "trajectory", guess)
    _check_kind(name, motion, Trajectory, "a Plan or a Trajectory")
    if motion.q.shape[1] != model.nq or len(motion.t) < 2:
        needs = f"at least two samples of {model.nq}"
        raise PlanningError(f"{name}: q has shape {motion.q.shape}: needs {needs}")
