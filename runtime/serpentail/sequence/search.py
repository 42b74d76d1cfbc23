"""Searches for the numbers of a push and of a landing: a run for each try, and its cost.

Differential evolution, not gradients: with three to five numbers and runs of some milliseconds it
finds landings of 18 body weights where SQP from the same start ends at 47 and least squares at 32,
because the force of a landing is full of small optima.
"""

import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.optimize import OptimizeResult, differential_evolution

from serpentail_scene.layout import QUATERNION, TAIL_Q

from ..basics.attitude import tilt_deg
from ..basics.errors import SimulationError
from ..basics.progress import Stage
from ..model.model import Model
from ..model.weight import fall, total_mass, weight_of
from ..motion.ground import peaks
from ..motion.trajectory import Trajectory
from ..planning.problem import checked_goal
from ..simulation.controllers.pfl import Pfl
from ..simulation.controllers.schedules import Legs, Reference
from ..simulation.simulate import simulate
from .flight import landing_time
from .phase import Phase
from .sequence import PhaseStart, Sequence
from .unknowns import MoveNumber, leg_rate, with_numbers
from .wanted import Wanted

PEOPLE, ROUNDS = 8, 25  # tries of a round for each number; most rounds
AFTER = 0.03  # s that a push is followed after its last move
LANDING = 1.0  # s that a landing is followed
SWINGS = 0.1  # s in which the tail goes to its goal
ABOVE = 1e-4  # m, of the feet where a landing begins
FAILED = 1e3  # cost of a run that fails
SAMPLES = 100
Measured = Callable[[Sequence], dict[str, float]]  # of a sequence
RTOL = 1e-4  # of the searches; the leap itself has the sequence's own


def searched(
    sequence: Sequence,
    unknowns: list[MoveNumber],
    measured: Measured,
    wanted: Wanted,
    end: float,
    enough: float = -np.inf,
    seed: int = 0,
) -> Sequence:
    """Return the sequence with the best numbers that were found.

    measured: the measures of a sequence; end: time (s, time.monotonic) at which to stop;
    enough: cost at which to stop; seed: of the tries.
    """

    def cost(x: np.ndarray) -> float:
        try:
            changed = replace(sequence, phases=with_numbers(sequence.phases, unknowns, x))
            return wanted.cost(measured(changed))
        except SimulationError:
            return FAILED

    def stop(intermediate_result: OptimizeResult) -> bool:
        stage.tell()
        return intermediate_result.fun <= enough or time.monotonic() > end

    with Stage("optimise", sequence.phases[unknowns[0].phase].name) as stage:
        found = differential_evolution(
            cost,
            [unknown.bounds for unknown in unknowns],
            x0=[unknown.guess for unknown in unknowns],
            popsize=PEOPLE,
            maxiter=ROUNDS,
            seed=seed,
            polish=False,
            callback=stop,
        )
    return replace(sequence, phases=with_numbers(sequence.phases, unknowns, found.x))


def push_measures(sequence: Sequence, start: PhaseStart, aim: Any) -> dict[str, float]:
    """Return push (body weights), rise (m), spin (kg m^2/s), leg_rate (rad/s) of a push; of
    the flight after it what ``_flight_measures`` tells. aim: the attitude of the landing.
    """
    model, phase = sequence.model, sequence.phases[0]
    end = max(move["at"] + move["duration"] for move in phase.moves) + AFTER
    first = sequence.gamma, sequence.delta
    motion = _run(sequence, phase, start, Legs.moves(*first, phase.moves), end)
    assert motion.contact is not None
    if motion.contact.forces[-1, :, 2].max() > 0:
        raise SimulationError("push: still on the ground")

    # after the push the centre of mass is in free fall
    down = fall(model.parameters)
    g, up = np.linalg.norm(down), -down / np.linalg.norm(down)
    ends = [model.center_of_mass(motion.q[k], motion.v[k])[0] for k in (0, -1)]
    momentum, spin = model.momentum(motion.q[-1], motion.v[-1])
    speed = up @ momentum / total_mass(model.parameters)
    return {
        "push": _weights(model, motion),
        "rise": float(up @ (ends[1] - ends[0]) + speed * abs(speed) / (2 * g)),
        "spin": float(np.linalg.norm(spin)),
        "leg_rate": leg_rate(first, [phase]),
    } | _flight_measures(sequence, motion, aim)


def _flight_measures(sequence: Sequence, push: Trajectory, aim: Any) -> dict[str, float]:
    """Return the largest tilt (rad) of a flight whose tail only goes to the plan's goal, and how
    far (rad) the torso then is from an attitude.
    """
    model, (first, flight, _) = sequence.model, sequence.phases
    goal = checked_goal(flight.plan[0].get("goal"), model.layout.nt)
    state, angles = (push.q[-1], push.v[-1]), sequence.last_angles(flight, first.moves)
    tail = state[0][TAIL_Q]
    tails = [tail, 0 * tail if goal.tail is None else np.nan_to_num(goal.tail)]
    follows = replace(flight, controller=Pfl(model, Reference([0.0, SWINGS], tails)))
    start, end = PhaseStart(0.0, *state, None), landing_time(model, state, goal, angles)
    motion = _run(sequence, follows, start, Legs.fixed(*angles), end)
    tilts, attitude = tilt(motion), motion.q[-1, QUATERNION]
    if isinstance(aim, str):
        miss = float(tilts[-1])
    else:
        miss = 0.0 if aim is None else 2 * float(np.arccos(min(1.0, abs(attitude @ aim))))
    return {"tilt": float(tilts.max()), "miss": miss}


def landing_measures(sequence: Sequence, touch: PhaseStart) -> dict[str, float]:
    """Return the measures of a landing from a state near the touch-down: landing (body weights),
    tilt (rad), leg_rate (rad/s); lean (deg) and the share of the weight on the feet at the end.
    """
    model, (push, flight, phase) = sequence.model, sequence.phases
    gamma, delta = sequence.last_angles(flight, push.moves).tolist()
    angles = np.array([gamma, delta, gamma, delta, *np.zeros(4)])
    points, _ = model.contact_points(touch.q, touch.v, angles)
    q = touch.q.copy()
    q[2] += ABOVE - np.asarray(points)[:, 2].min()
    legs = Legs.moves(gamma, delta, phase.moves)
    motion = _run(sequence, phase, replace(touch, q=q), legs, LANDING)
    assert motion.contact is not None
    tilts = tilt(motion)
    carried = motion.contact.of("feet").forces[-SAMPLES // 4 :, :, 2].sum(axis=1).mean()
    return {
        "landing": _weights(model, motion),
        "tilt": float(tilts.max()),
        "leg_rate": leg_rate((gamma, delta), [phase]),
        "lean": float(np.degrees(tilts[-1])),
        "carried": float(carried / weight_of(model.parameters)),
    }


def tilt(motion: Trajectory) -> np.ndarray:
    """Return the angle (rad) of the torso's z axis from the vertical in each sample."""
    return np.radians(tilt_deg(motion.attitude))


def _weights(model: Model, motion: Trajectory) -> float:
    """Return the largest force of the ground, in body weights."""
    return float(peaks(motion)["all"].force / weight_of(model.parameters))


def _run(sequence: Sequence, phase: Phase, start: PhaseStart, legs: Legs, end: float) -> Trajectory:
    """Return the motion of a phase from a start at 0, to a time (s)."""
    settings: dict[str, Any] = {**sequence.settings, "rtol": RTOL, "output_step": end / SAMPLES}
    if start.bristles is not None:
        settings["bristles0"] = start.bristles
    settings |= {"controller": phase.controller, "legs": legs, "t_span": end}
    motion = simulate(sequence.model, start.q, start.v, **settings)
    assert isinstance(motion, Trajectory)  # of one start
    return motion
