"""The numbers of a run: each with its name, its unit, what it means and how it is found.

Reports, pages and documents all read this one table.
"""

import math
from collections.abc import Callable, Iterable
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from ..basics.attitude import pitch_roll_yaw, tilt_deg
from ..model.model import Model
from ..model.passive import stored_energy
from ..model.weight import weight_of
from .ground import Peak, peaks, slip
from .landing import MAX_SPEED, MIN_SHARE, MIN_UPRIGHT, Landing, upright
from .plausibility import warnings_of
from .text import as_markdown
from .trajectory import Trajectory


class Facts:
    """A motion, its model, and what several of its numbers share."""

    def __init__(self, model: Model, motion: Trajectory):
        self.model, self.motion = model, motion
        self.landing, self.weight = Landing(model, motion), weight_of(model.parameters)

    @cached_property
    def peaks(self) -> dict[str, Peak]:
        """The largest forces of the ground; nothing in flight."""
        return peaks(self.motion)

    def in_weights(self, force: float | None) -> float | None:
        """A force in body weights; None without gravity."""
        return force / self.weight if force is not None and self.weight else None

    def peak(self, which: int) -> float | None:
        """The largest force on all points together (0), or its time (1); None in flight."""
        return self.peaks["all"][which] if self.peaks else None

    def peaks_of_parts(self) -> dict[str, float] | None:
        """The largest force on each group and on each foot."""
        return {name: peak.force for name, peak in self.peaks.items() if name != "all"} or None


class Number(NamedTuple):
    """A number of a run: ``of`` returns it ready for JSON, or None if it does not exist."""

    name: str
    unit: str
    meaning: str
    of: Callable[[Facts], Any]


def com_rise(model: Model, motion: Trajectory) -> float | None:
    """Highest rise (m) of the centre of mass against gravity, by M g h; None without g."""
    whole = weight_of(model.parameters)
    lifted = motion.potential - stored_energy(model.passive_values, motion.tail)
    return float((lifted.max() - lifted[0]) / whole) if whole else None


def _of_torso(measure: Callable[[Trajectory], Any]) -> Callable[[Facts], Any]:
    """What a torso that moves does; None on a fixed base."""
    return lambda run: None if run.model.fixed else measure(run.motion)


def _entry(name: str) -> Callable[[Facts], Any]:
    """An entry of the run's info."""
    return lambda run: run.motion.info.get(name)


def _ground_impulse(run: Facts) -> list[float] | None:
    """The sum of the groups' impulses; None in flight, and if no run added them up."""
    impulses = run.motion.info.get("impulse_N_s") or {}
    found = [impulse for group, impulse in impulses.items() if group not in ("air", "loads")]
    return np.sum(found, axis=0).tolist() if found else None


def _parts_in_weights(run: Facts) -> dict[str, float | None] | None:
    """The peaks of groups and feet in body weights."""
    return {name: run.in_weights(f) for name, f in (run.peaks_of_parts() or {}).items()} or None


def _duration(run: Facts) -> float:
    return float(run.motion.t[-1] - run.motion.t[0])


def _real_time_factor(run: Facts) -> float | None:
    seconds = run.motion.info.get("cpu_seconds")
    return _duration(run) / seconds if seconds else None


STEPS = "at the ends of the integrator's steps; quote the impulse of a blow, not its peak"
ONE_FOOT = "of each foot by the samples"
NUMBERS = (
    Number("model", "", "name of the model", lambda run: run.model.name),
    Number("duration_s", "s", "from the first sample to the last", _duration),
    # the leap
    Number("take_off_s", "s", "start of the flight about the apex: nothing touches the ground",
        lambda run: run.landing.flight[0]),
    Number("apex_m", "m", "largest height of B, the torso's centre of mass",
        _of_torso(lambda motion: float(motion.q[:, 2].max()))),
    Number("com_rise_m", "m", "largest rise of the centre of mass against gravity",
        lambda run: com_rise(run.model, run.motion)),
    Number("recontact_s", "s", "landing: end of the flight about the apex",
        lambda run: run.landing.flight[1]),
    Number("torso_rate_at_take_off", "rad/s",
        "angular velocity of the torso (x, y, z of its own axes) at this take-off",
        lambda run: run.landing.torso_rate(0)),
    Number("torso_rate_at_touch_down", "rad/s", "the same at this landing",
        lambda run: run.landing.torso_rate(1)),
    Number("angular_momentum_at_take_off", "kg m^2/s",
        "angular momentum about the centre of mass (x, y, z) at this take-off",
        lambda run: run.landing.angular_momentum(0)),
    Number("angular_momentum_at_touch_down", "kg m^2/s", "the same at this landing",
        lambda run: run.landing.angular_momentum(1)),
    Number("landing_group", "", "group of points that lands first",
        lambda run: run.landing.group()),
    # the attitude, and whether it was a landing or a tumble
    Number("pitch_at_end_rad", "rad", "pitch at the end, whole turns included",
        _of_torso(lambda motion: float(pitch_roll_yaw(motion.q, unwrap=True)[-1, 0]))),
    Number("tilt_max_deg", "deg", "largest angle between the torso's z axis and the vertical",
        _of_torso(lambda motion: float(tilt_deg(motion.attitude).max()))),
    Number("tilt_end_deg", "deg", "this angle at the end",
        _of_torso(lambda motion: float(tilt_deg(motion.attitude[-1])))),
    Number(
        "upright_end", "", "z component of the torso's z axis at the end: 1 level, -1 on its back",
        _of_torso(upright),
    ),
    Number(
        "least_upright_landing", "",
        "least such z component after the landing: below 0 it was on its back",
        lambda run: run.landing.least_upright(),
    ),
    Number(
        "turned_landing_rad", "rad",
        "total rotation of the torso about horizontal axes after the landing",
        lambda run: run.landing.turned(),
    ),
    Number(
        "standing_end", "",
        f"stands at the end: upright_end above {MIN_UPRIGHT}, B slower than {MAX_SPEED} m/s, more "
        f"than {MIN_SHARE} of the weight on the feet, or on limbs",
        lambda run: run.landing.standing,
    ),
    Number("landed", "", "stands at the end, and least_upright_landing is above 0",
        lambda run: run.landing.landed()),
    # the ground
    Number("body_weight_N", "N", "weight of torso and tail; on a fixed base, of the tail",
        lambda run: run.weight or None),
    Number(
        "ground_impulse_N_s", "N s",
        "impulse of the ground on all points (x, y, z), summed by the integrator",
        _ground_impulse,
    ),
    Number("impulse_N_s", "N s", "the same for each group, and that of loads and the air",
        lambda run: run.motion.info.get("impulse_N_s") or None),
    Number("peak_ground_force_N", "N", f"largest force on all points together, {STEPS}",
        lambda run: run.peak(0)),
    Number("peak_ground_force_weights", "body weights", "the same in body weights",
        lambda run: run.in_weights(run.peak(0))),
    Number("peak_ground_force_s", "s", "time of this force", lambda run: run.peak(1)),
    Number("peak_group_force_N", "N", "the same force on each group and on each foot",
        Facts.peaks_of_parts),
    Number("peak_group_force_weights", "body weights", "the same in body weights",
        _parts_in_weights),
    Number("touching_s", "s", f"total time for which each group touched the ground; {ONE_FOOT}",
        lambda run: run.landing.touching_time()),
    Number(
        "slip_m", "m",
        "longest path that a point of each group slips while the ground pushes it, at the samples",
        lambda run: slip(run.model, run.motion),
    ),
    Number("first_touch_down_s", "s", f"first touch-down of each group; {ONE_FOOT}",
        lambda run: run.landing.times("touch_down", 0)),
    Number("last_take_off_s", "s", f"last take-off of each group; {ONE_FOOT}",
        lambda run: run.landing.times("take_off", -1)),
    # the books
    Number("peak_torque_N_m", "N m", "largest torque of a tail coordinate, at the samples",
        lambda run: float(np.abs(run.motion.tau).max(initial=0))),
    Number("energy_change_J", "J", "energy at the end minus energy at the start",
        lambda run: float(run.motion.energy[-1] - run.motion.energy[0])),
    Number("work_J", "J", "work of torques, damping, ground, drives of legs and joints, loads, air",
        _entry("work_J")),
    Number(
        "imbalance", "",
        "energy (J) and momentum (N s) that work and impulses do not explain, and the larger of "
        "both relative to what was moved",
        _entry("imbalance"),
    ),
    Number("warnings", "", "doubts about the run", lambda run: warnings_of(run.model, run.motion)),
    # the effort
    Number("method", "", "integrator", _entry("method")),
    Number("reason", "", "why this integrator was chosen", _entry("reason")),
    Number("steps", "", "steps that were taken", _entry("steps")),
    Number("rejected", "", "steps that were repeated with a shorter length", _entry("rejected")),
    Number("evaluations", "", "evaluations of the equations of motion", _entry("evaluations")),
    Number("cpu_s", "s", "processor time", _entry("cpu_seconds")),
    Number("real_time_factor", "", "duration divided by processor time", _real_time_factor),
)  # fmt: skip
UNITS = {number.name: number.unit for number in NUMBERS}


def numbers_of(model: Model, motion: Trajectory, names: Iterable[str] = UNITS) -> dict[str, Any]:
    """Return numbers of a motion by name, ready for JSON."""
    facts, wanted = Facts(model, motion), set(names)
    with np.errstate(over="ignore", invalid="ignore"):  # of a run that blows up
        return {
            number.name: finite_json(number.of(facts))
            for number in NUMBERS
            if number.name in wanted
        }


def finite_json(value: Any) -> Any:
    """Return a value for JSON: lists in place of arrays, None for a number that is not finite."""
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if isinstance(value, dict):
        return {str(name): finite_json(part) for name, part in value.items()}
    if isinstance(value, list | tuple):
        return [finite_json(part) for part in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def explained() -> str:
    """Return all names, units and meanings as a Markdown table."""
    rows = ((f"`{each.name}`", each.unit, each.meaning) for each in NUMBERS)
    return as_markdown(("number", "unit", "meaning"), rows)
