"""Pinocchio's and MuJoCo's articulated tails agree with 40 digits, and with first principles."""

from itertools import product

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.references.exact_chain import ExactChain
from tests.references.metrics import block_error, equilibrated_condition, mass_matrix_error
from tests.references.parameters import KINDS, TABLE_1, random_states
from tests.support.rows import row

pytest.importorskip("mujoco")
pytest.importorskip("pinocchio")

from tests.references.mujoco_chain import MujocoChain
from tests.references.pinocchio_chain import PinocchioChain

CLASSES = (PinocchioChain, MujocoChain)
SIZES = [(1, 1), (1, 3), (2, 3), (3, 4)]
LINK_INERTIA = (4.9e-8, 2e-9, 5e-8)
STEP = 1e-6


def rows(count=2, sizes=SIZES):
    """Yield a name, a library's chain of a size, and a state of a kind: all of these."""
    for size, of, kind in product(sizes, CLASSES, KINDS):
        chain = of(TABLE_1, *size)
        for state in zip(*random_states(size[0], 7, count, kind), strict=True):
            yield row(of.__name__, size, kind), chain, *state


def displaced(q, v, time):
    """The configuration reached from q in a time at the constant velocity v."""
    turned = Rotation.from_quat(q[3:7], scalar_first=True) * Rotation.from_rotvec(time * v[3:6])
    return np.concatenate(
        [q[:3] + time * v[:3], turned.as_quat(scalar_first=True), q[7:] + time * v[6:]]
    )


def assert_close(found, expected, tolerance=1e-13):
    """Every array agrees, relative to its largest entry."""
    for x, x_ref in zip(found, expected, strict=True):
        assert np.max(np.abs(x - x_ref)) <= tolerance * np.max(np.abs(x_ref))


def test_every_quantity_is_that_of_40_digits():
    for name, chain, q, v, v_dot, tau in rows():
        with name:
            exact = ExactChain(TABLE_1, chain.segments, chain.links)
            H = exact.mass_matrix(q)
            limit = 1e-13 * equilibrated_condition(H)
            assert mass_matrix_error(chain.mass_matrix(q), H) <= 1e-13
            for speed in (v, 0 * v):
                assert block_error(chain.bias_force(q, speed), exact.bias_force(q, speed)) <= 1e-13
            force = exact.inverse_dynamics(q, v, v_dot)
            assert block_error(chain.inverse_dynamics(q, v, v_dot), force) <= 1e-13
            found, expected = (of.forward_dynamics(q, v, tau) for of in (chain, exact))
            assert block_error(found, expected) <= limit
            external = chain.inverse_dynamics(q, v, v_dot) - np.concatenate([np.zeros(6), tau])
            assert block_error(chain.forward_dynamics(q, v, tau, external), v_dot) <= limit
            assert chain.energy(q, v) == pytest.approx(exact.energy(q, v), rel=1e-13, abs=1e-14)
            assert_close(chain.momentum(q, v), exact.momentum(q, v))
            assert_close(chain.center_of_mass(q, v), exact.center_of_mass(q, v))


def test_first_principles_hold():
    total = TABLE_1["torso_mass"] + TABLE_1["tail_mass"]
    for name, chain, q, v, v_dot, _ in rows():
        with name:
            H = chain.mass_matrix(q)
            np.testing.assert_array_equal(chain.mass_matrix(q), H)
            assert mass_matrix_error(H.T, H) <= 1e-14
            np.testing.assert_allclose(H[:3, :3], total * np.eye(3), atol=1e-15)
            slow = np.concatenate([np.zeros(3), v[3:]])
            assert block_error(chain.bias_force(q, v), chain.bias_force(q, slow)) <= 1e-12
            force = chain.inverse_dynamics(q, v, v_dot)
            assert block_error(force, H @ v_dot + chain.bias_force(q, v)) <= 5e-13
            assert chain.energy(q, v)[0] == pytest.approx(v @ H @ v / 2, rel=1e-13)
            later, earlier = (
                sum(chain.energy(displaced(q, v, time), v + time * v_dot)) for time in (STEP, -STEP)
            )
            error = (later - earlier) / (2 * STEP) - v @ force
            assert abs(error) <= 1e-7 * np.sum(np.abs(v * force))


def test_tail_points_are_products_of_rotations_and_jacobians_their_derivatives():
    for name, chain, q, *_ in rows():
        with name:
            points = expected_points(q, chain.segments, chain.links)
            np.testing.assert_allclose(chain.tail_points(q), points, rtol=0, atol=5e-15)
            jacobians = chain.tail_point_jacobians(q)
            for column, direction in enumerate(np.eye(chain.nv)):
                ahead, behind = (
                    chain.tail_points(displaced(q, direction, s * STEP)) for s in (1, -1)
                )
                difference = (ahead - behind) / (2 * STEP)
                np.testing.assert_allclose(jacobians[:, :, column], difference, rtol=0, atol=2e-9)


def expected_points(q, segments, links):
    """p + R mount, then one link along -y_j after each R_j = R_{j-1} Rx(alpha_i) Rz(beta_i)."""
    rotation = Rotation.from_quat(q[3:7], scalar_first=True)
    points = [q[:3] + rotation.apply(TABLE_1["tail_mount"])]
    link = [0, -TABLE_1["tail_length"] / (segments * links), 0]
    for angles in np.repeat(np.reshape(q[7:], (segments, 2)), links, axis=0):
        rotation = rotation * Rotation.from_euler("XZ", angles)
        points.append(points[-1] + rotation.apply(link))
    return np.array(points)


def test_jacobians_of_both_libraries_agree():
    q = random_states(3, 7, 1, "folded")[0][0]
    ours, theirs = (of(TABLE_1, 3, 4).tail_point_jacobians(q) for of in CLASSES)
    np.testing.assert_allclose(theirs, ours, rtol=0, atol=2e-14)


def test_quaternion_is_normalised_and_arguments_are_left_alone():
    for name, chain, q, v, *_ in rows(1, [(1, 3)]):
        with name:
            scaled = q.copy()
            scaled[3:7] *= 3
            given = scaled.copy()
            assert block_error(chain.bias_force(scaled, v), chain.bias_force(q, v)) <= 1e-12
            assert chain.energy(scaled, v) == pytest.approx(chain.energy(q, v), rel=1e-14)
            np.testing.assert_array_equal(scaled, given)


def test_link_inertia_replaces_the_ellipsoid_that_a_radius_means():
    given = {**TABLE_1, "link_inertia": LINK_INERTIA, "link_radius": None}
    q, v, v_dot, _ = (x[0] for x in random_states(2, 7, 1, "random"))
    exact, thick = ExactChain(given, 2, 3), ExactChain(TABLE_1, 2, 3)
    assert mass_matrix_error(exact.mass_matrix(q), thick.mass_matrix(q)) >= 1e-3
    mass, half = TABLE_1["tail_mass"] / 6, TABLE_1["tail_length"] / 12
    radius = TABLE_1["link_radius"]
    across, along = mass / 5 * (half**2 + radius**2), mass / 5 * 2 * radius**2
    ellipsoid = {**TABLE_1, "link_inertia": (across, along, across)}
    for of in CLASSES:
        with row(of.__name__):
            own, force = of(given, 2, 3), exact.inverse_dynamics(q, v, v_dot)
            assert mass_matrix_error(own.mass_matrix(q), exact.mass_matrix(q)) <= 1e-13
            assert block_error(own.inverse_dynamics(q, v, v_dot), force) <= 1e-13
            implied, explicit = (of(p, 2, 3).mass_matrix(q) for p in (TABLE_1, ellipsoid))
            assert mass_matrix_error(implied, explicit) <= 1e-14
