"""The numbers of a run: each with its name, its unit, what it means and how it is found.

Reports, pages and documents all read this one table.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from ..basics.attitude import pitch_roll_yaw, tilt_deg
from ..model.model import Model
from ..model.passive import stored_energy
from .body import weight
from .forces import Peak, in_weights, peaks
from .landing import (
    MAX_SPEED,
    MIN_SHARE,
    MIN_UPRIGHT,
    flight,
    landed,
    landing_group,
    least_upright,
    standing,
    times_of,
    touching_time,
    turned,
    upright,
)
from .plausibility import warnings_of
from .slip import slip
from .table import as_markdown
from .trajectory import Trajectory


class Number(NamedTuple):
    """A number of a run: ``of`` returns it ready for JSON, or None if it does not exist."""

    name: str
    unit: str
    meaning: str
    of: Callable[[Model, Trajectory], Any]


def com_rise(model: Model, motion: Trajectory) -> float | None:
    """Highest rise (m) of the centre of mass, by the potential energy M g z; None without g."""
    whole = weight(model)
    lifted = motion.potential - stored_energy(model.parameters, motion.tail)
    return float((lifted.max() - lifted[0]) / whole) if whole else None


def _of_torso(measure: Callable[[Trajectory], Any]) -> Callable[[Model, Trajectory], Any]:
    """What a torso that moves does; None on a fixed base."""
    return lambda model, motion: None if model.fixed else measure(motion)


def _told(name: str) -> Callable[[Model, Trajectory], Any]:
    """Return an entry of the run's info."""
    return lambda model, motion: motion.info.get(name)


def _ground_impulse(motion: Trajectory) -> list[float] | None:
    """Return the sum of the groups' impulses; None in flight, and if no run added them up."""
    impulses = motion.info.get("impulse_N_s")
    return np.sum(list(impulses.values()), axis=0).tolist() if impulses else None


def _of_all(found: dict[str, Peak], which: int) -> float | None:
    """Return the force or the time of the peak of all points."""
    return found["all"][which] if found else None


def _of_parts(motion: Trajectory) -> dict[str, float] | None:
    """Return the peaks of groups and feet."""
    found = {name: peak.force for name, peak in peaks(motion).items() if name != "all"}
    return found or None


def _parts_in_weights(model: Model, motion: Trajectory) -> dict[str, float | None] | None:
    found = _of_parts(motion) or {}
    return {name: in_weights(model, force) for name, force in found.items()} or None


def _real_time_factor(motion: Trajectory) -> float | None:
    seconds = motion.info.get("cpu_seconds")
    return float(motion.t[-1] - motion.t[0]) / seconds if seconds else None


STEPS = "at the ends of the integrator's steps; quote the impulse of a blow, not its peak"
ONE_FOOT = "of each foot by the samples"
NUMBERS = (
    Number("model", "", "name of the model", lambda model, motion: model.name),
    Number(
        "duration_s", "s", "from the first sample to the last",
        lambda model, motion: float(motion.t[-1] - motion.t[0]),
    ),
    # the leap
    Number(
        "take_off_s", "s", "start of the flight about the apex: nothing touches the ground",
        lambda model, motion: flight(motion)[0],
    ),
    Number(
        "apex_m", "m", "largest height of B, the torso's centre of mass",
        _of_torso(lambda motion: float(motion.q[:, 2].max())),
    ),
    Number("com_rise_m", "m", "largest height of the centre of mass, above its start", com_rise),
    Number(
        "recontact_s", "s", "landing: end of the flight about the apex",
        lambda model, motion: flight(motion)[1],
    ),
    Number(
        "landing_group", "", "group of points that lands first",
        lambda model, motion: landing_group(motion),
    ),
    # the attitude, and whether it was a landing or a tumble
    Number(
        "pitch_at_end_rad", "rad", "pitch at the end, whole turns included",
        _of_torso(lambda motion: float(pitch_roll_yaw(motion.q, unwrap=True)[-1, 0])),
    ),
    Number(
        "tilt_max_deg", "deg", "largest angle between the torso's z axis and the vertical",
        _of_torso(lambda motion: float(tilt_deg(motion.attitude).max())),
    ),
    Number(
        "tilt_end_deg", "deg", "this angle at the end",
        _of_torso(lambda motion: float(tilt_deg(motion.attitude[-1]))),
    ),
    Number(
        "upright_end", "", "z component of the torso's z axis at the end: 1 level, -1 on its back",
        _of_torso(upright),
    ),
    Number(
        "least_upright_landing", "",
        "least such z component after the landing: below 0 it was on its back",
        lambda model, motion: least_upright(motion),
    ),
    Number(
        "turned_landing_rad", "rad",
        "total rotation of the torso about horizontal axes after the landing",
        lambda model, motion: turned(motion),
    ),
    Number(
        "standing_end", "",
        f"stands at the end: upright_end above {MIN_UPRIGHT}, B slower than {MAX_SPEED} m/s, more "
        f"than {MIN_SHARE} of the weight on the feet",
        standing,
    ),
    Number(
        "landed", "", "stands at the end, and least_upright_landing is above 0", landed
    ),
    # the ground
    Number(
        "body_weight_N", "N", "weight of torso and tail; on a fixed base, of the tail",
        lambda model, motion: weight(model) or None,
    ),
    Number(
        "ground_impulse_N_s", "N s",
        "impulse of the ground on all points (x, y, z), summed by the integrator",
        lambda model, motion: _ground_impulse(motion),
    ),
    Number(
        "impulse_N_s", "N s", "the same for each group",
        lambda model, motion: motion.info.get("impulse_N_s") or None,
    ),
    Number(
        "peak_ground_force_N", "N", f"largest force on all points together, {STEPS}",
        lambda model, motion: _of_all(peaks(motion), 0),
    ),
    Number(
        "peak_ground_force_weights", "body weights", "the same in body weights",
        lambda model, motion: in_weights(model, _of_all(peaks(motion), 0)),
    ),
    Number(
        "peak_ground_force_s", "s", "time of this force",
        lambda model, motion: _of_all(peaks(motion), 1),
    ),
    Number(
        "peak_group_force_N", "N", "the same force on each group and on each foot",
        lambda _, motion: _of_parts(motion),
    ),
    Number(
        "peak_group_force_weights", "body weights", "the same in body weights", _parts_in_weights
    ),
    Number(
        "touching_s", "s", f"total time for which each group touched the ground; {ONE_FOOT}",
        lambda model, motion: touching_time(motion),
    ),
    Number(
        "slip_m", "m",
        "longest path that a point of each group slips while the ground pushes it, at the samples",
        slip,
    ),
    Number(
        "first_touch_down_s", "s", f"first touch-down of each group; {ONE_FOOT}",
        lambda model, motion: times_of(motion, "touch_down", 0),
    ),
    Number(
        "last_take_off_s", "s", f"last take-off of each group; {ONE_FOOT}",
        lambda model, motion: times_of(motion, "take_off", -1),
    ),
    # the books
    Number(
        "peak_torque_N_m", "N m", "largest torque of a tail coordinate, at the samples",
        lambda model, motion: float(np.abs(motion.tau).max(initial=0)),
    ),
    Number(
        "energy_change_J", "J", "energy at the end minus energy at the start",
        lambda model, motion: float(motion.energy[-1] - motion.energy[0]),
    ),
    Number(
        "work_J", "J",
        "work of the torques, the damping, the ground and the legs' drives",
        _told("work_J"),
    ),
    Number(
        "imbalance", "",
        "energy (J) and momentum (N s) that work and impulses do not explain, and the larger of "
        "both relative to what was moved",
        _told("imbalance"),
    ),
    Number("warnings", "", "doubts about the run", warnings_of),
    # the effort
    Number("method", "", "integrator", _told("method")),
    Number("reason", "", "why this integrator was chosen", _told("reason")),
    Number("steps", "", "steps that were taken", _told("steps")),
    Number("rejected", "", "steps that were repeated with a shorter length", _told("rejected")),
    Number("evaluations", "", "evaluations of the equations of motion", _told("evaluations")),
    Number("cpu_s", "s", "processor time", _told("cpu_seconds")),
    Number(
        "real_time_factor", "", "duration divided by processor time",
        lambda model, motion: _real_time_factor(motion),
    ),
)  # fmt: skip
UNITS = {number.name: number.unit for number in NUMBERS}


def explained() -> str:
    """Return all names, units and meanings as a Markdown table."""
    rows = ((f"`{each.name}`", each.unit, each.meaning) for each in NUMBERS)
    return as_markdown(("number", "unit", "meaning"), rows)
