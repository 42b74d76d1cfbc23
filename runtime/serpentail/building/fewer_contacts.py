"""A scene of a robot on the ground, with fewer groups of points that touch it, or with none."""

from collections.abc import Mapping
from typing import Any

ANY = "contacts"  # any group
# what a scene file may have of a group of points, or of any group
NEEDED = {
    ANY: ("K_n", "D_n", "K_f", "D_f", "mu"),
    "feet": ("L_h2d", "L_d2k", "L_k2a", "L_a2m", "L_m2t", "delta_m", "hip"),
    "torso": ("torso_semi_axes",),
}
FUNCTIONS = {ANY: ("contact_points", "contact_dynamics", "contact_rates"), "feet": ("leg_points",)}


def with_contacts(tables: Mapping[str, Any], contacts: Any) -> dict[str, Any]:
    """Return a scene's tables with other contacts, without what belongs to groups that it lacks.

    These are parameters, functions and, without any contacts, the friction.
    """
    scene = dict(tables) | {"contacts": contacts}
    if not isinstance(contacts, list | tuple):  # which the generator refuses
        return scene
    lacking = [
        group for group in NEEDED if group not in contacts and (group != ANY or not contacts)
    ]
    if ANY in lacking:
        scene.pop("friction", None)
    without = [name for group in lacking for name in NEEDED[group]]
    if isinstance(scene.get("parameters"), Mapping):
        own = scene["parameters"]
        scene["parameters"] = {name: own[name] for name in own if name not in without}
    unable = [name for group in lacking for name in FUNCTIONS.get(group, ())]
    if isinstance(scene.get("functions"), list):
        scene["functions"] = [name for name in scene["functions"] if name not in unable]
    return scene
