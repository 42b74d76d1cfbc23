"""What moves the coordinates of a chain: the key `drive` of its table, or of each of its joints."""

from collections.abc import Mapping
from typing import Any

from .rules import one_of

DRIVES = ("torque", "passive", "prescribed")  # actuators; springs, damping, stops alone; a schedule
DRIVE = one_of(DRIVES)


def drives_of(chain: Mapping[str, Any]) -> list[str]:
    """Return the drive of each joint in the table of a limb; one for all of another chain."""
    usual, joints = chain.get("drive", DRIVES[0]), chain.get("joints")
    tables = joints if isinstance(joints, list | tuple) else [{}]
    return [t.get("drive", usual) if isinstance(t, Mapping) else usual for t in tables]
