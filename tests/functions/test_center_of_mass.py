"""The centre of mass of the whole animal: its place, velocity and Jacobian, for every tail."""

import numpy as np
import pytest

import serpentail as st
from tests.references.exact_chain import ExactChain
from tests.references.exact_continuum import ExactContinuum
from tests.references.exact_polar import ExactPolar
from tests.references.parameters import KINDS, TABLE_1, random_states
from tests.support.models import model_folder

ROUNDINGS = 1e-14  # of the largest number; 45 times the eps of double
FUNCTIONS = ["center_of_mass", "mass_matrix", "momentum"]
TAILS = {
    "one link": (1, 1, {}),
    "links, straight": (2, 3, {"emission": "straight"}),
    "links, loops": (3, 4, {"emission": "loops"}),
    "links, segments": (4, 8, {"emission": "segments"}),
    "arc": (1, None, {"emission": "straight", "bend_range": 10}),
    "arcs": (2, None, {"emission": "loops", "bend_range": 10}),
    "polar": (2, None, {"coordinates": "polar", "bend_range": 10}),
}
every_tail = pytest.mark.parametrize("tail", TAILS)
every_kind = pytest.mark.parametrize("kind", KINDS)


def model_of(tail):
    segments, links, options = TAILS[tail]
    return st.load(model_folder(segments, links, functions=FUNCTIONS, **options))


def reference_of(tail):
    segments, links, options = TAILS[tail]
    if links:
        return ExactChain(dict(TABLE_1), segments, links)
    if "coordinates" in options:
        return ExactPolar(dict(TABLE_1), segments)
    return ExactContinuum(dict(TABLE_1), segments)


def states_of(tail, kind):
    """Return q, v of a few states; polar angles theta are kept off 0, where they are singular."""
    segments = TAILS[tail][0]
    q, v, _, _ = random_states(segments, 11, 4, kind)
    if tail == "polar":
        q[:, 8::2] = 0.05 + abs(q[:, 8::2])
    return q, v


@every_tail
@every_kind
def test_it_is_that_of_the_exact_reference(tail, kind):
    model, reference = model_of(tail), reference_of(tail)
    for q, v in zip(*states_of(tail, kind), strict=True):
        for found, expected in zip(
            model.center_of_mass(q, v), reference.center_of_mass(q, v), strict=True
        ):
            assert found.shape == expected.shape
            assert np.max(abs(found - expected)) <= ROUNDINGS * np.max(abs(expected))


@every_tail
@every_kind
def test_velocity_is_J_v_and_mass_times_it_the_momentum(tail, kind):
    model, (q, v) = model_of(tail), states_of(tail, kind)
    _, velocity, J = model.center_of_mass(q, v)
    scale = np.max(abs(velocity))
    np.testing.assert_allclose(velocity, np.einsum("kij,kj->ki", J, v), atol=ROUNDINGS * scale)
    mass = model.parameters["torso_mass"] + model.parameters["tail_mass"]
    np.testing.assert_allclose(
        mass * velocity, model.momentum(q, v)[0], atol=ROUNDINGS * mass * scale
    )


@every_tail
def test_it_moves_with_B_and_a_speed_of_B_costs_no_digits(tail):
    model, (q, v) = model_of(tail), states_of(tail, "random")
    position, velocity, J = model.center_of_mass(q, v)
    q[:, :3] += [1, 2, 4]
    v[:, :3] += [8, 16, 32]
    further, faster, same = model.center_of_mass(q, v)
    np.testing.assert_allclose(further - position, np.tile([1, 2, 4], (4, 1)), rtol=1e-15)
    np.testing.assert_allclose(faster - velocity, np.tile([8, 16, 32], (4, 1)), rtol=1e-14)
    assert np.array_equal(same, J)


@every_tail
def test_casadi_and_c_agree(tail):
    model, (q, v) = model_of(tail), states_of(tail, "random")
    results = model.casadi.center_of_mass(q[0], v[0])
    for found, expected in zip(results, model.center_of_mass(q[0], v[0]), strict=True):
        error = found.full() - np.reshape(expected, found.shape)
        assert np.max(abs(error)) <= ROUNDINGS * np.max(abs(expected))
