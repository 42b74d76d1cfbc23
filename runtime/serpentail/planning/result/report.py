"""Reports: a solved round goes in; what a plan costs and how true it is comes out, JSON-ready."""

import numpy as np

from ...attitude import angle_deg, pitch_roll_yaw, tilt_deg
from ...errors import SimulationError
from ...motion.trajectory import Trajectory
from ...simulation.pfl import Pfl
from ...simulation.simulate import simulate
from ..problem import PlanningProblem
from .curve import Curve

TRACKED = 580  # samples of a tracked motion


def report(run, best, trajectory: Trajectory) -> dict:
    """Return the summary of a run's best round, whose planned trajectory is given; None for what is
    not finite.
    """
    problem, solution, mesh = run.problem, best.solution, best.program.mesh
    energy, power = work(trajectory)
    found = {
        "converged": solution.success,
        "status": solution.status,
        "formulation": problem.formulation,
    }
    found |= {"attitude": problem.attitude, "rule": run.rule.name, "degree": run.rule.degree}
    found |= {
        "intervals": mesh.intervals,
        "nodes": len(best.program.places.others),
        "dynamics": run.equations.source,
    }
    found |= {
        "duration_s": best.curve.duration,
        "objective": objective(best),
        "effort": effort(best.curve),
    }
    found |= {"energy_J": energy, "peak_power_W": power} | truth(run, best, trajectory)
    return {
        name: None if isinstance(x, float) and not np.isfinite(x) else x
        for name, x in found.items()
    }


def truth(run, best, planned: Trajectory) -> dict:
    """Return the errors of the plan at its end: torques applied open loop, and the tail tracked by
    PFL.
    """
    apart, from_goal = attitude_errors(run.problem, best.planned[0][-1, 3:7], best.true[0][3:7])
    rates = np.abs(best.true[1][3:] - best.planned[1][-1, 3:]).max()
    found = {"open_loop_attitude_error_deg": apart, "open_loop_goal_error_deg": from_goal}
    found |= {"open_loop_rate_error": float(rates)}
    found |= {"tracked_attitude_error_deg": None, "tracked_tail_error_rad": None, "dyn_err": None}
    if not run.settings.track:
        return found
    try:
        flight = tracked(run.model, run.problem, planned)
    except SimulationError:  # a plan that did not converge may ask for anything
        return found
    deviation = flight.resample(np.clip(planned.t, 0, flight.t[-1])).tail - planned.tail
    return found | {
        "tracked_attitude_error_deg": max(
            attitude_errors(run.problem, planned.attitude[-1], flight.attitude[-1])
        ),
        "tracked_tail_error_rad": float(np.abs(deviation).max()),
        "dyn_err": dynamics_error(planned, flight),
    }


def objective(best) -> float:
    """The objective's value in SI units."""
    problem, value = best.program.problem, best.solution.value
    unit = best.program.form.units["torque"].mean()
    scales = {"effort": unit**2, "energy": 10 * unit}
    return value if callable(problem.objective) else value * scales.get(problem.objective, 1.0)


def effort(curve: Curve) -> float:
    """Integral of tau^2 (N^2 m^2 s) by the rule's quadrature."""
    squares = np.sum(curve.nodes["torque"] ** 2, axis=2)
    return float(np.diff(curve.ends) @ squares @ curve.rule.weights)


def work(trajectory: Trajectory) -> tuple[float, float]:
    """Energy (J), the integral of sum |tau q_t_dot|, and the largest such power (W)."""
    power = np.abs(trajectory.tau * trajectory.v[:, 6:]).sum(axis=1)
    return float(np.trapezoid(power, trajectory.t)), float(power.max())


def attitude_errors(
    problem: PlanningProblem, planned: np.ndarray, found: np.ndarray
) -> tuple[float, float]:
    """Angles (deg) between an attitude reached (4,) and that planned (4,), and between it and the
    goal.
    """
    apart, goal = float(angle_deg(planned, found)), problem.goal.attitude
    if goal is None:
        return apart, apart
    return apart, float(tilt_deg(found) if isinstance(goal, str) else angle_deg(goal, found))


def tracked(model, problem: PlanningProblem, planned: Trajectory) -> Trajectory:
    """Return the simulated motion whose tail tracks the plan by PFL."""
    law = Pfl(model, planned)
    settings = {"method": "dop853", "rtol": 1e-8, "atol": 1e-10, "output_step": planned.t[-1] / 580}
    return simulate(model, problem.q0, problem.v0, controller=law, t_span=planned.t[-1], **settings)


def dynamics_error(planned: Trajectory, found: Trajectory) -> float:
    """L2 distance over time of x = (p, phi, q_t, p_dot, omega, q_t_dot), SI, between two motions
    (Eq. 50).
    """
    at = found.resample(np.clip(planned.t, found.t[0], found.t[-1]))
    difference = _states(planned) - _states(at)
    difference[:, 3:6] -= 2 * np.pi * np.round(difference[0, 3:6] / (2 * np.pi))
    return float(np.sqrt(np.trapezoid(np.sum(difference**2, axis=1), planned.t)))


def _states(trajectory: Trajectory) -> np.ndarray:
    angles = pitch_roll_yaw(trajectory.q, unwrap=True)
    return np.column_stack([trajectory.q[:, :3], angles, trajectory.tail, trajectory.v])
