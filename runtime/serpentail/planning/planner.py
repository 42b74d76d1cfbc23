"""``plan``: finds motions of the tail by direct collocation."""

from collections.abc import Callable, Mapping, Sequence
from inspect import Parameter, signature
from typing import Any, Never

from ..basics import extras
from ..basics.checks import Refusals, needed, none_of
from ..basics.errors import PlanningError
from ..model.model import Model
from ..motion.trajectory import Trajectory
from ..simulation.controllers.schedules import Legs
from .best import best_plan
from .goal import Bounds, Goal
from .problem import SMOOTHING, PathConstraint, checked_problem
from .result.plan import Plan
from .settings import PlanSettings, check_settings


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
    design: Mapping[str, Any] | None = None,
    free_start: Mapping[str, Any] | None = None,
    # the mesh
    degree: int | None = None,
    intervals: int | None = None,
    most_intervals: int | None = None,
    controls: int | None = None,
    rounds: int = 6,
    tolerance: float | None = 0.01,
    tail_tolerance: float | None = 0.1,
    rate_tolerance: float | None = 0.1,
    # the solver
    solver: str = "auto",
    options: dict[str, Any] | None = None,
    time_limit: float | None = None,
    # where it begins
    guess: Plan | Trajectory | Sequence[Plan] | None = None,
    guess_damping: float = 1e-3,
    multi_start: int = 1,
    retries: int = 4,
    seed: int = 0,
    # output
    track: bool = True,
    through_torso: bool = False,
    watch: Callable[[Plan], object] | None = None,
    **unknown: Never,
) -> Plan:
    """Plan a motion of the tail by direct collocation, and check what its torques do (Sect. 3).

    Every plan is integrated again with its torques applied open loop. The mesh is refined until
    the end of that true motion is right within tolerances.

    Parameters
    ----------
    model : Model
        The model, with a free base. A loaded one needs "mass_matrix", "forward_dynamics",
        "rollout", "energy" and "momentum". If it has contacts, its flight is planned without the
        ground.
    start : State, or (array_like, array_like)
        State at the start, such as ``model.state(height="34 cm")``, or (q0 (nq,), v0 (nv,)).
    goal : Goal or str, optional
        What holds at the end. Default: "upright", the torso upright and at rest, at any yaw.
    duration : float or (float, float)
        Duration (s), or (least, most) if it is free; also text with a unit, such as "580 ms".
    bounds : Bounds, optional
        Bounds along the motion. Default: torques up to 0.02 N m.
    objective : {"effort", "energy", "time"} or callable, default "effort"
        What is minimised: the integral of tau^2 + (smoothing q_t_dot)^2; the integral of the sum
        of the absolute powers of all torques; the duration; or the integral of a function of a
        point (see Notes).
    smoothing : float, default 3e-4
        Weight of the tail's rates in the effort (N m s). At 0, which is the paper's effort, plans
        may whirl a light tail.
    damping : float, default 0
        Damping of the tail coordinates (N m s, Eq. 47), in addition to the planned torques.
    path : sequence of (callable, float, float), optional
        Path constraints: (function of a point, least, most).
    clearance : float, optional
        Least height (m) of all points of tail and torso that can touch the ground, during the
        whole flight. Default: no constraint.
    legs : Legs, optional
        Legs of a model with feet, for path constraints on its ``contact_points``; they stay as
        they are at 0 s.
    design : mapping, optional
        Parameters of the model that the planner chooses: name to (least, most), each one number
        or all numbers of the parameter (SI, or text with a unit).
    free_start : mapping, optional
        Parts of the start that the planner chooses: "tail", "tail_rate", "torso_rate",
        "position", "velocity", or "attitude" (pitch, roll, yaw), to (least, most), each one
        number or all of the part (SI).
        ``start`` is then the first guess of these parts.

    Returns
    -------
    Plan
        The best plan found; see its ``success`` and ``report``.

    Other Parameters
    ----------------
    degree : int, optional
        Degree of Radau's collocation rule, from 1 to 5. Default: 3.
    intervals : int, optional
        Number of intervals of the first mesh. Default: in each control interval 1 if the tail has
        up to two segments, 4 up to four segments, else 12; a search that finds no true plan begins
        again with 12.
    most_intervals : int, default 400
        Largest number of intervals.
    controls : int, default 12
        Number of equal control intervals; in each, the torques are one polynomial, however fine
        the mesh is. With the objective "time" torques are linear in each.
    rounds : int, default 6
        Largest number of refinements.
    tolerance : float or None, default 0.01
        Largest error of the true attitude at the end (deg); None for no demand.
    tail_tolerance : float or None, default 0.1
        Largest error of the true tail coordinates at the end (deg); None for no demand.
    rate_tolerance : float or None, default 0.1
        Largest error of the true rates of torso and tail at the end (rad/s); None for no demand.
    solver : {"auto", "fatrop", "ipopt"}, default "auto"
        What solves the program. "auto" is FATROP, and IPOPT from the same guesses if FATROP finds
        nothing; ``report["solver"]`` says which.
    options : dict, optional
        Options of the solvers, such as ``{"fatrop.max_iter": 500, "ipopt.max_iter": 500}``.
    time_limit : float, optional
        Time for the search (s). If it leaves no time to track the plan, the report has no errors
        of tracking.
    guess : Plan, Trajectory or sequence of Plan, optional
        First guess. Default: passive flight. Of a sequence of plans, that with the nearest start
        is tried if passive flight leads to none.
    guess_damping : float, default 1e-3
        Damping of that passive flight (N m s).
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
    through_torso : bool, default False
        Whether the tail may go through the torso. Otherwise a plan in which it does is made again
        with a constraint; if that finds none, ``plan.warnings`` tells.
    watch : callable, optional
        Function that receives the Plan of each round when it is found. An exception that it
        raises ends the search.

    Raises
    ------
    PlanningError
        The problem or a setting is wrong; the message names every field with value and remedy.
    ModelError
        The base is fixed, or the scene lacks a function.
    ExtraMissing
        CasADi is not installed; it comes with the extra "plan".

    Notes
    -----
    A point, which objectives and path constraints receive, has the CasADi blocks ``tail``,
    ``tail_rate``, ``torso_rate``, ``torque``, ``attitude``, ``quaternion``, ``time``,
    ``duration``, ``position``, ``height``, ``tip``, ``tail_points``, ``center_of_mass``,
    ``contact_points`` and ``body_points`` in SI units, ``drift`` and the model's ``parameters``
    by name. ``torso_rate`` is in body axes; quaternions are (w, x, y, z), from torso to world.

    Between nodes, bounds hold to one part in 1000.

    Programs and solvers are kept: planning from another start on the mesh of a plan derives
    nothing again. Ctrl-C or the time limit ends the search, and the best plan so far is
    returned. A second Ctrl-C raises KeyboardInterrupt.

    Examples
    --------
    >>> start = q0, v0  # doctest: +SKIP
    >>> plan = st.plan(model, start=start, duration=0.3)  # doctest: +SKIP
    >>> plan.success, plan.report["effort"]  # doctest: +SKIP
    """
    extras.needed("casadi", "plan")
    model.refuse_fixed("plan")
    refused = Refusals(PlanningError)
    for name in unknown:
        same = OTHER_WORDS.get(name)
        meant = f"setting: value {name!r}: did you mean {same!r}?"
        refused.add(name, meant if same else none_of("setting", name, NAMES))
    if watch is not None and not callable(watch):
        refused.add("watch", needed("watch", watch, "a function of a Plan, or None"))
    settings = PlanSettings(
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
        time_limit=time_limit,
        guess=guess,
        guess_damping=guess_damping,
        multi_start=multi_start,
        retries=retries,
        seed=seed,
        track=track,
        through_torso=through_torso,
    )
    check_settings(model, settings, refused)
    of_problem = {
        "objective": objective,
        "smoothing": smoothing,
        "damping": damping,
        "path": path,
        "clearance": clearance,
        "legs": legs,
        "design": design,
        "free_start": free_start,
    }
    task = (
        start,
        goal,
        duration,
        Bounds() if bounds is None else bounds,
    )
    problem = checked_problem(model, task, of_problem, refused)
    refused.tell()
    assert problem is not None  # otherwise tell() has raised
    return best_plan(model, problem, settings, watch)


OTHER_WORDS = {  # of other planners, for our settings
    **dict.fromkeys(("num_nodes", "nodes", "n_nodes", "num_intervals", "N"), "intervals"),
    **dict.fromkeys(("constraints", "path_constraints"), "path"),
    **dict.fromkeys(("initial_guess", "initial"), "guess"),
    "x0": "start",
}
NAMES = [
    name
    for name, parameter in signature(plan).parameters.items()
    if parameter.kind == Parameter.KEYWORD_ONLY
]
