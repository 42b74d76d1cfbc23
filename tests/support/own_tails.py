"""Tails of the zoo whose segments and links differ, as sets of bodies."""

from unittest.mock import patch

import numpy as np

from tests.references.body_set import Animal, Arc, Link, exact
from tests.support import zoo

TILT = tuple(zoo.MOUNTED["mount_angles"])
TORSO = zoo.TORSO | {"tail_mount": zoo.MOUNTED["tail_mount"]}
VALUES = {name: tuple(x) if isinstance(x, list) else x for name, x in TORSO.items()}
LINK_BODIES = (
    [Link(5e-4, 0.02, 0.01, (4e-8, 2e-9, 3e-8))] * 3,
    [Link(5e-4, 0.03, 0.014, (3e-8, 2e-9, 4e-8)), Link(4e-4, 0.025, 0.012, (2e-8, 1e-9, 1e-8))],
    [Link(1e-4, 0.01, 0.005, (2e-9, 1e-9, 2e-9))] * 2,
)
ARC_BODIES = (Arc(1.5e-3, 0.06, 3), Arc(1.1e-3, 0.09, 3))
BOTH_BODIES = (ARC_BODIES[0], LINK_BODIES[1], ARC_BODIES[1], LINK_BODIES[0])
TAILS = {"links": LINK_BODIES, "arcs": ARC_BODIES, "both": BOTH_BODIES}
IN_ZOO = {"own_links": "links", "own_arcs": "arcs", "mixed": "both"}


def animal(tail: str, tilted: bool = False) -> Animal:
    """Return one of the tails as a set of bodies."""
    angles = TILT if tilted else (0.0, 0.0, 0.0)
    return Animal(segments=TAILS[tail], mount_angles=angles, **VALUES)


def dynamics(bodies: Animal, q, v, v_dot) -> tuple[np.ndarray, ...]:
    """Return H, H v_dot + C and C of a set of bodies, whose Jacobians are found once."""
    jacobians = bodies._jacobians(exact(q))
    with patch.object(Animal, "_jacobians", lambda *_: jacobians):
        H, force = bodies.inertia(exact(q)), bodies.inverse_dynamics(q, v, v_dot)
    return tuple(x.astype(float) for x in (H, force, force - H.dot(exact(v_dot))))


def states(nq: int, count: int = 2):
    """Yield q, v, v_dot and torques, with strong bends of the tail."""
    rng = np.random.default_rng(19)
    nv = nq - 1
    for _ in range(count):
        v_dot = 20 * rng.normal(size=nv)
        yield rng.normal(size=nq), 4 * rng.normal(size=nv), v_dot, 1e-4 * rng.normal(size=nv - 6)
