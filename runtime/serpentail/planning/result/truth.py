"""The true motion under a plan's torques, integrated by Tsit5 in C.

Its end shows the plan's error; its intervals show where the mesh is too coarse.
"""

import numpy as np

from serpentail_scene.layout import OMEGA, QUATERNION, TAIL_Q, TAIL_V

from ...basics.attitude import angle_deg, tilt_deg
from ...basics.errors import SimulationError
from ...model.model import Model
from ...motion.resample import smooth
from ...simulation.controllers.controller import Controller, TensionCurve, TorqueCurve
from ...simulation.controllers.piecewise import Piecewise
from ..flight import end_of_flight, flight
from ..problem import PlanningProblem
from ..tendons import TENSION, torques_of
from .curve import Curve

SAMPLE = 1e-3  # s, the most between samples of a flight
SHORT_INTERVAL = 0.02  # s: rates of shorter ones are weighed as if they were as long


def applied(
    model: Model, law: Controller, duration: float, q: np.ndarray, v: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return q, v after applying a plan's law from the state q, v; nan if they diverge.

    Its polynomials are the plan's own; steps end where they join.
    """
    try:
        return end_of_flight(model, (q, v), law, duration)
    except SimulationError:  # bent or rotating beyond the model's range
        return np.full_like(q, np.nan), np.full_like(v, np.nan)


def planned_law(curve: Curve, damping: float, inputs: Piecewise | None = None) -> Controller:
    """Return the controller of a plan's torques or tensions, or of a part of them, and damping."""
    law = TensionCurve if TENSION in curve.nodes else TorqueCurve
    return law(inputs or planned_torques(curve), damping)


def planned_torques(curve: Curve) -> Piecewise:
    """Return the torques or tensions of a curve."""
    (inputs,) = curve.nodes.values()
    coefficients = np.swapaxes(inputs, 1, 2) @ curve.rule.powers()
    widths = np.diff(curve.ends)[:, None, None]
    return Piecewise(curve.ends, coefficients / widths ** np.arange(coefficients.shape[2]))


def open_loop(
    model: Model, curve: Curve, damping: float, start: tuple[np.ndarray, np.ndarray]
) -> tuple[np.ndarray, np.ndarray]:
    """Return q (nq,), v (nv,) at the end, the planned torques applied from the start."""
    return applied(model, planned_law(curve, damping), curve.duration, *start)


def end_errors(
    problem: PlanningProblem,
    planned: tuple[np.ndarray, np.ndarray],
    true: tuple[np.ndarray, np.ndarray],
) -> dict[str, float]:
    """Return the distances of a true q, v at the end from the planned ones; inf if they diverged.

    "attitude": deg, to the plan or the goal, the larger one; "tail": deg; "rate": rad/s, of torso
    and tail.
    """
    (q, v), (true_q, true_v) = planned, true
    rates = slice(OMEGA.start, None)
    errors = {
        "attitude": max(attitude_errors(problem, q[QUATERNION], true_q[QUATERNION])),
        "tail": float(np.degrees(np.abs(true_q[TAIL_Q] - q[TAIL_Q]).max(initial=0))),
        "rate": float(np.abs(true_v[rates] - v[rates]).max()),
    }
    return {name: error if np.isfinite(error) else np.inf for name, error in errors.items()}


def attitude_errors(
    problem: PlanningProblem, planned: np.ndarray, reached: np.ndarray
) -> tuple[float, float]:
    """Return the angles (deg) from the reached attitude (4,) to the planned one and the goal."""
    to_plan, goal = float(angle_deg(planned, reached)), problem.goal.attitude
    if goal is None:
        return to_plan, to_plan
    if isinstance(goal, str):
        return to_plan, float(tilt_deg(reached))
    return to_plan, float(angle_deg(goal, reached))


def work(
    model: Model, curve: Curve, damping: float, start: tuple[np.ndarray, np.ndarray]
) -> tuple[float, float]:
    """Return energy (J) and largest power (W) of the planned torques applied from the start.

    The energy is the integral of the sum of all absolute powers tau q_t_dot, by Gauss's rule with
    four nodes, between which torques do not jump. Both are nan if the motion diverges.
    """
    law, sample = planned_law(curve, damping), min(SAMPLE, curve.duration / 4)
    try:
        motion = flight(model, start, law, curve.duration, method="tsit5", output_step=sample)
    except SimulationError:
        return np.nan, np.nan
    counts = np.ceil(np.diff(curve.ends) / sample).astype(int)
    widths = np.repeat(np.diff(curve.ends) / counts, counts)
    nodes, weights = np.polynomial.legendre.leggauss(4)
    starts = np.cumsum(widths) - widths
    between = (starts[:, None] + widths[:, None] * (1 + nodes) / 2).ravel()
    # the largest may be where torques jump, just before or after
    times = np.concatenate([between, np.nextafter(curve.ends[1:], 0), curve.ends[:-1]])
    tail, rates = (smooth(motion.t, x, times) for x in (motion.q[:, TAIL_Q], motion.v[:, TAIL_V]))
    inputs = {name: planned_torques(curve).at(times)[0] for name in curve.nodes}
    power = np.abs(torques_of(model, {"tail": tail, **inputs}) * rates).sum(axis=1)
    energy = np.outer(widths, weights / 2).ravel() @ power[: between.size]
    return float(energy), float(power.max())


def local_errors(
    model: Model, curve: Curve, damping: float, q: np.ndarray, v: np.ndarray
) -> np.ndarray:
    """Return an error (N,) of every interval: from its planned start to its planned end.

    q, v (N + 1, ..): planned, at the ends.  An error is the largest of the attitude's angle (rad),
    the tail's angles (rad) and rates (rad/s, weighed by the interval).
    """
    errors, inputs, rates = np.zeros(len(q) - 1), planned_torques(curve), slice(OMEGA.start, None)
    for k, width in enumerate(np.diff(curve.ends)):
        piece = Piecewise(np.array([0.0, width]), inputs.coefficients[k : k + 1])
        law = planned_law(curve, damping, piece)
        true_q, true_v = applied(model, law, float(width), q[k], v[k])
        if not np.isfinite(true_q).all():
            errors[k] = np.pi
            continue
        angle = np.radians(angle_deg(true_q[QUATERNION], q[k + 1, QUATERNION]))
        tail = np.abs(true_q[TAIL_Q] - q[k + 1, TAIL_Q]).max(initial=0)
        rate = np.abs(true_v[rates] - v[k + 1, rates]).max() * max(width, SHORT_INTERVAL)
        errors[k] = max(angle, tail, rate)
    return errors
