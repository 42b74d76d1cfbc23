"""What a motion came to, in numbers that a report prints: flight, rise, turns, forces, effort."""

from typing import Any

import numpy as np

from ..attitude import pitch_roll_yaw, rotation_matrix
from ..model.layout import QUATERNION, VELOCITY
from ..model.model import Model
from ..model.parameters import total_mass
from .trajectory import Trajectory

# standing is: upright, at rest, its weight on the feet
MIN_UPRIGHT = 0.9  # z of the torso's z axis
MAX_SPEED = 0.05  # m/s, of B
MIN_SHARE = 0.5  # of the weight


def summary(model: Model, motion: Trajectory) -> dict[str, Any]:
    """Return what a motion came to, ready for JSON; None where there is no such number.

    take_off_s, recontact_s: the flight about the apex, with nothing on the ground; apex_m: highest
    B; com_rise_m: highest centre of mass over its start; pitch_at_end_rad: turns counted;
    upright_end: z of the torso's z axis; standing_end: upright, at rest, on its feet; peaks:
    largest force on one point, A, M or T of both feet together, in the samples; work_J,
    impulse_N_s, imbalance, warnings: the run's audit.
    """
    take_off, recontact = flight(motion)
    figures = {
        "model": model.name,
        "take_off_s": take_off,
        "apex_m": float(motion.q[:, 2].max()),
        "com_rise_m": com_rise(model, motion),
        "recontact_s": recontact,
        "pitch_at_end_rad": float(pitch_roll_yaw(motion.q, unwrap=True)[-1, 0]),
        "upright_end": upright(motion),
        "standing_end": standing(model, motion),
        "peak_foot_force_N": peak_force(motion, "feet"),
        "peak_tail_force_N": peak_force(motion, "tail"),
        "peak_torque_N_m": float(np.abs(motion.tau).max(initial=0)),
        "energy_change_J": float(motion.energy[-1] - motion.energy[0]),
    }
    return figures | _effort(motion)


def _effort(motion: Trajectory) -> dict[str, Any]:
    """Method, counts and processor time."""
    info, span = motion.info, float(motion.t[-1] - motion.t[0])
    names = ("method", "reason", "steps", "rejected", "evaluations")
    counts = {name: info.get(name) for name in names}
    books = ("work_J", "impulse_N_s", "imbalance", "warnings")
    counts |= {name: info.get(name) for name in books}
    return counts | {"cpu_s": info["cpu_seconds"], "real_time_factor": span / info["cpu_seconds"]}


def com_rise(model: Model, motion: Trajectory) -> float | None:
    """Highest rise (m) of the centre of mass, by the potential energy M g z; None without g."""
    p = model.parameters
    weight = total_mass(p) * p["gravity"]
    return float((motion.potential.max() - motion.potential[0]) / weight) if weight else None


def flight(motion: Trajectory) -> tuple[float | None, float | None]:
    """Times (s) at which the flight about the apex begins and ends; None: not in the motion."""
    if motion.contact is None or "events" not in motion.info:
        return None, None
    apex = motion.t[motion.q[:, 2].argmax()]
    for begin, end in airborne(motion):
        if begin <= apex and (end is None or apex <= end):
            return (None if begin == -np.inf else begin), end
    return None, None


def airborne(motion: Trajectory) -> list[tuple[float, float | None]]:
    """Spans in which nothing touches the ground; -inf, None where they go beyond the motion."""
    if motion.contact is None:
        return [(-np.inf, None)]
    groups = motion.contact.groups
    touching = {group for group in groups if (motion.contact.of(group).depth[0] > 0).any()}
    begin: float | None = None if touching else -np.inf
    spans: list[tuple[float, float | None]] = []
    for event in motion.events:
        # the last group to leave the ground begins a flight, the first to return ends it
        if event["kind"] == "take_off":
            touching.discard(event["group"])
            begin = None if touching else event["time"]
        else:
            touching.add(event["group"])
            if begin is not None:
                spans.append((begin, event["time"]))
            begin = None
    if begin is not None:
        spans.append((begin, None))
    return spans


def upright(motion: Trajectory) -> float:
    """How upright the torso ends: z of its z axis, 1 on its feet, -1 on its back."""
    return float(rotation_matrix(motion.q[-1, QUATERNION])[2, 2])


def standing(model: Model, motion: Trajectory) -> bool | None:
    """Tell if it ends upright, at rest and on its feet; None where it has none."""
    if motion.contact is None or "feet" not in motion.contact.groups:
        return None
    p = model.parameters
    weight = total_mass(p) * p["gravity"]
    carried = motion.contact.of("feet").forces[-1, :, 2].sum()
    slow = np.linalg.norm(motion.v[-1, VELOCITY]) < MAX_SPEED
    return bool(upright(motion) > MIN_UPRIGHT and slow and carried > MIN_SHARE * weight)


def peak_force(motion: Trajectory, group: str) -> float | None:
    """Largest force (N) on a point of a group, of both feet together; None without the group."""
    if motion.contact is None or group not in motion.contact.groups:
        return None
    forces = motion.contact.of(group).forces
    forces = forces[:, :3] + forces[:, 3:] if group == "feet" else forces
    return float(np.linalg.norm(forces, axis=-1).max())
