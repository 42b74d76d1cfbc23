"""Flights, which plans are of, of any model: one that may touch the ground flies high above it."""

from dataclasses import replace
from typing import Any

import numpy as np

from serpentail_scene.layout import POSITION, VELOCITY

from ..basics.errors import SimulationError
from ..model.model import Model
from ..model.weight import fall, total_mass
from ..motion.trajectory import Trajectory
from ..simulation.controllers.controller import Controller
from ..simulation.controllers.schedules import Legs
from ..simulation.methods import MIN_ROUNDINGS
from ..simulation.simulate import end_state, simulate

State = tuple[np.ndarray, np.ndarray]  # q, v
UP = POSITION.start + 2
RTOL = 1e-10  # of the true end of a plan, where rounding errors allow it


def flight(
    model: Model, start: State, controller: Controller, duration: float, **settings: Any
) -> Trajectory:
    """Return the motion from (q0, v0) over a duration (s), without the ground.

    settings: of ``simulate``.  Raises its errors.
    """
    lift, raised = _lift(model, start, duration), start[0]
    if lift:
        raised, settings = _moved(raised, lift), _without_ground(model) | settings
    settings |= {"controller": controller, "t_span": duration}
    try:
        motion = simulate(model, raised, start[1], **settings)
    except SimulationError as error:
        if error.trajectory is not None:
            error.trajectory = _lowered(model, error.trajectory, lift)
        raise
    assert isinstance(motion, Trajectory)  # one start, one motion
    return _lowered(model, motion, lift)


def end_of_flight(model: Model, start: State, controller: Controller, duration: float) -> State:
    """Return q (nq,), v (nv,) at the end of a flight by Tsit5."""
    rtol = max(RTOL, MIN_ROUNDINGS * np.finfo(model.parameter_vector.dtype).eps)
    if not model.contacts:
        return end_state(model, *start, controller=controller, duration=duration, rtol=rtol)
    motion = flight(model, start, controller, duration, rtol=rtol, output_step=duration)
    return motion.q[-1], motion.v[-1]


def _without_ground(model: Model) -> dict[str, Any]:
    """Settings of runs that never touch it: legs without mass have no part in a flight."""
    legs = {"legs": Legs.fixed(0.0, 0.0)} if "feet" in model.contacts else {}
    return {"method": "tsit5"} | legs


def _lift(model: Model, start: State, duration: float) -> float:
    """Return how much higher (m) a model may start so that it cannot touch the ground."""
    if not model.contacts:
        return 0.0
    p, speed = model.parameters, float(np.abs(start[1][VELOCITY]).max())
    fallen = float(np.linalg.norm(fall(p))) * duration**2
    size = 10 * (p["tail_length"] + float(np.abs(p["tail_mount"]).max()))
    return size + speed * duration + fallen + float(np.abs(start[0][UP]))


def _moved(q: np.ndarray, lift: float) -> np.ndarray:
    """q with B higher by a lift (m)."""
    return q + lift * np.eye(len(q))[UP]


def _lowered(model: Model, motion: Trajectory, lift: float) -> Trajectory:
    """Return a motion lower by a lift (m), as one that has no ground."""
    if lift == 0:
        return motion
    weight = -total_mass(model.parameters) * fall(model.parameters)[2]
    q = motion.q - lift * np.eye(motion.q.shape[1])[UP]
    return replace(motion, q=q, potential=motion.potential - weight * lift, contact=None)
