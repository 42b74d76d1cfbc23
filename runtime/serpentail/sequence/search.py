"""Searches for the numbers of a push and of a landing: a run for each try, and its cost.

Differential evolution, not gradients: with three to five numbers and runs of some milliseconds it
finds landings of 18 body weights where SQP from the same start ends at 47 and least squares at 32,
because the force of a landing is full of small optima.
"""

import time
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.optimize import Bounds, OptimizeResult, differential_evolution

from serpentail_scene.layout import QUATERNION, TAIL_Q

from ..basics.attitude import tilt_deg
from ..basics.errors import SimulationError
from ..basics.progress import Stage
from ..model.chains import limbs_of
from ..model.passive import behind_stops
from ..model.weight import fall, weight_of
from ..motion.ground import peaks
from ..motion.landing import carried
from ..motion.trajectory import Trajectory
from ..planning.problem import checked_goal
from ..planning.result.full_state import com_at_start
from ..simulation.controllers.pfl import Pfl
from ..simulation.controllers.piecewise import FASTEST
from ..simulation.controllers.schedules import Legs, Reference
from ..simulation.simulate import simulate
from .flight import landing_time, points_of
from .phase import Phase
from .sequence import PhaseStart, Sequence, clear_of_ground
from .unknowns import SearchedNumber, curve_of, with_numbers
from .wanted import Wanted

PEOPLE, ROUNDS = 8, 25  # tries of a round for each number; most rounds
AFTER = 0.03  # s that a push is followed after its last move, or the end of its torques
LANDING = 1.0  # s that a landing is followed
SWINGS = 0.1  # s in which the tail goes to its goal
ABOVE = 1e-4  # m, of the feet where a landing begins
FAILED = 1e3  # cost of a run that fails
SAMPLES = 100
AllPhases = list[Phase] | tuple[Phase, ...]
Moves = Iterable[Mapping[str, Any]]
Measured = Callable[[Sequence], dict[str, float]]  # of a sequence
RTOL = 1e-4  # of the searches; the leap itself has the sequence's own


def leg_rate(sequence: Sequence, angles: Any, phases: AllPhases, motion: Trajectory) -> float:
    """Return the largest rate (rad/s) of the legs: of limbs in a motion, of legs without mass in
    all moves of phases, from their first angles on.
    """
    if sequence.gamma is None:
        own = [sequence.model.layout[name].v for name in limbs_of(sequence.model)]
        return max(float(np.abs(motion.v[:, each]).max(initial=0)) for each in own)
    (gamma, delta), fastest = angles, 0.0
    for move in (move for phase in phases for move in phase.moves):
        before, gamma, delta = (gamma, delta), move.get("gamma", gamma), move.get("delta", delta)
        way = max(abs(gamma - before[0]), abs(delta - before[1]))
        fastest = max(fastest, FASTEST[move.get("shape", "linear")] * way / move["duration"])
    return float(fastest)


def searched(
    sequence: Sequence,
    unknowns: list[SearchedNumber],
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

    def changed(x: np.ndarray) -> Sequence:
        return with_numbers(sequence, unknowns, x)

    def cost(x: np.ndarray) -> float:
        try:
            return wanted.cost(measured(changed(x)))
        except SimulationError:
            return FAILED

    def stop(intermediate_result: OptimizeResult) -> bool:
        stage.tell()
        return intermediate_result.fun <= enough or time.monotonic() > end

    guess, least, most = np.array([(each.guess, each.least, each.most) for each in unknowns]).T
    guess = guess.clip(least, most)
    with Stage("optimise", sequence.phases[unknowns[-1].k].name) as stage:
        settings: dict[str, Any] = {"popsize": PEOPLE, "maxiter": ROUNDS, "polish": False}
        settings |= {"x0": guess, "seed": seed, "callback": stop}
        return changed(differential_evolution(cost, Bounds(least, most), **settings).x)


def push_measures(sequence: Sequence, start: PhaseStart, aim: Any) -> dict[str, float]:
    """Return push (body weights), rise (m), spin (kg m^2/s), leg_rate (rad/s) of a push; of the
    flight after it, whose tail and limbs only go to the plan's goal, tilt (rad), and miss: how far
    (rad) the torso then is from the attitude aim.
    """
    model, (push, flight, _) = sequence.model, sequence.phases
    first = sequence.gamma, sequence.delta
    ends = [move["at"] + move["duration"] for move in push.moves] or curve_of(push).times
    pushed = _run(sequence, push, start, (first, push.moves), float(max(ends)) + AFTER)
    assert pushed.contact is not None
    at = -1
    if sequence.gamma is None:  # whose torques act until it is clear
        clear = clear_of_ground(pushed, push.clearance)
        at = 0 if clear is None else int(np.searchsorted(pushed.t, clear))
    if at == 0 or pushed.contact.forces[at, :, 2].max() > 0:
        raise SimulationError("push: still on the ground")

    # the flight, to the landing
    goal = checked_goal(flight.plan[0].get("goal"), model.layout)
    q, v = pushed.q[at], pushed.v[at]
    if behind := behind_stops(model, q[None, TAIL_Q]):  # no plan begins there
        raise SimulationError(f"push: {behind}")
    down = fall(model.parameters)
    height, speed = (-(part @ down) for part in com_at_start(model, (q, v)))
    height += com_at_start(model, (start.q, start.v))[0] @ down
    tails = [q[TAIL_Q], 0 * q[TAIL_Q] if goal.tail is None else np.nan_to_num(goal.tail)]
    follows = replace(flight, controller=Pfl(model, Reference([0.0, SWINGS], tails)))
    angles = sequence.last_angles(flight, push.moves)
    end = landing_time(model, (q, v), goal, angles)
    flown = _run(sequence, follows, PhaseStart(0.0, q, v, None), (angles, ()), end)
    tilts, miss = tilt(flown), 0.0
    if isinstance(aim, str):
        miss = float(tilts[-1])
    elif aim is not None:
        miss = 2 * float(np.arccos(min(1.0, abs(flown.q[-1, QUATERNION] @ aim))))
    return {
        "push": float(peaks(pushed)["all"].force / weight_of(model.parameters)),
        "rise": float((height + speed * abs(speed) / (2 * down @ down)) / np.linalg.norm(down)),
        "spin": float(np.linalg.norm(model.momentum(q, v)[1])),
        "leg_rate": leg_rate(sequence, first, (push,), pushed),
        "tilt": float(tilts.max()),
        "miss": miss,
    }


def landing_measures(sequence: Sequence, touch: PhaseStart) -> dict[str, float]:
    """Return the measures of a landing from a state near the touch-down: landing (body weights),
    tilt (rad), leg_rate (rad/s); lean (deg) and the share of the weight on the feet at the end.
    """
    model, (push, flight, phase) = sequence.model, sequence.phases
    angles = sequence.last_angles(flight, push.moves)
    q = touch.q.copy()
    q[2] += ABOVE - points_of(model, (q, touch.v), angles)[:, 2].min()
    motion = _run(sequence, phase, replace(touch, q=q), (angles, phase.moves), LANDING)
    tilts, weight, forces = tilt(motion), weight_of(model.parameters), carried(model, motion)
    assert forces is not None
    return {
        "landing": float(peaks(motion)["all"].force / weight),
        "tilt": float(tilts.max()),
        "leg_rate": leg_rate(sequence, angles, (phase,), motion),
        "lean": float(np.degrees(tilts[-1])),
        "carried": float(forces[-SAMPLES // 4 :].mean() / weight),
    }


def tilt(motion: Trajectory) -> np.ndarray:
    """Return the angle (rad) of the torso's z axis from the vertical in each sample."""
    return np.radians(tilt_deg(motion.attitude))


def _run(
    sequence: Sequence, phase: Phase, start: PhaseStart, legs: tuple[Any, Moves], end: float
) -> Trajectory:
    """Return the motion of a phase from a start at 0, to a time (s); legs: angles, and moves."""
    (gamma, delta), moves = legs
    settings: dict[str, Any] = {**sequence.settings, "rtol": RTOL, "output_step": end / SAMPLES}
    settings |= {"controller": phase.controller, "bristles0": start.bristles}
    if sequence.gamma is not None:
        settings["legs"] = Legs.moves(gamma, delta, moves)
    motion = simulate(sequence.model, start.q, start.v, end, **settings)
    assert isinstance(motion, Trajectory)  # of one start
    return motion
