"""The two references of the articulated tail agree per quantity, and with first principles."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.references.metrics import block_error, equilibrated_condition, mass_matrix_error
from tests.references.mujoco_chain import MujocoChain
from tests.references.parameters import KINDS, TABLE_1, random_states
from tests.references.pinocchio_chain import PinocchioChain

SIZES = [(1, 1), (1, 3), (2, 3), (3, 4)]
CLASSES = (PinocchioChain, MujocoChain)
LINK_INERTIA = (4.9e-8, 2e-9, 5e-8)
STEP = 1e-6


@pytest.fixture(scope="module", params=SIZES, ids=lambda size: f"m{size[0]}_n{size[1]}")
def chains(request):
    """One Pinocchio and one MuJoCo chain of the same size."""
    return tuple(chain(TABLE_1, *request.param) for chain in CLASSES)


@pytest.fixture(params=KINDS)
def states(request, chains):
    """Ten tuples (q, v, v_dot, tau) of one kind."""
    return list(zip(*random_states(chains[0].segments, 7, 10, request.param), strict=True))


def displaced(q, v, time):
    """The configuration reached from q in a time at the constant velocity v."""
    turned = Rotation.from_quat(q[3:7], scalar_first=True) * Rotation.from_rotvec(time * v[3:6])
    return np.concatenate(
        [q[:3] + time * v[:3], turned.as_quat(scalar_first=True), q[7:] + time * v[6:]]
    )


def tail_force(tau):
    """[0_6; tau]."""
    return np.concatenate([np.zeros(6), tau])


def test_mass_matrices_agree(chains, states):
    ours, theirs = chains
    for q, *_ in states:
        assert mass_matrix_error(theirs.mass_matrix(q), ours.mass_matrix(q)) <= 1e-13


def test_mass_matrix_is_symmetric_and_the_same_on_every_call(chains, states):
    q = states[0][0]
    for chain in chains:
        first, second = chain.mass_matrix(q), chain.mass_matrix(q)
        np.testing.assert_array_equal(first, second)
        assert mass_matrix_error(first.T, first) <= 1e-14


def test_translational_mass_is_the_total_mass(chains, states):
    total = TABLE_1["torso_mass"] + TABLE_1["tail_mass"]
    for chain in chains:
        np.testing.assert_allclose(
            chain.mass_matrix(states[0][0])[:3, :3], total * np.eye(3), atol=1e-15
        )


def test_bias_forces_agree(chains, states):
    ours, theirs = chains
    for q, v, *_ in states:
        assert block_error(theirs.bias_force(q, v), ours.bias_force(q, v)) <= 5e-13


def test_bias_forces_at_rest_agree(chains, states):
    ours, theirs = chains
    for q, v, *_ in states:
        assert block_error(theirs.bias_force(q, 0 * v), ours.bias_force(q, 0 * v)) <= 5e-13


def test_bias_force_does_not_depend_on_translation_velocity(chains, states):
    q, v = states[0][:2]
    slow = np.concatenate([np.zeros(3), v[3:]])
    for chain in chains:
        assert block_error(chain.bias_force(q, v), chain.bias_force(q, slow)) <= 1e-12


def test_inverse_dynamics_agree(chains, states):
    ours, theirs = chains
    for q, v, v_dot, _ in states:
        assert (
            block_error(theirs.inverse_dynamics(q, v, v_dot), ours.inverse_dynamics(q, v, v_dot))
            <= 5e-13
        )


def test_inverse_dynamics_is_mass_times_acceleration_plus_bias(chains, states):
    for chain in chains:
        for q, v, v_dot, _ in states:
            force = chain.mass_matrix(q) @ v_dot + chain.bias_force(q, v)
            assert block_error(chain.inverse_dynamics(q, v, v_dot), force) <= 5e-13


def test_forward_dynamics_agree(chains, states):
    ours, theirs = chains
    for q, v, _, tau in states:
        limit = 1e-13 * equilibrated_condition(ours.mass_matrix(q))
        assert (
            block_error(theirs.forward_dynamics(q, v, tau), ours.forward_dynamics(q, v, tau))
            <= limit
        )


def test_forward_dynamics_inverts_inverse_dynamics(chains, states):
    for chain in chains:
        for q, v, v_dot, tau in states:
            external = chain.inverse_dynamics(q, v, v_dot) - tail_force(tau)
            limit = 1e-13 * equilibrated_condition(chain.mass_matrix(q))
            assert block_error(chain.forward_dynamics(q, v, tau, external), v_dot) <= limit


def test_energies_agree(chains, states):
    ours, theirs = chains
    for q, v, *_ in states:
        assert theirs.energy(q, v) == pytest.approx(ours.energy(q, v), rel=1e-13, abs=1e-14)


def test_kinetic_energy_is_the_mass_matrix_form(chains, states):
    for chain in chains:
        for q, v, *_ in states:
            assert chain.energy(q, v)[0] == pytest.approx(
                v @ chain.mass_matrix(q) @ v / 2, rel=1e-13
            )


def test_energy_changes_by_the_power_of_the_applied_forces(chains, states):
    for chain in chains:
        for q, v, v_dot, _ in states:
            later = sum(chain.energy(displaced(q, v, STEP), v + STEP * v_dot))
            earlier = sum(chain.energy(displaced(q, v, -STEP), v - STEP * v_dot))
            powers = v * chain.inverse_dynamics(q, v, v_dot)
            error = (later - earlier) / (2 * STEP) - np.sum(powers)
            assert abs(error) <= 1e-7 * np.sum(np.abs(powers))


def test_momenta_agree(chains, states):
    ours, theirs = chains
    for q, v, *_ in states:
        for momentum, momentum_ref in zip(theirs.momentum(q, v), ours.momentum(q, v), strict=True):
            assert np.max(np.abs(momentum - momentum_ref)) <= 5e-13 * np.max(np.abs(momentum_ref))


def test_tail_points_are_the_product_of_the_joint_rotations(chains, states):
    for chain in chains:
        for q, *_ in states:
            points = expected_points(q, chain.segments, chain.links)
            np.testing.assert_allclose(chain.tail_points(q), points, rtol=0, atol=5e-15)


def expected_points(q, segments, links):
    """p + R mount, then one link along -y_j after each R_j = R_{j-1} Rx(alpha_i) Rz(beta_i)."""
    rotation = Rotation.from_quat(q[3:7], scalar_first=True)
    points = [q[:3] + rotation.apply(TABLE_1["tail_mount"])]
    for angles in np.repeat(np.reshape(q[7:], (segments, 2)), links, axis=0):
        rotation = rotation * Rotation.from_euler("XZ", angles)
        points.append(
            points[-1] + rotation.apply([0, -TABLE_1["tail_length"] / (segments * links), 0])
        )
    return np.array(points)


def test_tail_point_jacobians_agree(chains, states):
    ours, theirs = chains
    for q, *_ in states:
        np.testing.assert_allclose(
            theirs.tail_point_jacobians(q), ours.tail_point_jacobians(q), rtol=0, atol=2e-14
        )


def test_tail_point_jacobians_are_the_derivatives_of_the_points(chains, states):
    for chain in chains:
        for q, *_ in states[:3]:
            jacobians = chain.tail_point_jacobians(q)
            for column, direction in enumerate(np.eye(chain.nv)):
                ahead = chain.tail_points(displaced(q, direction, STEP))
                behind = chain.tail_points(displaced(q, direction, -STEP))
                difference = (ahead - behind) / (2 * STEP)
                np.testing.assert_allclose(jacobians[:, :, column], difference, rtol=0, atol=2e-9)


def test_quaternion_is_normalised_and_arguments_are_left_alone(chains, states):
    q, v = states[0][:2]
    scaled = q.copy()
    scaled[3:7] *= 3
    given = scaled.copy()
    for chain in chains:
        assert block_error(chain.bias_force(scaled, v), chain.bias_force(q, v)) <= 1e-12
        assert chain.energy(scaled, v) == pytest.approx(chain.energy(q, v), rel=1e-14)
    np.testing.assert_array_equal(scaled, given)


def test_given_link_inertia_replaces_the_ellipsoid():
    parameters = {key: value for key, value in TABLE_1.items() if key != "link_radius"}
    parameters["link_inertia"] = LINK_INERTIA
    ours, theirs = (chain(parameters, 2, 3) for chain in CLASSES)
    q, v, v_dot, _ = (rows[0] for rows in random_states(2, 7, 1, "random"))
    assert mass_matrix_error(theirs.mass_matrix(q), ours.mass_matrix(q)) <= 1e-13
    assert (
        mass_matrix_error(ours.mass_matrix(q), PinocchioChain(TABLE_1, 2, 3).mass_matrix(q)) >= 1e-3
    )
    assert (
        block_error(theirs.inverse_dynamics(q, v, v_dot), ours.inverse_dynamics(q, v, v_dot))
        <= 5e-13
    )


@pytest.mark.parametrize("chain", CLASSES)
def test_link_radius_means_a_uniform_ellipsoid(chain):
    q = random_states(1, 7, 1, "random")[0][0]
    mass, half, radius = (
        TABLE_1["tail_mass"] / 3,
        TABLE_1["tail_length"] / 6,
        TABLE_1["link_radius"],
    )
    across, along = mass / 5 * (half**2 + radius**2), mass / 5 * 2 * radius**2
    explicit = chain({**TABLE_1, "link_inertia": (across, along, across)}, 1, 3)
    implied = chain({**TABLE_1, "link_inertia": None}, 1, 3)
    assert mass_matrix_error(implied.mass_matrix(q), explicit.mass_matrix(q)) <= 1e-14


@pytest.mark.parametrize("kind", KINDS)
def test_states_are_seeded(kind):
    first, again, other = (random_states(2, seed, 4, kind) for seed in (1, 1, 2))
    for rows, same_rows in zip(first, again, strict=True):
        np.testing.assert_array_equal(rows, same_rows)
    assert [rows.shape for rows in first] == [(4, 11), (4, 10), (4, 10), (4, 4)]
    assert not np.array_equal(first[1], other[1])


def test_block_error_scales_each_block_by_itself():
    reference = np.array([1, 0, 0, 0, 1e-3, 0, 1e-5, 0])
    assert block_error(reference + 1e-9 * np.eye(8)[7], reference) == pytest.approx(1e-4)
    assert block_error(reference, reference) == 0


def test_block_error_of_a_zero_block_is_finite():
    reference = np.array([1, 0, 0, 0, 0, 0, 1, 0])
    assert block_error(reference + 1e-16 * np.eye(8)[4], reference) == pytest.approx(1e-10)
    assert block_error(np.full(8, 1e-3), np.zeros(8)) == 1e-3


def test_equilibrated_condition_ignores_diagonal_scaling():
    mass = np.array([[2.0, 1.0], [1.0, 2.0]])
    scaled = np.diag([1, 1e-4]) @ mass @ np.diag([1, 1e-4])
    assert equilibrated_condition(scaled) == pytest.approx(3)
