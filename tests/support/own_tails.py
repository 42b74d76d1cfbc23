"""Tails whose segments and links differ: their scenes, and the same tails as sets of bodies."""

from pathlib import Path
from typing import Any

import numpy as np

from serpentail_codegen.scene.parse import parse_scene
from tests.references.body_set import Animal, Arc, Link
from tests.support.models import folder_of

TILT = (0.3, -0.6, 0.9)
TORSO = {"torso_mass": 0.11, "torso_inertia": [7e-5, 4e-5, 7.5e-5], "tail_mount": [0.002, -0.04, 0]}
VALUES = {
    "torso_mass": 0.11,
    "torso_inertia": (7e-5, 4e-5, 7.5e-5),
    "tail_mount": (0.002, -0.04, 0),
}
FUNCTIONS = [
    *("mass_matrix", "bias_force", "inverse_dynamics", "forward_dynamics"),
    *("energy", "momentum", "tail_points", "inverse_dynamics_derivatives"),
    *("inverse_dynamics_parameter_derivatives", "forward_dynamics_parameter_derivatives"),
]
LINKS = [
    {"links": 3, "length": 0.06, "mass": 1.5e-3, "link_inertia": [4e-8, 2e-9, 3e-8]},
    {
        "links": 2,
        "link_lengths": "30, 25 mm",
        "link_masses": [5e-4, 4e-4],
        "link_centers": "14, 12 mm",
        "link_inertias": [[3e-8, 2e-9, 4e-8], [2e-8, 1e-9, 1e-8]],
    },
    {"links": 2, "length": 0.02, "mass": "0.2 g", "link_inertia": "2, 1, 2 g mm^2"},
]
ARCS = [{"length": "60 mm", "mass": "1.5 g"}, {"length": 0.09, "mass": 0.0011}]
LINK_BODIES = (
    [Link(5e-4, 0.02, 0.01, (4e-8, 2e-9, 3e-8))] * 3,
    [
        Link(5e-4, 0.03, 0.014, (3e-8, 2e-9, 4e-8)),
        Link(4e-4, 0.025, 0.012, (2e-8, 1e-9, 1e-8)),
    ],
    [Link(1e-4, 0.01, 0.005, (2e-9, 1e-9, 2e-9))] * 2,
)
ARC_BODIES = (Arc(1.5e-3, 0.06, 3), Arc(1.1e-3, 0.09, 3))
# links and arcs alternate, so that the numbers of each kind differ from those of segments
BOTH = [
    {"kind": "continuum", **ARCS[0]},
    {"kind": "articulated", **LINKS[1]},
    {"kind": "continuum", **ARCS[1]},
    {"kind": "articulated", **LINKS[0]},
]
BOTH_BODIES = (ARC_BODIES[0], LINK_BODIES[1], ARC_BODIES[1], LINK_BODIES[0])
TAILS: dict[str, tuple[dict[str, Any], tuple]] = {
    "links": ({"kind": "articulated", "segments": LINKS}, LINK_BODIES),
    "arcs": ({"kind": "continuum", "segments": ARCS, "samples": 3}, ARC_BODIES),
    "both": ({"kind": "mixed", "segments": BOTH, "samples": 3}, BOTH_BODIES),
}


def animal(tail: str, tilted: bool = False) -> Animal:
    """Return one of the tails as a set of bodies."""
    angles = TILT if tilted else (0.0, 0.0, 0.0)
    return Animal(segments=TAILS[tail][1], mount_angles=angles, **VALUES)


def folder(tail: str, tilted: bool = False, **keys: Any) -> Path:
    """Return the generated folder of one of the tails."""
    return folder_of_tables(TAILS[tail][0], {"mount_angles": TILT} if tilted else {}, **keys)


def folder_of_tables(tables: dict[str, Any], parameters: dict[str, Any], **keys: Any) -> Path:
    """Return the generated folder of a scene's tables."""
    scene = {"functions": FUNCTIONS, **tables, **keys, "parameters": {**TORSO, **parameters}}
    return folder_of(parse_scene(scene, "own"))


def states(nq: int, count: int = 2):
    """Yield q, v, v_dot and torques, with strong bends of the tail."""
    rng = np.random.default_rng(19)
    nv = nq - 1
    for _ in range(count):
        v_dot = 20 * rng.normal(size=nv)
        yield rng.normal(size=nq), 4 * rng.normal(size=nv), v_dot, 1e-4 * rng.normal(size=nv - 6)
