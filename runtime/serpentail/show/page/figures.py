"""The key numbers of a run, as the page prints them, and its events in words."""

from typing import Any

from ...model.model import Model
from ...motion.numbers import UNITS
from ...motion.summary import summary
from ...motion.table import as_word
from ...motion.trajectory import Trajectory

MOST_EVENTS = 1000  # that a page has
LABELS = {  # of the numbers that the page shows
    "duration_s": "duration",
    "take_off_s": "take-off",
    "recontact_s": "landing",
    "landed": "landed, and stands at the end",
    "least_upright_landing": "least upright from the landing on",
    "turned_landing_rad": "turned from the landing on",
    "apex_m": "highest torso",
    "com_rise_m": "rise of the centre of mass",
    "tilt_max_deg": "largest tilt of the back",
    "tilt_end_deg": "tilt at the end",
    "impulse_N_s": "impulse of the ground",
    "peak_ground_force_N": "largest force of the ground",
    "peak_ground_force_weights": "largest force of the ground",
    "peak_group_force_N": "largest force",
    "peak_torque_N_m": "largest joint torque",
    "energy_change_J": "energy gained",
}


def figures(model: Model, motion: Trajectory) -> list[tuple[str, str]]:
    """Return labels with units, and values, of the numbers that the motion has."""
    told, rows = summary(model, motion), []
    for name, label in LABELS.items():
        unit = f" ({UNITS[name]})" if UNITS[name] else ""
        value = told[name]
        parts = value if isinstance(value, dict) else {"": value}
        for part, each in parts.items():
            whose = f": {part.replace('_', ' ')}" if part else ""
            if each is not None:
                rows.append((f"{label}{whose}{unit}", as_word(each)))
    return rows


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
