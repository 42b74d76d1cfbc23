"""What the numbers of a motion are called: coordinates, their rates, axes, points, legs."""

from collections.abc import Mapping

from serpentail_scene.layout import PER_SEGMENT

from ...model.model import Model

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
# coordinates of a segment by its kind; of a motion without model by bend
TAILS = {"articulated": ("alpha", "beta"), "continuum": ("a", "b")}
POLAR = ("phi", "theta")
WITHOUT_MODEL = ("pitch", "yaw")
FOOT = ("right_A", "right_M", "right_T", "left_A", "left_M", "left_T")


def joints(segments: int, model: Model | None) -> list[str]:
    """Return the names (2m,) of the tail coordinates, such as alpha_1, beta_1."""
    pairs = [WITHOUT_MODEL] * segments
    if model is not None:
        polar = model.manifest["scene"]["coordinates"] == "polar"
        pairs = [POLAR if polar else TAILS[kind] for kind in model.kinds]
    assert all(len(pair) == PER_SEGMENT for pair in pairs)
    return [f"{name}_{i + 1}" for i, pair in enumerate(pairs) for name in pair]


def points(groups: Mapping[str, int]) -> list[str]:
    """Return the names of the points that touch the ground, such as feet_right_A, tail_1."""
    names = []
    for group, count in groups.items():
        counted = tuple(str(k + 1) for k in range(count))
        own = FOOT if (group, count) == ("feet", len(FOOT)) else counted
        names += [f"{group}_{name}" for name in own]
    return names
