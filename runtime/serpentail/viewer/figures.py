"""The key numbers of a run, as the page prints them, and its events in words."""

from typing import Any

import numpy as np

from ..attitude import tilt_deg
from ..model.model import Model
from ..motion.summary import com_rise, flight, peak_force
from ..motion.trajectory import Trajectory

MOST_EVENTS = 1000  # that a page has
DECIMALS = 12  # what is smaller is rounding


def figures(model: Model, motion: Trajectory) -> list[tuple[str, str]]:
    """Return labels with units, and values, of what the motion has."""
    take_off, landing = flight(motion)
    tilt = tilt_deg(motion.attitude)
    rows = [
        ("duration (s)", motion.t[-1] - motion.t[0]),
        ("take-off (s)", take_off),
        ("landing (s)", landing),
        ("highest torso (m)", motion.q[:, 2].max()),
        ("rise of the centre of mass (m)", com_rise(model, motion)),
        ("largest tilt of the back (deg)", tilt.max()),
        ("tilt at the end (deg)", tilt[-1]),
        ("largest joint torque (N m)", np.abs(motion.tau).max(initial=0)),
        ("energy gained (J)", motion.energy[-1] - motion.energy[0]),
    ]
    for group in motion.contact.groups if motion.contact else ():
        rows.append((f"largest force at a point: {group} (N)", peak_force(motion, group)))
    return [
        (label, f"{round(value, DECIMALS) + 0.0:.4g}") for label, value in rows if value is not None
    ]


def events(motion: Trajectory, prefix: str = "") -> list[dict[str, Any]]:
    """Return the first events of the motion: time (s), kind, and a label that begins as given."""
    return [
        {
            "time": event["time"],
            "kind": event["kind"],
            "label": f"{prefix}{event['group']} {event['kind'].replace('_', ' ')}",
        }
        for event in motion.events[:MOST_EVENTS]
    ]
