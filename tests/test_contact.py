"""Contact with the ground: points, velocities, forces and accelerations against plain NumPy and limiting cases."""

from functools import cache

import numpy as np
import pytest

import serpentail as st
from models import model_folder
from references.contact import Contacts, attitude
from references.parameters import random_states

ALL = ("feet", "tail", "torso")
FRICTION = ("cone", "box", "smooth", "paper")
CASES = {
    "straight": (1, 3, {"emission": "straight"}),
    "loops": (2, 2, {"emission": "loops"}),
    "continuum": (2, None, {"samples": 3}),
    "continuum_loops": (1, None, {"emission": "loops"}),
    "baked": (1, 2, {"baked": True}),
}
NAMES = ["mass_matrix", "bias_force", "forward_dynamics", "contact_points", "contact_dynamics"]


@cache
def touching(segments=1, links=3, contacts=ALL, functions=tuple(NAMES), **options):
    """A model that can touch the ground."""
    options = {"contacts": list(contacts), "functions": list(functions), "name": "rat"} | options
    return st.load(model_folder(segments, links, **options))


@pytest.fixture(params=CASES)
def model(request):
    """A model of each kind and emission."""
    segments, links, options = CASES[request.param]
    return touching(segments, links, **options)


def near_ground(model, seed, count=20):
    """Random states with the torso about as high as the legs are long: some points touch, some do not."""
    rng = np.random.default_rng(seed)
    q, v, _, tau = random_states(model.segments, seed, count, "random")
    q[:, 2] = rng.uniform(-0.05, 0.15, count)
    q[:, 7:] *= 0.5
    legs = rng.uniform([3, -1.5, 3, -1.5, -80, -80, -80, -80], [4.2, 0, 4.2, 0, 80, 80, 80, 80], (count, 8))
    points = sum(entry["count"] for entry in model.manifest["contacts"])
    return q, v, tau, rng.normal(0, 2e-3, (count, points, 2)), legs


def each(model, seed=3, count=20):
    """The same, one by one."""
    return zip(*near_ground(model, seed, count), strict=True)


def test_legs_have_the_numbers_of_the_mechanism():
    """gamma = 210 deg: the sole is level; (y, z) of A, M and T from B in mm."""
    model = touching(1, 1, contacts=("feet",))
    expected = {
        -15: [(-29.46, -14.96), (4.35, -24.02), (20.35, -24.02)],
        -75: [(-46.43, -31.93), (-37.37, -65.74), (-21.37, -65.74)],
    }
    for delta, points in expected.items():
        legs = np.radians([210, delta, 210, delta, 0, 0, 0, 0])
        found, _ = model.contact_points([0, 0, 0, 1, 0, 0, 0, 0, 0], np.zeros(8), legs)
        for side in (0, 3):
            np.testing.assert_allclose(1e3 * found[side : side + 3, 1:], points, atol=0.006)
        np.testing.assert_allclose(found[:, 0], [0.0225] * 3 + [-0.0225] * 3)
        assert abs(found[1, 2] - found[2, 2]) < 1e-17


def test_points_and_velocities_are_the_references(model):
    reference = Contacts(model)
    for q, v, _, _, legs in each(model):
        positions, velocities = model.contact_points(q, v, legs)
        np.testing.assert_allclose(positions, reference.positions(q, legs).real, atol=3e-15 * (1 + abs(q[:3]).max()))
        scale = abs(velocities).max()
        np.testing.assert_allclose(velocities, reference.velocities(q, v, legs), atol=1e-13 * scale)


def test_the_torso_touches_by_its_lowest_point():
    """No point of the ellipsoid is lower, and it lies on the ellipsoid."""
    model = touching(1, 1, contacts=("torso",))
    axes, rng = np.array(model.parameters["torso_semi_axes"]), np.random.default_rng(1)
    sphere = rng.normal(size=(20_000, 3))
    surface = axes * sphere / np.linalg.norm(sphere, axis=1)[:, None]
    for q in random_states(1, 5, 10, "random")[0]:
        (lowest,), _ = model.contact_points(q, np.zeros(8))
        world = q[:3] + surface @ attitude(q[3:7]).T
        assert world[:, 2].min() >= lowest[2] - 1e-15
        assert world[:, 2].min() <= lowest[2] + 1e-3
        place = attitude(q[3:7]).T @ (lowest - q[:3])
        assert np.sum((place / axes) ** 2) == pytest.approx(1, rel=1e-12)


@pytest.mark.parametrize("friction", FRICTION)
@pytest.mark.parametrize("case", CASES)
def test_forces_and_accelerations_are_the_references(case, friction):
    """Eqs. 35 to 37, and the residual of H v_dot + C = [0; tau] + J^T f."""
    segments, links, options = CASES[case]
    model = touching(segments, links, friction=friction, **options)
    reference, touched = Contacts(model), 0
    for q, v, tau, bristles, legs in each(model):
        v_dot, rates, forces = model.contact_dynamics(q, v, tau, bristles, legs)
        expected, expected_rates = reference.laws(q, v, bristles, legs)
        np.testing.assert_allclose(forces, expected, rtol=1e-9, atol=1e-12 * (1 + abs(expected).max()))
        np.testing.assert_allclose(rates, expected_rates, rtol=1e-9, atol=1e-9 * (1 + abs(expected_rates).max()))
        load = np.einsum("kai,ka->i", reference.jacobians(q, legs), expected)
        residual = model.mass_matrix(q) @ v_dot + model.bias_force(q, v) - load
        residual[6:] -= tau
        scale = (np.abs(load) + np.abs(model.bias_force(q, v))) / np.sqrt(np.diag(model.mass_matrix(q)))
        assert np.abs(residual / np.sqrt(np.diag(model.mass_matrix(q)))).max() < 1e-10 * scale.max()
        touched += np.count_nonzero(expected[:, 2])
    assert touched > 20
