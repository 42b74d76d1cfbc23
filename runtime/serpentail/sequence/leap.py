"""``Leap``: a sequence whose legs were optimised, its motion, and what it keeps and reaches."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..basics.errors import PlanningError, SimulationError
from ..basics.near_names import NearNames
from ..basics.short_repr import brief
from ..model.weight import weight_of
from ..motion.landing import Landing
from ..motion.numbers import com_rise
from .flight import landing_time, tracker
from .phase import Phase
from .run import SequenceRun
from .search import leg_rate, tilt
from .sequence import PhaseStart, Sequence, timed
from .wanted import UNITS, Wanted

LOWER = (0.002, 0.005)  # m, of the ground at the landing
HEAVIER = (0.9, 1.1)  # of all masses
SLIPPERY = (0.5, 1.0)  # mu


@dataclass(frozen=True, eq=False)
class Leap(NearNames):
    """A leap that ``optimise`` found.

    Attributes
    ----------
    sequence : Sequence
        Its phases, whose moves have the numbers that were found.
    run : SequenceRun
        Its motion, by ``Sequence.simulate``.
    report : dict
        ``measures`` of the motion: push and landing (largest forces, body weights), spin (angular
        momentum at the take-off, kg m^2/s), tilt (largest angle from upright, rad), leg_rate
        (rad/s), rise (m), standing and planned (bool); ``repeats``: the same measures by what was
        changed; ``seconds``: how long it took.
    doubts : tuple of str
        Limits and goals that are not met: of the leap, and of its repeats.
    """

    sequence: Sequence
    run: SequenceRun
    report: dict[str, Any]
    doubts: tuple[str, ...]
    __repr__ = brief

    @property
    def success(self) -> bool:
        """Whether the leap itself meets all; its repeats may fail."""
        repeats = self.report.get("repeats", {})
        return not [doubt for doubt in self.doubts if doubt.partition(": ")[0] not in repeats]


def measures_of(sequence: Sequence, run: SequenceRun) -> dict[str, Any]:
    """Return the measures of a whole motion, as in ``Leap.report``."""
    model, motion = sequence.model, run.trajectory
    landing = Landing(model, motion)
    spin = landing.angular_momentum(0)
    weights = [phase.peak / weight_of(model.parameters) for phase in run.phases]
    return {
        "push": float(weights[0]),
        "landing": float(weights[-1]),
        "spin": 0.0 if spin is None else float(np.linalg.norm(spin)),
        "tilt": float(tilt(motion).max()),
        "leg_rate": leg_rate(sequence, (sequence.gamma, sequence.delta), sequence.phases, motion),
        "rise": com_rise(model, motion) or 0.0,
        "standing": bool(run.complete and landing.landed()),
        "planned": all(phase.plan is None or phase.plan.success for phase in run.phases),
    }


def missed(wanted: Wanted, measures: dict[str, Any], where: str = "") -> Iterator[str]:
    """Yield in words which limits and goals a motion misses; where: before each."""
    if not measures:
        yield f"{where}it cannot be simulated"
        return
    if not measures["planned"]:
        yield f"{where}flight: no plan is true"
    if wanted.standing and not measures["standing"]:
        yield f"{where}standing: it does not stand at the end"
    for name, share in wanted.shares(measures).items():
        if share > 1:
            unit, how = UNITS.get(name, "m") or "body weights", "less" if name == "rise" else "more"
            limit = wanted.limits[name]
            yield f"{where}{name}: {measures[name]:.3g} {unit}, {how} than {limit:.3g}"


def repeats(leap: Leap, start: PhaseStart) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield the measures of a leap with the same plan on lower ground, and from the start with
    other masses and friction: none where it fails.
    """
    sequence, run = leap.sequence, leap.run
    model, (push, _, land) = sequence.model, sequence.phases
    held = _tracked(sequence, run)
    lower = replace(sequence, phases=(held, land))
    if sequence.gamma is not None:
        gamma, delta = sequence.last_angles(push, ())
        lower = replace(lower, gamma=gamma, delta=delta)
    for drop in LOWER:
        here = state_at(run, run.phases[1].begin)
        here.q[2] += drop
        yield f"ground {1e3 * drop:g} mm lower", _measured(lower, here)
    names = [parameter["name"] for parameter in model.manifest["parameters"]]
    masses: dict[str, Any] = {
        n: np.array(model.parameters[n]) for n in names if n.endswith(("mass", "masses"))
    }
    others = {f"masses times {k:g}": {n: k * x for n, x in masses.items()} for k in HEAVIER}
    others |= {f"mu {mu:g}": {"mu": mu} for mu in SLIPPERY}
    for what, changes in others.items():
        other = replace(sequence, model=model.with_parameters(**changes), phases=(push, held, land))
        yield what, _measured(other, start)


def _tracked(sequence: Sequence, run: SequenceRun) -> Phase:
    """Return the flight with the plan that was found, in place of the search for one."""
    model, (push, flight, _) = sequence.model, sequence.phases
    plan, here = run.phases[1].plan, state_at(run, run.phases[1].begin)
    assert plan is not None
    angles = sequence.last_angles(flight, push.moves)
    landing = landing_time(model, (here.q, here.v), plan.problem.goal, angles)
    moves = [timed(move, 0.0, landing, False) for move in flight.moves]
    acts = tracker(model, flight, plan) if plan.success else flight.controller
    return replace(flight, plan=None, controller=acts, moves=moves)


def state_at(run: SequenceRun, time: float) -> PhaseStart:
    """Return the state of a motion at a time (s) at which a phase begins."""
    motion = run.trajectory
    k = int(np.abs(motion.t - time).argmin())
    assert motion.contact is not None
    return PhaseStart(time, motion.q[k].copy(), motion.v[k].copy(), motion.contact.bristles[k])


def _measured(sequence: Sequence, start: PhaseStart) -> dict[str, Any]:
    """Return the measures of a sequence without plans; none if it fails."""
    try:
        run = sequence.simulate(start.q, start.v, start.bristles)
    except (SimulationError, PlanningError):
        return {}
    found = measures_of(sequence, run)
    if len(sequence.phases) < 3:  # that begins in flight
        for name in ("push", "spin", "rise", "leg_rate"):
            del found[name]
    return found
