"""A problem on a mesh as the C of the stages takes it: ``Task`` of native/stage.h."""

import ctypes
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..nlp.direct import goal_matrix
from ..nlp.node import PARAMETERS, UNIT_OF_BOUND
from ..problem import PlanningProblem
from .node import NodeCode
from .stages import Stages

EFFORT, ENERGY = 0, 1  # costs of a node
# What squares of the goal's rows cost, by guess: a soft goal is found from afar with fewer steps, a
# stiff one is met more exactly.
GIVES = {"far": 1e5, "close": 1e8}
_pointer = ctypes.c_void_p


class StageTask(ctypes.Structure):
    """The fields of native/stage.h, in its order."""

    _fields_ = (
        *((name, ctypes.c_int) for name in ("stages", "intervals", "nodes", "tail")),
        ("coefficients", ctypes.c_int),
        ("first", _pointer),
        *((name, _pointer) for name in ("widths", "basis", "states", "weights")),
        *((name, _pointer) for name in ("rates", "slopes", "curvature", "parameters")),
        ("work", ctypes.c_int),
        ("momentum", _pointer),
        ("damping", ctypes.c_double),
        *((name, _pointer) for name in ("state_unit", "torque_unit", "turn_unit")),
        ("cost", ctypes.c_int),
        *((name, ctypes.c_double) for name in ("smoothing", "softening", "cost_unit", "price")),
        ("start", _pointer),
        *((name, ctypes.c_double) for name in ("shortest", "longest")),
        *((name, _pointer) for name in ("most_torque", "most_angle", "most_rate")),
        ("give", ctypes.c_double),
        ("goal_rows", ctypes.c_int),
        *((name, _pointer) for name in ("goal", "end_state", "end_turn")),
    )


@dataclass(frozen=True, eq=False)
class OwnedTask:
    """A task, and what it points to."""

    task: StageTask
    arrays: dict[str, np.ndarray]
    node: NodeCode


def task_of(
    stages: Stages, start: np.ndarray, p: np.ndarray, scale: float, guess: str = "close"
) -> OwnedTask:
    """Return the task of stages from a start (nx,), in units; p: parameters, as of ``nlp.node``;
    scale: of the objective; guess: "far" or "close".
    """
    problem, node, torque_unit = stages.problem, stages.node, stages.variables.units["torque"]
    arrays = _arrays(stages) | _goal(stages) | _bounds(stages)
    arrays |= {"start": start, "momentum": p[:3]}
    arrays = {name: np.ascontiguousarray(array) for name, array in arrays.items()}
    task = StageTask(
        stages=stages.cut.stages,
        intervals=stages.mesh.intervals,
        nodes=len(stages.rule.nodes),
        tail=len(torque_unit),
        coefficients=stages.cut.basis.shape[2],
        work=node.work,
        damping=problem.damping,
        smoothing=problem.smoothing,
        shortest=problem.duration[0],
        longest=problem.duration[1],
        give=GIVES[guess] * scale,
        goal_rows=len(arrays["goal"]),
        **_cost(problem, torque_unit, p[PARAMETERS - 1], scale),
        **{name: ctypes.cast(function, _pointer) for name, function in node.functions.items()},
        **{name: array.ctypes.data for name, array in arrays.items()},
    )
    return OwnedTask(task, arrays, node)


def _arrays(stages: Stages) -> dict[str, np.ndarray]:
    """The mesh, the rule and the units."""
    variables, units = stages.variables, stages.variables.units
    return {
        "first": stages.cut.first.astype(np.intc),
        "widths": stages.mesh.widths,
        "basis": stages.cut.basis,
        "states": stages.rule.states,
        "weights": stages.rule.weights,
        "parameters": stages.node.parameters,
        "state_unit": variables.scale(variables.states),
        "torque_unit": units["torque"],
        "turn_unit": units["torso_rate"],
    }


def _goal(stages: Stages) -> dict[str, np.ndarray]:
    """What holds at the end: nan is free."""
    goal, units = stages.problem.goal, stages.variables.units
    blocks = {
        name: np.full(len(units[name]), np.nan) if value is None else value / units[name]
        for name, value in (
            ("attitude", None),  # has rows of its own
            ("tail", goal.tail),
            ("tail_rate", goal.tail_rate),
            ("torso_rate", goal.torso_rate),
        )
    }
    return {
        "goal": goal_matrix(goal.attitude, stages.attitude),
        "end_state": np.concatenate([blocks[name] for name, _ in stages.variables.states]),
        "end_turn": blocks["torso_rate"],
    }


def _bounds(stages: Stages) -> dict[str, np.ndarray]:
    """Return the largest allowed magnitudes."""
    bounds, units = stages.problem.bounds, stages.variables.units
    limits = {
        "most_torque": (bounds.torque, "torque"),
        "most_angle": (bounds.angle, "tail"),
        "most_rate": (bounds.rate, "tail_rate"),
    }
    return {name: most / units[of] for name, (most, of) in limits.items() if most is not None}


def _cost(
    problem: PlanningProblem, torque_unit: np.ndarray, softening: float, scale: float
) -> dict[str, Any]:
    """Return the objective of ``nlp.node.cost``, scaled."""
    unit = float(torque_unit.mean())
    if problem.objective == "energy":
        size, price = unit * 10, 0.0
    elif problem.objective == "time":
        size, price = unit**2 * len(torque_unit) / (softening * UNIT_OF_BOUND**2), 1.0
    else:
        size, price = unit**2, 0.0
    kind = ENERGY if problem.objective == "energy" else EFFORT
    return {
        "cost": kind,
        "softening": softening,
        "cost_unit": size / scale,
        "price": price * scale,
    }
