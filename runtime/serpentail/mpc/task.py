"""A plan, its goal and its bounds as the controller's C takes them (native/mpc.h)."""

import ctypes
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..model.model import Model
from ..planning.gains.riccati import ANGLE, NONE, RATE, TURN_RATE, most_torque
from ..planning.goal import middle
from ..planning.problem import PlanningProblem
from ..planning.program.end import goal_matrix
from ..planning.result.curve import Curve, fitted
from ..planning.result.plan import Plan
from .kernel import FUNCTIONS, kernel
from .settings import NEEDED, MpcSettings

TURN = 1e-3  # rad: weighs at the end as ANGLE, of the torso
# distances from the target: beyond NEAR a tick takes another step, beyond MISS it has a flag
NEAR, MISS = np.radians([0.5, 1.0]) / TURN
BLOCKS = ("torque", "attitude", "tail", "tail_rate")


@dataclass(frozen=True, eq=False)
class MpcTask:
    """A task's numbers and arrays by the names of ``mpc_task``; record: the same for ctypes; real:
    the type of its numbers, "double" or "float".
    """

    real: str
    numbers: dict[str, float]
    arrays: dict[str, np.ndarray]
    record: ctypes.Structure


def task_of(model: Model, plan: Plan, settings: MpcSettings) -> MpcTask:
    """Return the task of a plan that a model's body is to follow."""
    problem, duration = plan.problem, plan.duration
    horizon = min(settings.horizon, duration)
    times, polynomials = polynomials_of(plan.curve)
    bounds = settings.bounds
    most = most_torque(plan, bounds)
    arrays = {
        "times": times,
        "plan": polynomials,
        "most_torque": most if bounds.torque is not None else np.full_like(most, NONE),
        "most_tail": np.concatenate([_limits(bounds.angle, most), _limits(bounds.rate, most)]),
        "torque_weight": 1 / most**2 / duration,
        "rate_weight": (problem.smoothing / most) ** 2 / duration,
        "track_weight": np.repeat([1 / ANGLE**2, 1 / RATE**2], len(most)),
        "parameters": model.parameter_vector,
    } | _goal(problem, len(most))
    numbers = {
        "tail": model.layout.nt,
        "intervals": settings.intervals,
        "steps": _steps(horizon / settings.intervals, settings.step),
        "late_steps": _steps(settings.delay, settings.step),
        "iterations": settings.iterations,
        "goal_rows": len(arrays["goal"]),
        "pieces": len(times) - 1,
        "powers": polynomials.shape[2],
        "work": max(model.manifest["work"].get(name, 0) for name in NEEDED.values()),
        "period": 1 / settings.rate,
        "delay": settings.delay,
        "horizon": horizon,
        "end": duration,
        "last": duration - settings.rest - settings.delay,
        "damping": problem.damping,
        "near": NEAR,
        "miss": MISS,
        "attitude_weight": 1 / TURN**2,
    }
    real = model.manifest["real"]
    made = kernel(real)
    arrays = {name: np.ascontiguousarray(array, made.real) for name, array in arrays.items()}
    places: dict[str, Any] = {name: array.ctypes.data for name, array in arrays.items()}
    for name in FUNCTIONS:
        function = getattr(model.library, f"{model.name}_{NEEDED[name]}")
        places[name] = ctypes.cast(function, ctypes.c_void_p).value
    return MpcTask(real, numbers, arrays, made.task(**numbers, **places))


def polynomials_of(curve: Curve) -> tuple[np.ndarray, np.ndarray]:
    """Return times (pieces + 1,) s and coefficients (pieces, channels, powers) of a plan's torques,
    quaternion, tail coordinates and their rates, by powers of the time since the piece's begin.
    """

    def sampled(k: np.ndarray, s: np.ndarray) -> np.ndarray:
        blocks = curve.inside(k, s)
        return np.concatenate([blocks[name] for name in BLOCKS], axis=1)

    return curve.ends, fitted(curve, sampled)


def _steps(time: float, step: float) -> int:
    """Return the number of steps of at most this length (s) in a time (s)."""
    return int(np.ceil(time / step - 1e-9))


def _limits(bound: np.ndarray | None, most: np.ndarray) -> np.ndarray:
    return np.full_like(most, NONE) if bound is None else bound


def _goal(problem: PlanningProblem, size: int) -> dict[str, np.ndarray]:
    """Return the goal's numbers; free ones are 0 with a weight of 0."""
    goal = problem.goal
    parts = (
        (goal.tail, size, ANGLE),
        (goal.tail_rate, size, RATE),
        (goal.torso_rate, 3, TURN_RATE),
    )
    values = np.concatenate(
        [np.full(count, np.nan) if part is None else middle(part) for part, count, _ in parts]
    )
    units = np.repeat([unit for *_, unit in parts], [count for _, count, _ in parts])
    given = np.isfinite(values)
    return {
        "goal": goal_matrix(goal.attitude),
        "end_state": np.where(given, values, 0.0),
        "end_weight": given / units**2,
    }
