"""Summaries: a trajectory and its model go in; what a motion on the ground or in flight came to, as
data, comes out.
"""

import numpy as np

from ..attitude import pitch_roll_yaw, rotation_matrix
from ..model.layout import QUATERNION, VELOCITY
from ..model.parameters import total_mass
from .trajectory import Trajectory

UPRIGHT, SLOW, CARRIED = (
    0.9,
    0.05,
    0.5,
)  # of standing: z of the torso's z axis, m/s of B, share of the weight on feet


def summary(model, motion: Trajectory) -> dict:
    """Return what a motion came to, ready for JSON; None where there is no such number.

    take_off_s, recontact_s: the flight about the apex, with nothing on the ground; apex_m: highest
    B; com_rise_m:
    highest centre of mass over its start; pitch_at_end_rad: turns counted; upright_end: z of the
    torso's z axis;
    standing_end: upright, at rest, on its feet; peaks: largest force on one
    point, A, M or T of both feet together, in the samples.
    """
    take_off, recontact = flight(motion)
    own = {
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
    return own | _effort(motion)


def _effort(motion: Trajectory) -> dict:
    """Method, counts and processor time."""
    info, span = motion.info, float(motion.t[-1] - motion.t[0])
    counts = {
        name: info.get(name) for name in ("method", "reason", "steps", "rejected", "evaluations")
    }
    return counts | {"cpu_s": info["cpu_seconds"], "real_time_factor": span / info["cpu_seconds"]}


def com_rise(model, motion: Trajectory) -> float | None:
    """Highest rise (m) of the centre of mass over its start, by the potential energy M g z; None
    without gravity.
    """
    p = model.parameters
    weight = total_mass(p) * p["gravity"]
    return float((motion.potential.max() - motion.potential[0]) / weight) if weight else None


def flight(motion: Trajectory) -> tuple[float | None, float | None]:
    """Times (s) at which the flight about the highest point begins and ends; None for what is not
    in the motion.
    """
    if motion.contact is None:
        return None, None
    apex = motion.t[motion.q[:, 2].argmax()]
    for begin, end in airborne(motion):
        if begin <= apex and (end is None or apex <= end):
            return (None if begin == -np.inf else begin), end
    return None, None


def airborne(motion: Trajectory) -> list[tuple[float, float | None]]:
    """Begin and end of every time in which nothing touches the ground; -inf, None where it is
    beyond the motion.
    """
    touching = {
        group for group in motion.contact.groups if (motion.contact.of(group).depth[0] > 0).any()
    }
    begin, spans = None if touching else -np.inf, []
    for event in motion.events:
        if event["kind"] == "take_off":
            touching.discard(event["group"])
            begin = None if touching else event["time"]
            continue
        spans += [] if begin is None else [(begin, event["time"])]
        touching.add(event["group"])
        begin = None
    return spans if begin is None else [*spans, (begin, None)]


def upright(motion: Trajectory) -> float:
    """How upright the torso ends: z of its z axis, 1 on its feet, -1 on its back."""
    return float(rotation_matrix(motion.q[-1, QUATERNION])[2, 2])


def standing(model, motion: Trajectory) -> bool | None:
    """Tell if it ends on its feet: upright, at rest, half of the weight on them; None where it has
    no feet.
    """
    if motion.contact is None or "feet" not in motion.contact.groups:
        return None
    p = model.parameters
    weight = total_mass(p) * p["gravity"]
    carried = motion.contact.of("feet").forces[-1, :, 2].sum()
    slow = np.linalg.norm(motion.v[-1, VELOCITY]) < SLOW
    return bool(upright(motion) > UPRIGHT and slow and carried > CARRIED * weight)


def peak_force(motion: Trajectory, group: str) -> float | None:
    """Largest force (N) on a point of a group, of both feet together; None where the motion has no
    such group.
    """
    if motion.contact is None or group not in motion.contact.groups:
        return None
    forces = motion.contact.of(group).forces
    forces = forces[:, :3] + forces[:, 3:] if group == "feet" else forces
    return float(np.linalg.norm(forces, axis=-1).max())
