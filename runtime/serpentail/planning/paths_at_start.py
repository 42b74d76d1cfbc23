"""Path constraints that a known start violates, found before anything is derived."""

from typing import TYPE_CHECKING

import numpy as np

from serpentail_scene.layout import OMEGA, QUATERNION, TAIL_Q, TAIL_V

from ..basics.errors import PlanningError
from ..model.model import Model
from .design import Design
from .problem import START_SLACK, PlanningProblem
from .program.body import BodyFunctions
from .program.point import PathPoint, asked, point_of
from .result.excess import SLACK
from .result.full_state import com_at_start
from .tendons import TENSION, input_of, torque_expression

if TYPE_CHECKING:
    import casadi as ca


def refuse_violated(model: Model, problem: PlanningProblem) -> None:
    """PlanningError if the start violates a path constraint.

    Nothing is refused that depends on torques or on a duration that is free, nor if the planner
    chooses the start or parameters.
    """
    import casadi as ca

    if problem.is_free or not problem.path:
        return
    point, unknown = _start(model, problem)
    for k, (function, least, most) in enumerate(problem.path):
        values = ca.vec(asked(f"path[{k}]", function, point))
        if ca.depends_on(values, unknown):
            continue
        found = np.array(ca.evalf(values)).ravel()
        limits = [abs(limit) for limit in (least, most) if np.isfinite(limit)]
        slack = SLACK * max(limits, default=0.0) + START_SLACK
        wrong = np.flatnonzero(~((found >= least - slack) & (found <= most + slack)))
        if wrong.size:
            of = f", entry {wrong[0]}" if found.size > 1 else ""
            raise PlanningError(
                f"path[{k}]: the start has {found[wrong[0]]:.6g}{of}, beyond ({least:.6g}, "
                f"{most:.6g}): widen the bounds, or start inside them"
            )


def _start(model: Model, problem: PlanningProblem) -> "tuple[PathPoint, ca.SX]":
    """Return the point of a known start, and the symbols of what is not known there."""
    import casadi as ca

    # the state, and what its flight conserves
    state = {
        "attitude": problem.q0[QUATERNION],
        "tail": problem.q0[TAIL_Q],
        "tail_rate": problem.v0[TAIL_V],
        "torso_rate": problem.v0[OMEGA],
    }
    blocks = {name: ca.SX(ca.DM(part)) for name, part in state.items()}
    blocks["quaternion"] = blocks["attitude"]
    com, com_velocity = com_at_start(model, (problem.q0, problem.v0))
    body = BodyFunctions(model, Design(), None)

    # torques, and times
    name, size = input_of(model)
    own, duration = ca.SX.sym(name, size), ca.SX.sym("duration")
    least, most = problem.duration
    blocks |= {name: own, "time": ca.SX(0)}
    if name == TENSION:
        blocks["torque"] = torque_expression(body, blocks["tail"], own)
    blocks["duration"] = duration if least < most else ca.SX(most)
    point = point_of(body, blocks, ca.SX(ca.DM(np.append(com, com_velocity))), problem.legs)
    return point, ca.vertcat(own, duration)
