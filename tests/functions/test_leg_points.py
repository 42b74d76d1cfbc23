"""The joints of both legs: those of the reference, whoever asks for them."""

import numpy as np
import pytest

import serpentail as st
from tests.references.contact import attitude, joints
from tests.references.parameters import random_states
from tests.support.models import model_folder

ROUNDING = 1e-14  # m, where B is within a few metres
MODELS = {
    "straight": (1, 3, {"emission": "straight"}),
    "loops": (2, 2, {"emission": "loops"}),
    "arcs": (2, None, {}),
    "baked": (1, 2, {"baked": True}),
    "beside a tail": (1, 1, {"contacts": ["feet", "tail", "torso"]}),
}


def model_of(name):
    segments, links, options = MODELS[name]
    options = {"contacts": ["feet"], "functions": ["leg_points"]} | options
    return st.load(model_folder(segments, links, **options))


def states_of(model, count=20):
    """Random configurations, quaternions of any norm, and the angles of both legs."""
    q = random_states(model.segments, 3, count, "random")[0]
    return q, np.random.default_rng(4).uniform(-np.pi, np.pi, (count, 4))


def expected(model, q, angles):
    """The reference's joints in the world, (2, 6, 3)."""
    return q[:3] + np.array(joints(model.parameters, angles)) @ attitude(q[3:7]).T


@pytest.mark.parametrize("name", MODELS)
def test_they_are_those_of_the_reference(name):
    model = model_of(name)
    for q, angles in zip(*states_of(model), strict=True):
        found = model.leg_points(q, angles)
        assert found.shape == (2, 6, 3)
        np.testing.assert_allclose(found, expected(model, q, angles), rtol=0, atol=ROUNDING)


def test_batches_are_singles():
    model = model_of("straight")
    q, angles = states_of(model)
    singles = [model.leg_points(*state) for state in zip(q, angles, strict=True)]
    np.testing.assert_array_equal(model.leg_points(q, angles), singles)


def test_parameters_of_the_legs_move_them():
    model = model_of("loops").with_parameters(
        hip=(0.01, 0.02, -0.03), L_h2d=0.01, L_d2k=0.02, L_k2a=0.03, L_a2m=0.04, L_m2t=0.05
    )
    model = model.with_parameters(delta_m=0.7)
    (q, *_), (angles, *_) = states_of(model, 1)
    found = model.leg_points(q, angles)
    np.testing.assert_allclose(found, expected(model, q, angles), rtol=0, atol=ROUNDING)


def test_casadi_has_the_same_joints():
    model = model_of("straight")
    (q, *_), (angles, *_) = states_of(model, 1)
    found = model.casadi.leg_points(q, angles).full().reshape(2, 6, 3)
    np.testing.assert_allclose(found, model.leg_points(q, angles), rtol=0, atol=ROUNDING)


@pytest.mark.parametrize("contacts", [["tail"], ["feet"]])
def test_models_without_it_say_what_to_add(contacts):
    model = st.load(model_folder(1, 1, functions=["contact_points"], contacts=contacts))
    with pytest.raises(st.ModelError, match=r"without 'leg_points'.*add it to `functions`"):
        model.leg_points(np.eye(9)[3], np.zeros(4))
