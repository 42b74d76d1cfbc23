"""The law of one point on the ground, in its limiting cases."""

import math

import numpy as np
import pytest

from serpentail_codegen.ir.interpret import Numbers
from serpentail_codegen.ir.tape import replay
from serpentail_codegen.mechanics.contact import contact_force
from serpentail_codegen.mechanics.lower import derive

FRICTION = ("cone", "smooth", "paper")
FLOATS = Numbers(math, float)


def law(friction, depth, velocity, bristle, **changes):
    """Force and bristle rate of one point; velocity (3) in the world."""
    P = {"K_n": 1000.0, "D_n": 0.75, "K_f": 600.0, "D_f": 0.01, "mu": 1.0} | changes
    drag = P["D_f"] * P["K_f"]
    step = derive(contact_force, friction=friction)
    given = {name: [value] for name, value in P.items()} | {"drag": [drag], "mobility": [1 / drag]}
    given |= {"p": [0, 0, 0], "arm": [0, 0, -depth], "velocity": velocity, "bristle": bristle}
    nodes = replay(step.nodes, [x for name, _ in step.inputs for x in given[name]], FLOATS)
    results = [nodes[k] for k in step.results]
    return np.array(results[:3]), np.array(results[3:])


@pytest.mark.parametrize("friction", FRICTION)
def test_the_ground_never_pulls_and_friction_stays_within_its_bound(friction):
    """Without depth there is no force, and bristles relax."""
    rng = np.random.default_rng(8)
    for _ in range(500):
        depth, velocity, bristle = rng.normal(0, 0.01), rng.normal(0, 5, 3), rng.normal(0, 1e-3, 2)
        mu = rng.uniform(0, 2)
        f, _ = law(friction, depth, velocity, bristle, mu=mu)
        size = np.abs(f[:2]).max() if friction == "paper" else np.linalg.norm(f[:2])
        assert f[2] >= 0 and size <= mu * f[2] * (1 + 1e-14)
    for depth in (0.0, 0.01):
        f, rate = law(friction, -depth, [1.0, 2.0, 3.0], [1e-3, -2e-3])
        assert not f.any()
        np.testing.assert_allclose(rate, [-0.1, 0.2], rtol=1e-14)


def test_what_sticks_does_not_drift():
    """At a load within the cone the bristle balances it, and then nothing moves."""
    f, rate = law("cone", 0.01, [0, 0, 0], [-5e-4, 2e-4])
    np.testing.assert_allclose(f, [0.3, -0.12, 1.0], rtol=1e-12)
    assert np.abs(rate).max() < 1e-16


def slide(friction, angle, h=2e-4, seconds=0.6):
    """Places, velocities and bristles of 0.1 kg at 1 m/s, pressed down by its weight."""
    mass, mu = 0.1, 0.5
    depth = (mass * 9.8 / 1000) ** (2 / 3)
    state = np.array([0, 0, np.cos(angle), np.sin(angle), 0, 0])

    def rates(s):
        f, rate = law(friction, depth, [s[2], s[3], 0.0], s[4:].tolist(), mu=mu)
        return np.concatenate([s[2:4], f[:2] / mass, rate])

    path = [state]
    for _ in range(int(seconds / h)):
        a = rates(state)
        b = rates(state + h / 2 * a)
        state = state + h * rates(state + h / 2 * b)
        path.append(state)
    return np.array(path)


@pytest.mark.parametrize("angle", [0.0, 0.4, np.pi / 4, 1.3])
def test_a_slider_stops_after_102_mm_at_any_heading(angle):
    """v^2 / (2 mu g), up to the stretch of the bristle, mu m g / K_f = 0.8 mm."""
    path = slide("cone", angle)
    assert np.linalg.norm(path[-1, :2]) == pytest.approx(0.5 / (0.5 * 9.8), abs=1e-3)
    assert np.arctan2(path[-1, 1], path[-1, 0]) == pytest.approx(angle, abs=1e-6)
    assert np.linalg.norm(path[-1, 2:4]) < 1e-6


def test_the_papers_fixed_anchor_pulls_a_slider_back():
    path = slide("paper", 0.0)
    assert path[:, 0].max() > 0.09 and path[:, 2].min() < -0.3
