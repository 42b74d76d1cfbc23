"""Implicit integrators' linear systems against a dense Jacobian of complex steps."""

import numpy as np
import pytest

from references.contact import Contacts
from references.parameters import random_states
from test_contact import CASES, FRICTION, each, touching

NAMES = ("mass_matrix", "implicit")
GAINS = {"passive": (0.0, 0.0), "tracked": (4e4, 400.0), "damped": (0.0, 30.0)}


def solved(model, state, damping, gains, w, r):
    """k of (1 - w J) k = r, r and k in three parts."""
    factors = model.kernel("implicit_factor")(state[0], state[1], damping, gains, [w], *state[2:])
    return np.concatenate(model.kernel("implicit_solve")(factors, *r))


def right_hand_side(model, rng, count):
    """Random right-hand sides for q, v and bristles."""
    sizes = (model.nv, model.nv) + (count,) * (count > 0)
    return [rng.normal(size=size) for size in sizes]


@pytest.mark.parametrize("gains", GAINS)
@pytest.mark.parametrize("friction", FRICTION)
@pytest.mark.parametrize("case", CASES)
def test_solution_is_that_of_the_dense_system(case, friction, gains):
    segments, links, options = CASES[case]
    model = touching(segments, links, functions=NAMES, friction=friction, **options)
    reference, rng, damping = Contacts(model), np.random.default_rng(4), np.full(2 * segments, 1e-3)
    for q, v, _, bristles, legs in each(model, count=8):
        H = model.mass_matrix(q)
        J = reference.jacobian((q, v, bristles, legs), H, damping, GAINS[gains])
        for w in (1e-5, 1e-3, 0.1):
            r = right_hand_side(model, rng, len(bristles))
            found = solved(model, (q, v, bristles, legs), damping, GAINS[gains], w, r)
            expected = np.linalg.solve(np.eye(len(J)) - w * J, np.concatenate(r))
            np.testing.assert_allclose(found, expected, rtol=1e-8, atol=1e-9 * np.abs(expected).max())


@pytest.mark.parametrize("size", [(1, 3), (2, None)])
def test_in_flight_only_damping_and_gains_are_left(size):
    model = touching(*size, contacts=(), functions=NAMES)
    rng, damping = np.random.default_rng(2), np.linspace(1e-3, 2e-3, model.nv - 6)
    nv, tail = model.nv, slice(6, None)
    for q, v in zip(*random_states(model.segments, 3, 5, "random")[:2], strict=True):
        H, r, w = model.mass_matrix(q), right_hand_side(model, rng, 0), 3e-3
        acting = np.zeros((nv, 2 * nv))
        acting[tail, 6:nv] = -4e4 * H[tail, tail]
        acting[tail, nv + 6 :] = -400 * H[tail, tail] - np.diag(damping)
        J = np.vstack([np.hstack([np.zeros((nv, nv)), np.eye(nv)]), np.linalg.solve(H, acting)])
        expected = np.linalg.solve(np.eye(2 * nv) - w * J, np.concatenate(r))
        found = solved(model, (q, v), damping, (4e4, 400.0), w, r)
        np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-10 * np.abs(expected).max())


def test_in_the_air_bristles_relax_and_nothing_else_happens():
    model = touching(1, 3, functions=NAMES)
    q = np.array([0, 0, 5.0, 1, 0.2, 0, 0, 0.1, 0.2])
    legs, rng = np.array([3.6, -0.3, 3.6, -0.3, 0, 0, 0, 0]), np.random.default_rng(1)
    r = right_hand_side(model, rng, 20)
    state = (q, rng.normal(size=8), rng.normal(size=20), legs)
    w = 0.01
    expected = np.concatenate([r[0] + w * r[1], r[1], r[2] / (1 + w / model.parameters["D_f"])])
    np.testing.assert_allclose(solved(model, state, np.zeros(2), (0, 0), w, r), expected, rtol=1e-14)
