"""The numbers of a push or a landing that a search changes: of moves of legs without mass, or of
the torques of limbs.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple, cast

import numpy as np

from ..basics.checks import refusal
from ..basics.errors import PlanningError, SimulationError
from ..model.chains import limbs_of
from ..model.model import Model
from ..planning.goal import Bounds
from ..planning.magnitudes import checked_bounds
from ..simulation.controllers.controller import TorqueCurve, TorqueTable
from ..simulation.controllers.piecewise import Piecewise
from .phase import BEFORE, Phase
from .sequence import Sequence

ANGLE = 0.9  # rad, that an angle may move to each side of the first guess
LONGER = 2.0  # times, that a duration may become longer or shorter
WEAKEST = 0.05  # of the largest torque: the least that a search tries
FINE = np.linspace(0, 1, 33)  # shares of a piece of a curve, for its largest value


class SearchedNumber(NamedTuple):
    """A number of phase k: its first guess, the least and the most that is tried (rad, s or N m),
    and what gives a phase another one.
    """

    k: int
    guess: float
    least: float
    most: float
    put: Callable[[Phase, float], Phase]


def unknowns_of(leap: Sequence, k: int, strongest: np.ndarray) -> list[SearchedNumber]:
    """Return the unknowns of phase k. Of legs without mass: the angles of all moves, and durations
    of moves on the ground. Of limbs: the largest torque of each joint that its curve drives, and
    the durations between its times. strongest (nt,): largest torques (N m).

    SimulationError about moves that have a rate in place of a duration.
    """
    phase = leap.phases[k]
    if leap.gamma is not None:
        return _of_moves(phase, k)
    if phase.plan or not isinstance(phase.controller, TorqueCurve):
        return []
    found, curve = [], curve_of(phase)
    for own in joints_of(leap.model).values():
        if level := _largest(curve, own):
            most = float(strongest[own].min())
            found.append(SearchedNumber(k, level, WEAKEST * most, most, partial(_with_level, own)))
    for j, x in enumerate(np.diff(curve.times).tolist() if found else ()):
        found.append(SearchedNumber(k, x, x / LONGER, x * LONGER, partial(_with_width, j)))
    return found


def with_numbers(leap: Sequence, unknowns: list[SearchedNumber], x: np.ndarray) -> Sequence:
    """Return a leap whose phases have the numbers x."""
    phases = [*leap.phases]
    for unknown, value in zip(unknowns, x.tolist(), strict=True):
        phases[unknown.k] = unknown.put(phases[unknown.k], value)
    return replace(leap, phases=tuple(phases))


def joints_of(model: Model) -> dict[str, list[int]]:
    """Return the places in tau of each driven joint of the limbs that touch the ground; those of a
    pair are one joint, so that a motion stays in its plane.
    """
    found: dict[str, list[int]] = {}
    for chain in model.layout.chains:
        if chain.name in limbs_of(model) and chain.name in model.contacts:
            places = range(chain.tau.start, chain.tau.stop)
            for name, place, driven in zip(chain.names, places, chain.driven, strict=True):
                if driven:
                    found.setdefault(name.replace(chain.name, chain.owner, 1), []).append(place)
    return found


def curve_of(phase: Phase) -> Piecewise:
    """Return the torques of a phase that has a TorqueCurve."""
    return cast(TorqueCurve, phase.controller).torques


def strongest_of(leap: Sequence, given: Any) -> np.ndarray:
    """Return the largest torques (nt,), N m, from limits.torque, or those of the first guess."""
    model = leap.model
    if given is None:
        found = np.zeros(model.layout.nt)
        for own in joints_of(model).values() if leap.gamma is None else ():
            found[own] = max(_largest(curve_of(leap.phases[k]), own) for k in (0, 2))
        return found
    if not joints_of(model) or leap.gamma is not None:
        remedy = "it has no driven limbs that touch the ground: leave it out"
        raise SimulationError(f"limits.torque: value {given}: of {model.name}: {remedy}")
    try:
        return np.asarray(checked_bounds(model, Bounds(torque=given)).torque)
    except PlanningError as error:
        raise SimulationError(f"{error}".replace("bounds.torque", "limits.torque")) from error


def with_curve(model: Model, phase: Phase) -> Phase:
    """Return a phase whose table of torques is a curve; SimulationError if it damps limbs."""
    law = phase.controller
    if not isinstance(law, TorqueTable | TorqueCurve):
        return phase
    parts = law.parts(model.layout.nt)
    assert parts.damping is not None and parts.torques is not None
    for name, own in joints_of(model).items():
        if parts.damping[own].any():
            field = f"phase {phase.name!r}: controller.damping: of {name}"
            needs = "0, or torques exceed their limits: give the model damping"
            raise refusal(field, float(parts.damping[own].max()), needs, SimulationError)
    return replace(phase, controller=TorqueCurve(parts.torques, law.damping))


def _of_moves(phase: Phase, k: int) -> list[SearchedNumber]:
    found = []
    for j, move in enumerate(phase.moves):
        if "rate" in move:
            field = f"phase {phase.name!r}: moves[{j}].rate"
            remedy = "optimise changes durations: give duration, and limits.leg_rate"
            raise SimulationError(f"{field}: value {move['rate']}: {remedy}")
        keys = ("gamma", "delta") if BEFORE in move else ("gamma", "delta", "duration")
        for key in [key for key in keys if key in move]:
            x = float(move[key])
            ends = (x / LONGER, x * LONGER) if key == "duration" else (x - ANGLE, x + ANGLE)
            found.append(SearchedNumber(k, x, *ends, partial(_with_move, j, key)))
    return found


def _with_move(j: int, key: str, phase: Phase, value: float) -> Phase:
    moves = [{**move} for move in phase.moves]
    moves[j][key] = value
    return replace(phase, moves=moves)


def _with_level(own: list[int], phase: Phase, value: float) -> Phase:
    """Return a phase with another largest torque (N m) of a joint."""
    curve = curve_of(phase)
    coefficients = curve.coefficients.copy()
    coefficients[:, own] *= value / _largest(curve, own)
    return _driven(phase, curve.times, coefficients)


def _with_width(j: int, phase: Phase, value: float) -> Phase:
    """Return a phase with another duration (s) of a piece of its curve."""
    curve = curve_of(phase)
    widths, coefficients = np.diff(curve.times), curve.coefficients.copy()
    coefficients[j] *= (widths[j] / value) ** np.arange(coefficients.shape[-1])
    widths[j] = value
    return _driven(phase, curve.times[0] + np.r_[0, widths.cumsum()], coefficients)


def _driven(phase: Phase, times: np.ndarray, coefficients: np.ndarray) -> Phase:
    law = TorqueCurve(Piecewise(times, coefficients), cast(TorqueCurve, phase.controller).damping)
    return replace(phase, controller=law)


def _largest(curve: Piecewise, own: list[int]) -> float:
    """Return the largest magnitude (N m) of some channels of a curve."""
    x = FINE[:, None] * np.diff(curve.times)
    powers = x[..., None, None] ** np.arange(curve.coefficients.shape[-1])
    return float(np.abs((curve.coefficients[:, own] * powers).sum(axis=-1)).max())
