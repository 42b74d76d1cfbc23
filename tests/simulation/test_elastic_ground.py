"""Elastic tails on the ground: forces, implicit steps, and books that balance there."""

import numpy as np
import pytest

import serpentail as st
from tests.references.metrics import block_error
from tests.references.passive import PassiveTail
from tests.support.elastic import ALL, FUNCTIONS, elastic_model, plain_model, unequal

CONTACTS = ["feet", "tail", "torso"]
GROUND = [*FUNCTIONS, "contact_dynamics", "contact_points"]
LEGS = st.Legs.fixed(np.radians(210), np.radians(-40))


def landing(model):
    """A start above the ground, tilted, its tail bent."""
    q, v = np.zeros(model.nq), np.zeros(model.nv)
    q[2:7] = 0.12, np.cos(0.2), np.sin(0.2), 0.1, 0
    q[7:] = 0.3, 0.1, -0.2, 0.1
    v[1:6] = 0.3, -0.5, 2.0, 1.0, 0.0
    return q, v


def test_the_ground_acts_beside_what_the_tail_asks_for():
    """Against the same tail without passive parts, whose torques are less by the reference's."""
    given = unequal(2)
    folder = elastic_model(2, 2, ALL, functions=GROUND, contacts=CONTACTS).folder
    model = st.load(folder, parameters=given)
    bare, own = plain_model(2, 2, functions=GROUND, contacts=CONTACTS), PassiveTail(given, 4)
    rng, legs = np.random.default_rng(3), np.array([3.6, -0.4, 3.7, -0.6, 5, -20, -8, 10.0])
    for _ in range(5):
        q, v = landing(model)
        q[2], q[7:] = 0.03, rng.uniform(-1, 1, 4)
        v[6:], tau = rng.uniform(-5, 5, 4), rng.uniform(-1e-3, 1e-3, 4)
        bristles = 1e-4 * rng.normal(size=2 * sum(model.contacts.values()))
        found = model.contact_dynamics(q, v, tau, bristles, legs)
        left = tau - own.force(q[7:], v[6:])
        expected = bare.contact_dynamics(q, v, left, bristles, legs)
        assert np.abs(expected[2]).max() > 0
        assert block_error(found[0], expected[0]) < 1e-10
        np.testing.assert_array_equal(found[2], expected[2])


@pytest.mark.parametrize("stiffness", [0.004, 1.0])
def test_an_elastic_tail_lands_with_books_that_balance(stiffness):
    """By implicit steps, which take about as many for a stiff tail; better with the tolerance."""
    model = elastic_model(2, 2, ALL, functions=GROUND, contacts=CONTACTS)
    model = model.with_parameters(tail_stiffness=stiffness, tail_damping=1e-3)
    left = []
    for rtol in (1e-4, 1e-6):
        run = st.simulate(model, *landing(model), t_span=0.4, legs=LEGS, rtol=rtol)
        assert run.info["method"] == "ros34pw2" and run.info["warnings"] == []
        assert run.info["work_J"]["damping"] < 0 and run.info["events"]
        left.append(run.info["imbalance"]["relative"])
    assert left[1] < 1e-4 and left[1] < 0.2 * left[0]
