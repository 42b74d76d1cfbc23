"""The numbers of ``Plan.report``: what a plan costs, and how true it is."""

from typing import TYPE_CHECKING, Any

import numpy as np

from serpentail_scene.layout import POSITION, QUATERNION

from ...basics.attitude import pitch_roll_yaw
from ...basics.errors import SimulationError
from ...model.model import Model
from ...motion.trajectory import Trajectory
from ...simulation.controllers.pfl import Pfl
from ..flight import flight
from ..free_variables import chosen, start_found
from ..problem import PlanningProblem
from ..program.objective import objective_unit
from ..tendons import is_direct
from .curve import Curve
from .excess import largest
from .truth import attitude_errors, work

if TYPE_CHECKING:
    from ..round import Round
    from ..search import Search

TRACKED_SAMPLES = 580  # of a tracked motion
TRACKING_COST = 0.1  # about how long tracking takes (s), of the flight's duration


def report(search: "Search", best: "Round", planned: Trajectory) -> dict[str, Any]:
    """Return the summary of a search's best round; None for a number that is not finite.

    planned: the round's trajectory.
    """
    problem, solution, program = best.problem, best.solution, best.program
    energy, power = work(best.model, best.curve, problem.damping, best.start)
    excess, of = largest(best.excess)
    values = {
        "converged": solution.success,
        "status": solution.status,
        "solver": solution.solver,
        "degree": search.rule.degree,
        "intervals": program.mesh.intervals,
        "nodes": program.mesh.intervals * search.rule.degree,
        "dynamics": "compiled" if program.compiled else "symbolic",
        "duration_s": best.curve.duration,
        "objective": objective(best),
        "effort": effort(best.curve),
        "energy_J": energy,
        "peak_power_W": power,
        "bound_excess": excess,
        "bound_excess_of": of,
    }
    if problem.design.size:
        values |= {"design": chosen(problem, best.model), "design_slopes": slopes(best)}
    if problem.free_start:
        values["start"] = start_found(problem)
    values |= truth(search, best, planned)
    lost = [name for name, x in values.items() if isinstance(x, float) and not np.isfinite(x)]
    return values | dict.fromkeys(lost)


def truth(search: "Search", best: "Round", planned: Trajectory) -> dict[str, Any]:
    """Return the plan's errors at its end.

    They are found twice: with the torques applied open loop, and with the tail tracked by PFL and
    torques within their bound.
    """
    problem, true_q = best.problem, best.true[0]
    to_plan, to_goal = attitude_errors(problem, best.planned[0][-1, QUATERNION], true_q[QUATERNION])
    errors: dict[str, Any] = {
        "open_loop_attitude_error_deg": to_plan,
        "open_loop_goal_error_deg": to_goal,
        "open_loop_tail_error_deg": best.errors["tail"],
        "open_loop_rate_error": best.errors["rate"],
        "tracked_attitude_error_deg": None,
        "tracked_tail_error_rad": None,
        "true_when_tracked": None,
        "dyn_err": None,
    }
    needed = TRACKING_COST * float(planned.t[-1])
    # PFL would give torques that tendons cannot, and passive coordinates need none
    tracks = is_direct(best.model) and search.settings.solver.track
    if not tracks or search.leaves_no_time(needed):
        return errors
    try:
        motion = tracked(best.model, problem, planned)
    except SimulationError:  # a plan that did not converge may ask for anything
        return errors
    deviation = motion.resample(np.clip(planned.t, 0, motion.t[-1])).tail - planned.tail
    ends = attitude_errors(problem, planned.attitude[-1], motion.attitude[-1])
    return errors | {
        "tracked_attitude_error_deg": max(ends),
        "true_when_tracked": bool(max(ends) <= (search.settings.tolerances.attitude or np.inf)),
        "tracked_tail_error_rad": float(np.abs(deviation).max()),
        "dyn_err": dynamics_error(planned, motion),
    }


def objective(best: "Round") -> float:
    """The objective's value in SI units."""
    if best.problem.objective == "time":
        return best.curve.duration
    return best.solution.value * objective_unit_of(best)


def slopes(best: "Round") -> dict[str, Any]:
    """Derivatives of the least objective by the design, SI, from multipliers; 0 inside a range."""
    design = best.problem.design
    own = best.solution.slopes[: design.size]
    found = design.split(own / design.units * objective_unit_of(best))
    return {name: np.asarray(slope).tolist() for name, slope in found.items()}


def objective_unit_of(best: "Round") -> float:
    """SI units of the program's objective."""
    return objective_unit(best.problem, best.program.variables)


def effort(curve: Curve) -> float:
    """Integral of tau^2 (N^2 m^2 s), or of tensions squared (N^2 s), by the rule's quadrature."""
    (inputs,) = curve.nodes.values()
    squares = np.sum(inputs**2, axis=2)
    return float(np.diff(curve.ends) @ squares @ curve.rule.weights)


def tracked(model: Model, problem: PlanningProblem, planned: Trajectory) -> Trajectory:
    """Return the simulated motion whose tail tracks the plan by PFL.

    Without the function "pfl" the law is Python: fewer calls change its errors by 1e-4 deg.
    """
    loose = 1.0 if "pfl" in model.kernels else 100.0
    return flight(
        model,
        (problem.q0, problem.v0),
        Pfl(model, planned, torque=problem.bounds.torque),
        planned.t[-1],
        method="tsit5",
        rtol=1e-8 * loose,
        atol=1e-10 * loose,
        output_step=planned.t[-1] / TRACKED_SAMPLES,
    )


def dynamics_error(planned: Trajectory, tracked: Trajectory) -> float:
    """L2 distance over time of x between two motions (Eq. 50).

    x = (p, phi, q_t, p_dot, omega, q_t_dot), SI.
    """
    at_planned = tracked.resample(np.clip(planned.t, tracked.t[0], tracked.t[-1]))
    difference = _states(planned) - _states(at_planned)
    angles = difference[:, 3:6]
    angles -= 2 * np.pi * np.round(angles[0] / (2 * np.pi))
    return float(np.sqrt(np.trapezoid(np.sum(difference**2, axis=1), planned.t)))


def _states(trajectory: Trajectory) -> np.ndarray:
    """x (K, 6 + 2m + nv) of a motion."""
    angles = pitch_roll_yaw(trajectory.q, unwrap=True)
    return np.column_stack([trajectory.q[:, POSITION], angles, trajectory.tail, trajectory.v])
