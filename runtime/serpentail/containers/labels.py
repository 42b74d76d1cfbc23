"""What the numbers of a motion are called: coordinates, their rates, axes, points, legs."""

from collections.abc import Mapping

from ..model.layout import PER_SEGMENT
from ..model.model import Model

TORSO_Q = {"x": "m", "y": "m", "z": "m", "qw": "1", "qx": "1", "qy": "1", "qz": "1"}
TORSO_V = {
    "vx": "m/s",
    "vy": "m/s",
    "vz": "m/s",
    "omega_x": "rad/s",
    "omega_y": "rad/s",
    "omega_z": "rad/s",
}
AXES = ("x", "y", "z")
LEGS = ("gamma_right", "delta_right", "gamma_left", "delta_left")
# of a segment, by the coordinates of the scene; of a motion without its model by what they bend
TAILS = {"joint": ("alpha", "beta"), "bend": ("a", "b"), "polar": ("phi", "theta")}
WITHOUT_MODEL = ("pitch", "yaw")
FOOT = ("right_A", "right_M", "right_T", "left_A", "left_M", "left_T")


def joints(segments: int, model: Model | None) -> list[str]:
    """Return the names (2m,) of the tail coordinates, such as alpha_1, beta_1."""
    pair = WITHOUT_MODEL
    if model is not None:
        pair = TAILS[model.manifest["scene"]["coordinates"]]
    assert len(pair) == PER_SEGMENT
    return [f"{name}_{i + 1}" for i in range(segments) for name in pair]


def points(groups: Mapping[str, int]) -> list[str]:
    """Return the names of the points that touch the ground, such as feet_right_A, tail_1."""
    names = []
    for group, count in groups.items():
        counted = tuple(str(k + 1) for k in range(count))
        own = FOOT if (group, count) == ("feet", len(FOOT)) else counted
        names += [f"{group}_{name}" for name in own]
    return names
