"""Searches for the numbers of a push and of a landing: a run for each try, and its cost.

Differential evolution, not gradients: with three to five numbers and runs of some milliseconds it
finds landings of 18 body weights where SQP from the same start ends at 47 and least squares at 32,
because the force of a landing is full of small optima.
"""

import time
from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import Bounds, OptimizeResult, differential_evolution

from serpentail_scene.layout import QUATERNION, TAIL_Q

from ..basics.attitude import tilt_deg
from ..basics.errors import SimulationError
from ..basics.progress import Stage
from ..model.weight import fall, weight_of
from ..motion.ground import peaks
from ..motion.trajectory import Trajectory
from ..planning.problem import checked_goal
from ..planning.result.full_state import com_at_start
from ..simulation.controllers.pfl import Pfl
from ..simulation.controllers.piecewise import FASTEST
from ..simulation.controllers.schedules import Legs, Reference
from ..simulation.simulate import simulate
from .flight import landing_time
from .phase import BEFORE, Phase
from .sequence import PhaseStart, Sequence
from .wanted import Wanted

ANGLE = 0.9  # rad, that an angle may move to each side of the first guess
LONGER = 2.0  # times, that a duration may become longer or shorter
PEOPLE, ROUNDS = 8, 25  # tries of a round for each number; most rounds
AFTER = 0.03  # s that a push is followed after its last move
LANDING = 1.0  # s that a landing is followed
SWINGS = 0.1  # s in which the tail goes to its goal
ABOVE = 1e-4  # m, of the feet where a landing begins
FAILED = 1e3  # cost of a run that fails
SAMPLES = 100
AllPhases = list[Phase] | tuple[Phase, ...]
Measured = Callable[[Sequence], dict[str, float]]  # of a sequence
RTOL = 1e-4  # of the searches; the leap itself has the sequence's own


class MoveNumber(NamedTuple):
    """A number of a move: its phase, move and key, and its first guess (rad or s)."""

    phase: int
    move: int
    key: str
    guess: float


def unknowns_of(phases: AllPhases, k: int) -> list[MoveNumber]:
    """Return the angles of all moves of phase k, and durations of moves on the ground.

    SimulationError about moves that have a rate in place of a duration.
    """
    found = []
    for j, move in enumerate(phases[k].moves):
        if "rate" in move:
            field = f"phase {phases[k].name!r}: moves[{j}].rate"
            remedy = "optimise changes durations: give duration, and limits.leg_rate"
            raise SimulationError(f"{field}: value {move['rate']}: {remedy}")
        keys = ("gamma", "delta") if BEFORE in move else ("gamma", "delta", "duration")
        found += [MoveNumber(k, j, key, float(move[key])) for key in keys if key in move]
    return found


def with_numbers(phases: AllPhases, unknowns: list[MoveNumber], x: np.ndarray) -> tuple[Phase, ...]:
    """Return phases whose moves have the numbers x."""
    moves = [[{**move} for move in phase.moves] for phase in phases]
    for unknown, value in zip(unknowns, x.tolist(), strict=True):
        moves[unknown.phase][unknown.move][unknown.key] = value
    return tuple(replace(phase, moves=each) for phase, each in zip(phases, moves, strict=True))


def leg_rate(angles: Iterable[float], phases: AllPhases) -> float:
    """Return the largest rate (rad/s) of the legs in all moves, from their first angles on."""
    (gamma, delta), fastest = angles, 0.0
    for move in (move for phase in phases for move in phase.moves):
        before, gamma, delta = (gamma, delta), move.get("gamma", gamma), move.get("delta", delta)
        way = max(abs(gamma - before[0]), abs(delta - before[1]))
        fastest = max(fastest, FASTEST[move.get("shape", "linear")] * way / move["duration"])
    return float(fastest)


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

    def changed(x: np.ndarray) -> Sequence:
        return replace(sequence, phases=with_numbers(sequence.phases, unknowns, x))

    def cost(x: np.ndarray) -> float:
        try:
            return wanted.cost(measured(changed(x)))
        except SimulationError:
            return FAILED

    def stop(intermediate_result: OptimizeResult) -> bool:
        stage.tell()
        return intermediate_result.fun <= enough or time.monotonic() > end

    guess = np.array([unknown.guess for unknown in unknowns])
    timed = [unknown.key == "duration" for unknown in unknowns]
    least, most = np.where(timed, [guess / LONGER, guess * LONGER], [guess - ANGLE, guess + ANGLE])
    with Stage("optimise", sequence.phases[unknowns[0].phase].name) as stage:
        settings: dict[str, Any] = {"popsize": PEOPLE, "maxiter": ROUNDS, "polish": False}
        settings |= {"x0": guess, "seed": seed, "callback": stop}
        return changed(differential_evolution(cost, Bounds(least, most), **settings).x)


def push_measures(sequence: Sequence, start: PhaseStart, aim: Any) -> dict[str, float]:
    """Return push (body weights), rise (m), spin (kg m^2/s), leg_rate (rad/s) of a push; of the
    flight after it, whose tail only goes to the plan's goal, tilt (rad), and miss: how far (rad)
    the torso then is from the attitude aim.
    """
    model, (push, flight, _) = sequence.model, sequence.phases
    first = sequence.gamma, sequence.delta
    end = max(move["at"] + move["duration"] for move in push.moves) + AFTER
    pushed = _run(sequence, push, start, Legs.moves(*first, push.moves), end)
    assert pushed.contact is not None
    if pushed.contact.forces[-1, :, 2].max() > 0:
        raise SimulationError("push: still on the ground")

    # the flight, to the landing
    goal = checked_goal(flight.plan[0].get("goal"), model.layout)
    q, v = pushed.q[-1], pushed.v[-1]
    down = fall(model.parameters)
    height, speed = (-(part @ down) for part in com_at_start(model, (q, v)))
    height += com_at_start(model, (start.q, start.v))[0] @ down
    tails = [q[TAIL_Q], 0 * q[TAIL_Q] if goal.tail is None else np.nan_to_num(goal.tail)]
    follows = replace(flight, controller=Pfl(model, Reference([0.0, SWINGS], tails)))
    angles = sequence.last_angles(flight, push.moves)
    end = landing_time(model, (q, v), goal, angles)
    flown = _run(sequence, follows, PhaseStart(0.0, q, v, None), Legs.fixed(*angles), end)
    tilts, miss = tilt(flown), 0.0
    if isinstance(aim, str):
        miss = float(tilts[-1])
    elif aim is not None:
        miss = 2 * float(np.arccos(min(1.0, abs(flown.q[-1, QUATERNION] @ aim))))
    return {
        "push": float(peaks(pushed)["all"].force / weight_of(model.parameters)),
        "rise": float((height + speed * abs(speed) / (2 * down @ down)) / np.linalg.norm(down)),
        "spin": float(np.linalg.norm(model.momentum(q, v)[1])),
        "leg_rate": leg_rate(first, (push,)),
        "tilt": float(tilts.max()),
        "miss": miss,
    }


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
    tilts, weight = tilt(motion), weight_of(model.parameters)
    carried = motion.contact.of("feet").forces[-SAMPLES // 4 :, :, 2].sum(axis=1).mean()
    return {
        "landing": float(peaks(motion)["all"].force / weight),
        "tilt": float(tilts.max()),
        "leg_rate": leg_rate((gamma, delta), (phase,)),
        "lean": float(np.degrees(tilts[-1])),
        "carried": float(carried / weight),
    }


def tilt(motion: Trajectory) -> np.ndarray:
    """Return the angle (rad) of the torso's z axis from the vertical in each sample."""
    return np.radians(tilt_deg(motion.attitude))


def _run(sequence: Sequence, phase: Phase, start: PhaseStart, legs: Legs, end: float) -> Trajectory:
    """Return the motion of a phase from a start at 0, to a time (s)."""
    settings: dict[str, Any] = {**sequence.settings, "rtol": RTOL, "output_step": end / SAMPLES}
    settings |= {"controller": phase.controller, "legs": legs, "bristles0": start.bristles}
    motion = simulate(sequence.model, start.q, start.v, end, **settings)
    assert isinstance(motion, Trajectory)  # of one start
    return motion
