"""``optimise``: a leap whose legs push and land so that limits are kept and goals are met."""

import time
from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from math import pi, radians
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from serpentail_scene.layout import POSITION

from ..basics.checks import number, refusal
from ..basics.errors import SimulationError
from ..model.chains import limbs_of, refuse_given
from ..model.state import State, parted
from ..planning.problem import checked_goal
from ..simulation.controllers.moves import TOUCH_DOWN
from .leap import Leap, measures_of, missed, repeats, state_at
from .phase import AIRBORNE, BEFORE, LANDING
from .run import SequenceRun
from .search import landing_measures, push_measures, searched, tilt
from .sequence import PhaseStart, Sequence
from .unknowns import joints_of, strongest_of, unknowns_of, with_curve
from .wanted import ENOUGH, Wanted, wanted_of

LIMITS = MappingProxyType({"push": 25.0, "landing": 25.0, "tilt": radians(60)})
GOAL: Mapping[str, Any] = MappingProxyType({"standing": True})
SHARE, TURNS = 1 / 3, 5  # of the time, for one search; searches of push or landing
PUSHED = ("push", "rise", "spin")  # what the push alone decides
LESS = 0.6  # of the spin and tilt of a jump for whose flight no plan is true
GRID = 25  # angles of a leg, for its reach


def optimise(
    leap: Sequence,
    q0: ArrayLike | State,
    v0: ArrayLike | None = None,
    bristles0: ArrayLike | None = None,
    *,
    limits: Mapping[str, Any] = LIMITS,
    goal: Mapping[str, Any] = GOAL,
    best: str | None = None,
    time_limit: float = 60.0,
) -> Leap:
    """Find moves or torques of the legs for a jump that is made for its landing.

    The sequence's own are the first guess. Legs without mass: the angles (within 0.9 rad) and
    durations (half to twice) of the push and of the landing, and the angles before the landing.
    Limbs: the largest torque of each joint, of a pair the same, and the durations between the times
    of the curves of push and landing. They are searched for by differential evolution, with a run
    for each try. The flight is planned as ever. A slow first move, a crouch, turns a push into the
    cone of friction: on slippery ground it needs one.

    Parameters
    ----------
    leap : Sequence
        A push (until "airborne"), a planned flight (until "landing"), and a landing with one move
        at "touch_down"; the last move of the flight stretches the legs, ``before_landing``. Of a
        model without "feet" but with driven limbs: push and landing have no moves, and as
        controller a TorqueTable or TorqueCurve without damping of the limbs.
    q0, v0, bristles0
        The start, as of ``Sequence.simulate``.
    limits : mapping
        Largest values: push and landing (force of the ground, body weights), spin (angular
        momentum at the take-off, kg m^2/s), tilt (of the torso from upright at any time, rad),
        leg_rate (rad/s); torque of limbs in push and landing (N m; a number, or a mapping by names
        of chains and joints as of ``Bounds``). In flight the plan's own bounds hold. Default: 25
        body weights each, 60 degrees, and the largest torques of the first guess.
    goal : mapping
        ``rise``: least rise of the centre of mass (m); ``standing``: whether it stands at the end.
    best : {"rise", "softness", "spin"}, optional
        What becomes best within the limits: the highest jump, the smallest forces or the least
        spin. It takes longer. Default: the first leap that keeps 90 % of all limits.
    time_limit : float, default 60
        Time (s) after which no search or plan begins.

    Returns
    -------
    Leap
        The sequence, its motion, a report, and doubts: what is missed, also on ground 2 and 5 mm
        lower, with masses 10 % off, and with mu 0.5 and 1, all with the same plan.

    Raises
    ------
    SimulationError
        An argument is wrong, or the legs are too short: a rise over a stroke s takes at least
        1 + rise / s body weights.
    ModelError
        Joints are prescribed.
    PlanningError, StateError, ExtraMissing
        As of ``Sequence.simulate``.

    Examples
    --------
    >>> found = st.optimise(leap, q0, v0, goal={"rise": 0.3})  # doctest: +SKIP
    >>> found.success, found.doubts, found.report["measures"]  # doctest: +SKIP
    """
    begun, wanted = time.monotonic(), wanted_of(limits, goal, best)
    time_limit = number("time_limit", time_limit, SimulationError, unit="s", above=0)
    leap = _checked(leap)
    strongest = strongest_of(leap, limits.get("torque"))
    q, v = (np.asarray(part, float) for part in parted(leap.model, q0, v0)[0])
    start = PhaseStart(0.0, q, v, bristles0)
    _refuse_short_legs(leap, start, wanted)
    leap, aim = _freed(leap)
    push = partial(push_measures, start=start, aim=aim)

    # the push, then the landing from where that comes down; a push again if that is not right
    kept: list[Leap] = []
    flies, asked = False, wanted
    for turn in range(TURNS):
        until = min(time.monotonic() + SHARE * time_limit, begun + time_limit)
        if flies:
            before = kept[-1].run
            touch = replace(state_at(before, before.phases[2].begin), bristles=None)
            lands, enough = partial(landing_measures, touch=touch), -np.inf if best else ENOUGH
            unknowns = [*unknowns_of(leap, 1, strongest)[-2:], *unknowns_of(leap, 2, strongest)]
            leap = searched(leap, unknowns, lands, wanted, until, enough, turn)
        else:
            unknowns = unknowns_of(leap, 0, strongest)
            leap = searched(leap, unknowns, push, asked, until, seed=turn)
        run = leap.simulate(q, v, bristles0)
        measures = measures_of(leap, run)
        kept.append(Leap(leap, run, {"measures": measures}, tuple(missed(wanted, measures))))
        late = time.monotonic() > begun + time_limit
        if late or (kept[-1].success and (best is None or turn > 0)):
            break
        flies = _flies(run, wanted, measures)
        shares = wanted.shares(measures)
        if not flies and all(shares.get(name, 0.0) <= 1 for name in PUSHED):
            less = {k: LESS * asked.limits[k] for k in ("spin", "tilt") if k in asked.limits}
            asked = replace(asked, limits={**asked.limits, **less})

    found = min(reversed(kept), key=lambda each: len(each.doubts))
    again = dict(repeats(found, start)) if len(found.run.phases) == len(leap.phases) else {}
    doubts = (line for name, each in again.items() for line in missed(wanted, each, f"{name}: "))
    report = {**found.report, "repeats": again, "seconds": time.monotonic() - begun}
    return replace(found, report=report, doubts=(*found.doubts, *doubts))


def _freed(leap: Sequence) -> tuple[Sequence, Any]:
    """Return a leap with one plan, the first, whose attitude at the landing is free; and that.

    A jump with hardly any spin has one attitude at the landing for each posture of the tail, and no
    plan can choose another: the push has to.
    """
    push, flight, land = leap.phases
    goal = checked_goal(flight.plan[0].get("goal"), leap.model.layout)
    plan = {**flight.plan[0], "goal": replace(goal, attitude=None)}
    return replace(leap, phases=(push, replace(flight, plan=plan), land)), goal.attitude


def _flies(run: SequenceRun, wanted: Wanted, measures: Mapping[str, Any]) -> bool:
    """Tell whether a push is right: its flight is planned, comes down and never tilts too far."""
    if len(run.phases) < 3 or not measures["planned"]:
        return False
    tilts = tilt(run.trajectory)[run.trajectory.t <= run.phases[2].begin]
    shares = wanted.shares({**measures, "tilt": tilts.max()})
    return all(shares.get(name, 0.0) <= 1 for name in (*PUSHED, "tilt"))


def _checked(leap: Any) -> Sequence:
    """Return a leap whose limbs are driven by curves; SimulationError for what is no push, flight
    and landing.
    """
    if not isinstance(leap, Sequence) or len(leap.phases) != 3:
        raise refusal("leap", leap, "a Sequence of 3 phases", SimulationError)
    push, flight, land = leap.phases
    if leap.gamma is None:
        refuse_given(leap.model, "optimise")
        if not joints_of(leap.model):
            remedy = 'give it "feet", or limbs with drive = "torque" among its contacts'
            raise SimulationError(f"leap: {leap.model.name} has no legs that push: {remedy}")
        push, land = (with_curve(leap.model, phase) for phase in (push, land))
        leap = replace(leap, phases=(push, flight, land))
    numbers = [unknowns_of(leap, k, np.ones(leap.model.layout.nt)) for k in range(3)]
    pushes, lands, stretches = bool(numbers[0]), bool(numbers[2]), True
    first = last = f"a TorqueTable or TorqueCurve of {', '.join(joints_of(leap.model))}"
    if leap.gamma is not None:
        first, last = "moves", f"one move, at {TOUCH_DOWN!r}"
        pushes = bool({move.get("at") for move in push.moves} - {TOUCH_DOWN})
        lands = [move.get("at") for move in land.moves] == [TOUCH_DOWN]
        stretches = {BEFORE, "gamma", "delta"} <= {*[{}, *flight.moves][-1]}
    for phase, is_right, needs in (
        (push, push.until == AIRBORNE and pushes, f"{first}, until = {AIRBORNE!r}"),
        (flight, flight.plan and flight.until == LANDING, f"a plan, until = {LANDING!r}"),
        (flight, stretches, f"a last move with {BEFORE}"),
        (land, lands, last),
    ):
        if not is_right:
            raise SimulationError(f"phase {phase.name!r}: needs {needs}: see docs/sequences.md")
    return leap


def _refuse_short_legs(leap: Sequence, start: PhaseStart, wanted: Wanted) -> None:
    """SimulationError if a rise takes more force than is allowed, whatever the legs do.

    From its height at the start the torso cannot be pushed farther than the legs reach.
    """
    model, rise = leap.model, wanted.limits.get("rise", 0.0)
    if leap.gamma is None:
        p = model.parameters
        owners = {model.layout[name].owner for name in limbs_of(model)}
        reach = max(np.linalg.norm(p[f"{o}_mount"]) + p.get(f"{o}_length", np.inf) for o in owners)
    else:
        angles = np.linspace(-pi, pi, GRID)
        gamma, delta = (each.ravel() for each in np.meshgrid(angles, angles))
        legs = np.stack([gamma, delta, gamma, delta, *np.zeros((4, gamma.size))], axis=1)
        q, v = (np.broadcast_to(part, (gamma.size, len(part))) for part in (start.q, start.v))
        points, _ = model.contact_points(q, v, legs)
        feet = np.asarray(points)[:, : model.contacts["feet"]] - start.q[POSITION]
        reach = np.linalg.norm(feet, axis=-1).max()
    stroke = float(reach - start.q[2])
    least = 1 + rise / max(stroke, 1e-9)
    for name in ("push", "landing"):
        if wanted.limits.get(name, np.inf) < least:
            raise SimulationError(
                f"limits.{name}: value {wanted.limits[name]:g}: a rise of {rise:g} m over a "
                f"stroke of at most {1e3 * stroke:.3g} mm needs at least {least:.3g} body weights"
            )
