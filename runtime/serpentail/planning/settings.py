"""How to search for a plan: mesh, tolerances, solver, guess, and the keys of [plan] for these."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from ..basics.short_repr import brief
from .result.plan import Plan

ROUGHLY = 10.0  # times the tolerances


@dataclass(frozen=True, kw_only=True)
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

    Examples
    --------
    >>> import serpentail as st
    >>> st.Mesh(intervals=24).rounds
    6
    """

    degree: int | None = None
    intervals: int | None = None
    most_intervals: int = 400
    controls: int | None = None
    rounds: int = 6


@dataclass(frozen=True, kw_only=True)
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

    Examples
    --------
    >>> import serpentail as st
    >>> st.Tolerances(attitude="0.001 rad").tail
    0.1
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

    Examples
    --------
    >>> import serpentail as st
    >>> st.Solver("ipopt", time_limit="20 s").retries
    4
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

    Examples
    --------
    >>> import serpentail as st
    >>> st.Guess(damping=2e-3).motion is None
    True
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
        return replace(
            self,
            tolerances=replace(self.tolerances, **rougher),
            solver=replace(self.solver, retries=0, multi_start=1, track=False, watch=None),
            guess=replace(self.guess, motion=motion),
        )


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
