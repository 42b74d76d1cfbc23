"""``SequenceRun``: the motion of a sequence, and the outcome of each phase."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..basics.near_names import NearNames
from ..basics.short_repr import brief
from ..model.model import Model
from ..model.weight import weight_of
from ..motion.derived import AGAIN
from ..motion.ground import peaks
from ..motion.joined import JoinedAgain, joined
from ..motion.landing import Landing
from ..motion.plausibility import borne
from ..motion.trajectory import Trajectory
from ..planning.result.plan import Plan
from .phase import LANDING, Phase

MOST_SPIN = 10.0  # rad/s, of the torso at a touch-down: 11 degrees in 20 ms of landing
MOST_PUSH = 25.0  # body weights: a jump by 0.6 m from a crouch needs some 19


@dataclass(frozen=True, eq=False)
class PhaseRun(NearNames):
    """Outcome of a phase.

    Attributes
    ----------
    name : str
        Name of the phase.
    begin, end : float
        Times on the clock of the whole motion (s).
    ended_by : str
        What ended it, such as "duration", "airborne" or "touch_down of feet".
    plan : Plan or None
        Its plan.
    peak : float
        Largest force of the ground on all points together (N).
    """

    name: str
    begin: float
    end: float
    ended_by: str
    plan: Plan | None = None
    peak: float = 0.0
    __repr__ = brief

    def info(self) -> dict[str, Any]:
        """Return its entry in a trajectory's info."""
        entry = {"name": self.name, "begin": self.begin, "end": self.end, "ended_by": self.ended_by}
        return entry if self.plan is None else entry | {"plan": self.plan.report}


@dataclass(frozen=True, eq=False)
class SequenceRun(NearNames):
    """The motion of a sequence, and the outcome of each phase.

    Attributes
    ----------
    trajectory : Trajectory
        The whole motion; its ``info["phases"]`` has the outcomes too.
    phases : tuple of PhaseRun
        Outcome of each phase that was made: ``name``, ``begin`` and ``end`` (s), ``ended_by``
        and ``plan``.
    complete : bool
        Whether all phases were made.
    """

    trajectory: Trajectory
    phases: tuple[PhaseRun, ...]
    complete: bool
    __repr__ = brief


def whole(parts: list[Trajectory], runs: list[PhaseRun], phases: Sequence[Phase]) -> Trajectory:
    """Return the motion of all phases as one, with their outcomes and warnings in its info."""
    motion = joined(parts)
    warnings = list(motion.info.get("warnings", []))
    for run, phase in zip(runs, phases, strict=False):
        if run.plan is not None and not run.plan.success:
            warnings.append(_without_plan(run, phase, run.plan.report))
        if phase.until is not None and run.ended_by == "duration":
            warnings.append(
                f"phase {run.name!r} ended without {phase.words} within {phase.duration:.6g} s"
            )
    planned = all(run.plan is None or run.plan.success for run in runs)
    for flight, phase in zip(runs[:-1], phases, strict=False):
        if planned and phase.until == LANDING and flight.ended_by != "duration":
            warnings += _fall(motion, flight, runs[-1])
    if motion.contact is not None and motion.model is not None:
        warnings += _rough(motion.model, motion, parts)
    outcomes = {"phases": [run.info() for run in runs], "warnings": warnings}
    motion = replace(motion, info=motion.info | outcomes)
    repeats = [vars(part).get(AGAIN) for part in parts]
    if all(repeats):
        vars(motion)[AGAIN] = JoinedAgain(
            repeats, [run.end for run in runs], (motion.q.shape[1], motion.v.shape[1])
        )
    return motion


def _fall(motion: Trajectory, flight: PhaseRun, last: PhaseRun) -> list[str]:
    """Return the warning of a motion that lands after a flight and then does not stand."""
    assert motion.model is not None
    landing = Landing(motion.model, motion)
    if landing.landed() is not False:
        return []
    return [
        f"phase {last.name!r}, at t = {last.end:.4g} s: after the {flight.ended_by} it does not "
        f"stand, or was on its back: let phase {flight.name!r} end otherwise, or turn less"
    ]


def _rough(model: Model, motion: Trajectory, parts: list[Trajectory]) -> list[str]:
    """Return warnings of a landing whose torso turns fast, and of a push that no blow explains:
    of blows ``Trajectory.warnings`` tells.
    """
    landing, whole = Landing(model, motion), weight_of(model.parameters)
    rate, momentum = landing.torso_rate(1), landing.angular_momentum(1)
    take_off, warnings = landing.flight[0], []
    if rate is not None and momentum is not None and np.linalg.norm(rate) > MOST_SPIN:
        warnings.append(
            f"touch-down at t = {landing.flight[1]:.4g} s: the torso turns at "
            f"{np.linalg.norm(rate):.3g} rad/s, more than {MOST_SPIN:g}, because the jump has an "
            f"angular momentum of {np.linalg.norm(momentum):.3g} kg m^2/s: push with less spin, or "
            "give goal.torso_rate a range"
        )
    found = [peaks(part)["all"] for part in parts]
    pushes = [peak for peak in found if take_off is not None and peak.time <= take_off]
    if pushes and MOST_PUSH * whole < max(pushes).force <= borne(model) * whole:
        force, time = max(pushes)
        warnings.append(
            f"push: the ground's force is {force / whole:.3g} body weights at t = {time:.4g} s, "
            f'more than {MOST_PUSH:g}: let the legs take longer, with shape = "accelerate"'
        )
    return warnings


def _without_plan(run: PhaseRun, phase: Phase, told: dict[str, Any]) -> str:
    """Return the warning of a phase whose plans all fail."""
    off = told["open_loop_goal_error_deg"]
    acts = "the tail is passive" if phase.controller is None else "its controller moves the tail"
    far = "far" if off is None else f"{off:.3g} deg"
    return (
        f"phase {run.name!r}, at t = {run.begin:.4g} s: no true plan ({len(phase.plan)} tried), so "
        f"{acts}; the nearest ends {far} from its goal ({told['status']}); {told['advice']}"
    )


def motion_until(parts: list[Trajectory], last: Trajectory | None) -> Trajectory | None:
    """Return the motion of all finished phases and of a part of one more."""
    motions = parts if last is None else [*parts, last]
    return joined(motions) if motions else None
