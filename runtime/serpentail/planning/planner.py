"""``plan``: finds motions of the tail by direct collocation."""

import warnings
from collections.abc import Callable, Mapping, Sequence
from inspect import Parameter, signature
from typing import Any, Never

from serpentail_scene.messages import nearest

from ..basics import extras
from ..basics.checks import Refusals
from ..basics.errors import PlanningError
from ..model.chains import refuse_given
from ..model.checked import checked_model
from ..model.model import Model
from ..model.state import Quantities, Quantity, State
from ..motion.trajectory import Trajectory
from ..simulation.controllers.schedules import Legs
from .best import best_plan
from .goal import Bounds, Goal
from .problem import SMOOTHING, PathConstraint, checked_problem
from .result.plan import Plan
from .settings import PLACES, Guess, Mesh, Solver, Tolerances, checked_settings, spelled


def plan(  # noqa: PLR0913 - the public face names all that it takes
    model: Model,
    *,
    start: State | tuple[Quantities, Quantities],
    goal: Goal | str | None = None,
    duration: Quantity | tuple[Quantity, Quantity],
    bounds: Bounds | None = None,
    # the problem
    objective: str | Callable[[Any], Any] = "effort",
    smoothing: Quantity = SMOOTHING,
    damping: Quantity = 0.0,
    path: Sequence[PathConstraint] = (),
    clearance: Quantity | None = None,
    legs: Legs | None = None,
    design: Mapping[str, Any] | None = None,
    design_totals: Mapping[str, Quantity] | None = None,
    free_start: Mapping[str, Any] | None = None,
    # the search
    mesh: Mesh | None = None,
    tolerances: Tolerances | None = None,
    solver: Solver | str = "auto",
    guess: Guess | Plan | Trajectory | Sequence[Plan] | None = None,
    **old: Never,
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
    design_totals : mapping, optional
        Parameters of the design whose numbers keep a sum: name to this sum, such as
        ``{"link_lengths": "195 mm"}``.
    free_start : mapping, optional
        Parts of the start that the planner chooses: "tail", "tail_rate", "torso_rate",
        "position", "velocity", or "attitude" (pitch, roll, yaw), to (least, most), each one
        number or all of the part (SI).
        ``start`` is then the first guess of these parts.
    mesh : Mesh, optional
        The mesh: ``st.Mesh(degree=, intervals=, most_intervals=, controls=, rounds=)``.
    tolerances : Tolerances, optional
        When the plan is true: ``st.Tolerances(attitude=, tail=, rate=, through_torso=)``.
    solver : Solver or {"auto", "fatrop", "ipopt"}, default "auto"
        What solves the program: a name, or ``st.Solver(name, options=, time_limit=,
        multi_start=, retries=, seed=, track=, watch=)``.
    guess : Guess, Plan, Trajectory or sequence of Plan, optional
        Where the search begins: a motion, or ``st.Guess(motion, damping=)``. Default: passive
        flight.

    Returns
    -------
    Plan
        The best plan found; see its ``success`` and ``report``.

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
    checked_model(model, PlanningError).refuse_fixed("plan")
    refuse_given(model, "plan")
    refused = Refusals(PlanningError)
    known: dict[str, Any] = {name: old[name] for name in old if name in PLACES}
    for name in known:
        warnings.warn(f"{name}= is now {spelled(name)}", DeprecationWarning, stacklevel=2)
    for name in [name for name in old if name not in known]:
        refused.add(name, f"setting: value {name!r}: {_meant(name)}")
    given = {"mesh": mesh, "tolerances": tolerances, "solver": solver, "guess": guess}
    settings = checked_settings(model, given, known, refused)
    of_problem = {
        "objective": objective,
        "smoothing": smoothing,
        "damping": damping,
        "path": path,
        "clearance": clearance,
        "legs": legs,
        "design": design,
        "design_totals": design_totals,
        "free_start": free_start,
    }
    task = (start, goal, duration, Bounds() if bounds is None else bounds)
    problem = checked_problem(model, task, of_problem, refused)
    refused.tell()
    assert problem is not None  # otherwise tell() has raised
    return best_plan(model, problem, settings)


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


def _meant(name: str) -> str:
    """Return what may have been meant by the name of a setting that there is not."""
    near = nearest(OTHER_WORDS.get(name, name), [*NAMES, *PLACES])
    if not near:
        return f"needs {' or '.join(map(repr, NAMES))}"
    return f"did you mean {repr(near) if near in NAMES else spelled(near)}?"
