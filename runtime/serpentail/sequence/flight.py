"""The planned flight of a phase: the landing that it is for, its plan, and its tracking."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from serpentail_scene.layout import QUATERNION, TAIL_Q

from ..basics.errors import SimulationError
from ..model.model import Model
from ..model.weight import fall
from ..mpc.mpc import Mpc
from ..planning.goal import Goal
from ..planning.planner import plan
from ..planning.problem import checked_goal
from ..planning.result.full_state import com_at_start
from ..planning.result.plan import Plan
from ..planning.tendons import refuse_tendons
from ..simulation.controllers.controller import Controller
from ..simulation.controllers.pfl import Pfl
from .phase import BEFORE, Phase

MORE = 2.0  # of the bound of the torque: tried where no plan is true, for the advice
UPRIGHT = np.array([1.0, 0.0, 0.0, 0.0])
State = tuple[np.ndarray, np.ndarray]  # q, v


@dataclass(frozen=True, eq=False)
class PlannedFlight:
    """A plan, the controller that tracks it, or the phase's own if the plan is not true, and the
    time (s) from its start to the landing, if that is needed.
    """

    plan: Plan
    controller: Controller
    landing: float | None


def planned_flight(model: Model, phase: Phase, state: State, angles: np.ndarray) -> PlannedFlight:
    """Return the first successful plan of a phase from a state, else the one that misses least,
    whose report's ``advice`` then says what would help.

    angles (2,): gamma, delta (rad) of the legs at the landing.
    """
    refuse_tendons(model, "plan of a phase")
    attempts: list[tuple[Plan, float | None]] = []
    for arguments in phase.plan:
        attempts.append(_attempt(model, phase, arguments, state, angles))
        if attempts[-1][0].success:
            break
    best, landing = min(attempts, key=lambda attempt: _miss(attempt[0]))
    if not best.success:
        advice = _advice(model, phase, [found for found, _ in attempts], state, angles)
        best = replace(best, report=best.report | {"advice": advice})
        return PlannedFlight(best, phase.controller, landing)
    return PlannedFlight(best, tracker(model, phase, best), landing)


def tracker(model: Model, phase: Phase, plan: Plan) -> Controller:
    """Return what tracks a plan of a phase."""
    tracking = phase.tracking
    if tracking.mpc is not None:
        return Mpc(model, plan, **tracking.mpc)
    return Pfl(model, plan, tracking.kp, tracking.kd, torque=plan.problem.bounds.torque)


def _advice(
    model: Model, phase: Phase, failed: list[Plan], state: State, angles: np.ndarray
) -> str:
    """Return which torque suffices: what a search has told, or what the plans tell with more. Of a
    longer duration, which only a higher jump gives, nothing is said.
    """
    for k, found in enumerate(failed):
        if "torque" in (found.report["advice"] or ""):
            return f"plan[{k}].{found.report['advice']}"
    for k, found in enumerate(failed):
        bounds = found.problem.bounds
        if bounds.torque is not None and not found.report["stopped"]:
            more = replace(bounds, torque=MORE * np.asarray(bounds.torque))
            wider = {**phase.plan[k], "bounds": more}
            if _attempt(model, phase, wider, state, angles)[0].success:
                return f"plan[{k}].bounds.torque: {np.max(more.torque):.3g} N m suffices"
    return f"nor with {MORE:g} times the torque: give it further goals, or change its jump"


def _attempt(
    model: Model, phase: Phase, arguments: Mapping[str, Any], state: State, angles: np.ndarray
) -> tuple[Plan, float | None]:
    """Return a plan from a state, and the time of its landing (s) if that is needed."""
    landing = None
    if "duration" not in arguments or any(BEFORE in move for move in phase.moves):
        goal = checked_goal(arguments.get("goal"), model.layout)
        landing = landing_time(model, state, goal, angles)
        arguments = {"duration": landing - phase.tracking.early, **arguments}
    return plan(model, start=state, **arguments), landing


def _miss(attempt: Plan) -> float:
    """Return how far (deg) a plan's true motion misses the goal; -1 for a successful plan, inf for
    one of an easier problem.
    """
    error, easier = attempt.report["open_loop_goal_error_deg"], attempt.report["advice"]
    return -1.0 if attempt.success else np.inf if error is None or easier else float(error)


def landing_time(model: Model, state: State, goal: Goal, angles: np.ndarray) -> float:
    """Return the time (s) from a state to the landing in the posture of a checked goal.

    Then the lowest foot, or the lowest point of a model without feet, is at the ground. Parts that
    the goal leaves free count as upright and straight. SimulationError if the centre of mass never
    reaches that height.
    """
    (_, _, z), (_, _, rise) = com_at_start(model, state)
    drop, g = z - _height(model, goal, angles), -float(fall(model.parameters)[2])
    inside = rise**2 + 2 * g * drop
    if g <= 0 or inside < 0:
        raise SimulationError(
            f"landing: the centre of mass is {-drop:.3g} m too low for the goal's posture, and "
            f"rises {max(rise, 0) ** 2 / (2 * g) if g > 0 else 0:.3g} m: give the plan a duration"
        )
    time = (rise + math.sqrt(inside)) / g
    if time <= 0:
        raise SimulationError("landing: it is in the past: give the plan a duration")
    return time


def _height(model: Model, goal: Goal, angles: np.ndarray) -> float:
    """Return the height (m) of the centre of mass over the lowest foot or point in a posture."""
    q, at_rest = np.zeros(model.nq), np.zeros(model.nv)
    named = isinstance(goal.attitude, str) or goal.attitude is None
    q[QUATERNION] = UPRIGHT if named else goal.attitude
    if goal.tail is not None:
        q[TAIL_Q] = np.nan_to_num(goal.tail)
    points = points_of(model, (q, at_rest), angles)
    lowest = points[: model.contacts.get("feet", len(points)), 2].min()
    return float(com_at_start(model, (q, at_rest))[0][2] - lowest)


def points_of(model: Model, state: State, angles: np.ndarray) -> np.ndarray:
    """Return the contact points (P, 3), with the legs of a model with feet at these angles."""
    legs = (np.array([*angles, *angles, *np.zeros(4)]),) if "feet" in model.contacts else ()
    return np.asarray(model.contact_points(*state, *legs)[0])
