"""The paper's Table 1 in SI units, and seeded states (q, v, v_dot, tau) of a tail."""

from math import pi

import numpy as np

TABLE_1 = {
    "gravity": 9.8,
    "torso_mass": 0.10572,
    "torso_inertia": (672.2e-7, 363.9e-7, 727.9e-7),
    "tail_mount": (0.0, -40.5e-3, 4.5e-3),
    "tail_mass": 3.51e-3,
    "tail_length": 194.66e-3,
    "link_radius": 2.9e-3,
}

KINDS = ("random", "straight", "folded")


def random_states(segments, seed, count, kind):
    """Arrays (q, v, v_dot, tau), count rows each, with tail angles of the given kind."""
    rng = np.random.default_rng([seed, segments, KINDS.index(kind)])
    base = np.hstack([rng.uniform(-1, 1, (count, 3)), _quaternions(rng, count)])
    q = np.hstack([base, _tail_angles(rng, kind, (count, 2 * segments))])
    v = _blocks(rng, count, segments, (2.0, 20.0, 10.0))
    v_dot = _blocks(rng, count, segments, (20.0, 500.0, 500.0))
    return q, v, v_dot, rng.uniform(-1e-3, 1e-3, (count, 2 * segments))


def _quaternions(rng, count):
    """Unit quaternions (w, x, y, z), uniform over the rotations."""
    quaternions = rng.normal(size=(count, 4))
    return quaternions / np.linalg.norm(quaternions, axis=1, keepdims=True)


def _blocks(rng, count, segments, scales):
    """Rows of a linear, an angular and a tail part, each uniform within its own scale."""
    sizes = (3, 3, 2 * segments)
    return np.hstack(
        [rng.uniform(-s, s, (count, size)) for s, size in zip(scales, sizes, strict=True)]
    )


def _tail_angles(rng, kind, shape):
    """Up to 1 rad per joint; none; or even rows near +-pi and odd ones anywhere in two turns."""
    if kind == "straight":
        return np.zeros(shape)
    if kind == "random":
        return rng.uniform(-1, 1, shape)
    near_pi = rng.choice([-pi, pi], shape) + rng.uniform(-0.01, 0.01, shape)
    large = rng.uniform(-2 * pi, 2 * pi, shape)
    return np.where(np.arange(shape[0])[:, None] % 2 == 0, near_pi, large)
