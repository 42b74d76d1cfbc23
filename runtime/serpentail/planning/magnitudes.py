"""Duration and bounds of a plan, also with units; those that no flight needs give a warning."""

import warnings
from collections.abc import Mapping
from dataclasses import fields, replace
from typing import Any

import numpy as np

from ..basics.checks import number, numbers, refusal, shown
from ..basics.errors import PlanningError, UnusualSize
from ..basics.plausible_values import warn_of_unusual
from ..model.model import Model
from ..model.weight import fall, total_mass
from .goal import HALF_TURN, LIMIT, MOTOR, Bounds
from .named import numbers_by_name

HUGE = 1e100  # beyond it squares overflow
LONGEST = 5.0  # s: a fall from 120 m
HIGHEST = 1e4  # m: no plan is of a fall from higher up
STRONGEST = 30.0  # weights at the tail's length: more torque than any motor of the body has
DEGREES = 360.0  # of an angle's bound in rad: a larger one is not meant as degrees
UNITS = {"angle": "rad", "rate": "rad/s", "torque": "N m", "torque_rate": "N m/s"}
UNITS |= {"speed": "rad/s", "power": "W", "tension": "N"}
USUAL = {"torque": 0.02, "speed": None, "power": None}  # of models without motors
FRAMES = 6  # from a warning to the call of st.plan


def checked_duration(model: Model, duration: Any) -> tuple[float, float]:
    """Return least and most (s) of a duration; UnusualSize if it is longer than falls are.

    PlanningError if it is so long that its computation might take minutes.
    """
    pair = duration if isinstance(duration, tuple | list) else (duration, duration)
    if len(pair) != 2:
        raise PlanningError(
            f"duration: value {shown(duration)}: needs one number, or (least, most), in s"
        )
    least, most = (number("duration", value, PlanningError, unit="s", above=0) for value in pair)
    if most < least:
        raise PlanningError(f"duration: value {shown(duration)}: needs least <= most, in s")
    height = float(np.linalg.norm(fall(model.parameters))) * most * most / 2  # may overflow
    told = f"duration: value {most:.6g} s: a body falls {height:.2g} m in this time: did you mean "
    told += f'"{most:.6g} ms"?'
    if height > HIGHEST:
        raise PlanningError(f"{told} It needs a fall of at most {HIGHEST:g} m")
    if most > LONGEST and height > 0:
        warnings.warn(told, UnusualSize, stacklevel=FRAMES)
    return least, most


def checked_bounds(model: Model, bounds: Any) -> Bounds:
    """Return bounds of every tail coordinate, None for no bound; UnusualSize for odd ones.

    A bound of angles of half a turn is that of each segment, which its joints share.
    """
    if not isinstance(bounds, Bounds):
        raise PlanningError(f"bounds: value {shown(bounds)}: needs a serpentail.Bounds")
    if isinstance(bounds.angle, str) and bounds.angle == HALF_TURN:
        bounds = replace(bounds, angle=_half_turns(model))
    bounds = _of_tendons(model, bounds)
    usual = {n: model.parameters.get(f"motor_{n}", USUAL[n]) for n in USUAL}
    own = [n for n in USUAL if isinstance(x := getattr(bounds, n), str) and x == MOTOR]
    if len(model.layout.chains) > 1:  # motors are those of the tail
        named = {n: {"tail": x} for n, x in usual.items() if x != USUAL[n]}
        bounds, usual = replace(bounds, **{n: named.get(n, USUAL[n]) for n in own}), dict(USUAL)
    else:
        bounds = replace(bounds, **{n: usual[n] for n in own})
    usual["angle"] = _half_turns(model)
    found = {
        n: _bound(model, n, getattr(bounds, n), usual.get(n))
        for n in (entry.name for entry in fields(Bounds))
    }
    angle, torque = found["angle"], found["torque"]
    if found["speed"] is not None and torque is None:
        needs = "a bound of torque, too: that of a motor at rest"
        raise refusal("bounds.speed", bounds.speed, needs, PlanningError)
    widest = 0.0 if angle is None else angle.max(where=np.isfinite(angle), initial=0.0)
    if 0.0 < widest <= DEGREES:
        warn_of_unusual("bounds.angle", float(widest), "rad", FRAMES)
    p = model.parameters
    strongest = STRONGEST * total_mass(p) * 9.81 * p["tail_length"]
    if torque is not None and torque.max() > strongest:
        most = f"{torque.max():.6g}"
        told = f"bounds.torque: value {most} N m: {STRONGEST:g} times this body's weight at the "
        told += f"end of its tail is {strongest:.2g} N m: did you mean "
        told += f'"{most} mN m"? None sets no bound'
        warnings.warn(told, UnusualSize, stacklevel=FRAMES)
    return Bounds(**found)


def _of_tendons(model: Model, bounds: Bounds) -> Bounds:
    """Return bounds of tensions in place of those of motors, where tendons pull the tail."""
    usual = isinstance(bounds.tension, str) and bounds.tension == LIMIT
    if not model.layout.tendons:
        if not usual and bounds.tension is not None:
            raise refusal("bounds.tension", bounds.tension, "a model with tendons", PlanningError)
        return replace(bounds, tension=None)
    for name in ("torque", "torque_rate", "speed", "power"):
        value = getattr(bounds, name)
        if value is not None and not (isinstance(value, str) and value == MOTOR):
            needs = "a tail without tendons: bound their tension instead"
            raise refusal(f"bounds.{name}", value, needs, PlanningError)
    tension = model.parameters["tendon_limits"] if usual else bounds.tension
    return replace(bounds, torque=None, speed=None, power=None, tension=tension)


def _half_turns(model: Model) -> np.ndarray:
    """Return the bound (nt,) of angles that bends each segment by half a turn."""
    return np.repeat(np.pi / np.abs(model.turns_each), model.layout.widths)


def _bound(model: Model, name: str, value: Any, usual: Any) -> np.ndarray | None:
    """Return a bound of every tail coordinate, or tendon; None for no bound.

    usual: of coordinates without a name where the value names some; None: they have no bound.
    """
    layout, field = model.layout, f"bounds.{name}"
    if value is None:
        return None

    def read(field: str, given: Any, size: int) -> np.ndarray:
        found = numbers(field, given, size, PlanningError, unit=UNITS[name], most=HUGE)
        if not (found > 0).all():
            raise PlanningError(f"{field}: value {shown(given)}: needs magnitudes above 0")
        return found

    if name == "tension":
        return read(field, value, len(layout.tendons))
    if isinstance(value, Mapping):
        others = np.full(layout.nt, np.inf if usual is None else usual)
        found = numbers_by_name(field, layout, value, others, read)
        if name == "torque_rate" and not np.isfinite(found).all():
            raise refusal(field, value, "a number for each motor", PlanningError)
        return found
    found = read(field, value, layout.nt)
    if name not in ("torque", "torque_rate") and np.ndim(value) == 0:  # of what motors move
        found[~np.array(layout.driven)] = np.inf
    return found
