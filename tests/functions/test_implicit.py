"""Implicit integrators' linear systems against a dense Jacobian of complex steps."""

from itertools import product

import numpy as np
import pytest

import serpentail as st
from tests.mechanics.test_contact import LAWS, TAILS, each, near_ground, reference_of, untilted
from tests.references.contact import Contacts
from tests.support import zoo
from tests.support.rows import row

GAINS = {"passive": (0.0, 0.0), "tracked": (4e4, 400.0), "damped": (0.0, 30.0)}


def solved(model, state, damping, gains, weight, r):
    """k of (1 - w J) k = r, r and k in three parts."""
    ground = [each for each in state[2:] if each is not None]
    factors = model.kernel("implicit_factor")(*state[:2], damping, gains, weight, *ground)
    return np.concatenate(model.kernel("implicit_solve")(factors, *r))


def right_hand_side(model, rng, count):
    """Random right-hand sides for q, v and bristles."""
    sizes = (model.nv, model.nv) + (count,) * (count > 0)
    return [rng.normal(size=size) for size in sizes]


def torso_and_tail(J, H, w):
    """S of S (k_v - r_v) = forces: H (1 - w J) after q and bristles are eliminated."""
    nv, W = len(H), np.eye(len(J)) - w * J
    own, others = np.arange(nv, 2 * nv), np.r_[:nv, 2 * nv : len(J)]
    rest = np.linalg.solve(W[np.ix_(others, others)], W[np.ix_(others, own)])
    return H @ (W[np.ix_(own, own)] - W[np.ix_(own, others)] @ rest)


def pivots(S):
    """Those of eliminating the last unknown first: quotients of minors."""
    minors = np.array([1.0, *(np.linalg.det(S[k:, k:]) for k in reversed(range(len(S))))])
    return minors[1:] / minors[:-1]


@pytest.mark.parametrize("name", [*LAWS, *TAILS])
@pytest.mark.parametrize("gains", GAINS.values(), ids=GAINS)
def test_solution_is_that_of_the_dense_system(name, gains):
    """With friction that follows the load wherever pivots are positive; without it always."""
    model = untilted(name)
    reference, rng = reference_of(name), np.random.default_rng(4)
    damping, refused, slides = np.full(model.nv - 6, 1e-3), 0, 0
    for q, v, _, bristles, legs in each(model, count=8):
        state, H = (q, v, bristles, legs), model.mass_matrix(q)
        J = {share: reference.jacobian(state, H, damping, gains, share) for share in (0.0, 1.0)}
        slides += not np.array_equal(J[0], J[1])
        for w, share in product((1e-5, 1e-3, 0.1), J):
            r = right_hand_side(model, rng, len(bristles))
            try:
                found = solved(model, state, damping, gains, (w, share), r)
            except st.StateError:
                assert share and pivots(torso_and_tail(J[1], H, w)).min() <= 0
                refused += 1
                continue
            expected = np.linalg.solve(np.eye(len(J[share])) - w * J[share], np.concatenate(r))
            most = 1e-9 * np.abs(expected).max()
            with row(w, share):
                np.testing.assert_allclose(found, expected, rtol=1e-8, atol=most)
    assert slides and refused <= 3, (slides, refused)


def refused(model, seed, w):
    """States 20 mm deep in the ground whose systems have a pivot that is not positive, as what jams
    gives.
    """
    factor, still = model.kernel("implicit_factor"), np.r_[np.ones(4), np.zeros(4)]
    for q, v, _, bristles, legs in zip(*near_ground(model, seed, 400), strict=True):
        q[2] -= model.contact_points(q, v, legs)[0][:, 2].min() + 0.02
        try:
            factor(q, v, np.zeros(model.nv - 6), np.zeros(2), [w, 1.0], bristles, legs * still)
        except st.StateError:
            yield q, v, bristles, legs * still


def test_a_step_of_what_jams_is_taken_as_if_friction_did_not_follow_the_load():
    """Linearly implicit Euler: (1 - w J) k = w times the rates, J without that slope."""
    model = zoo.model("ground_m2_n2")
    reference, w, none, count = Contacts(model), 0.01, np.zeros(4), 0
    for q, v, bristles, legs in refused(model, 5, w):
        H = model.mass_matrix(q)
        J = reference.jacobian((q, v, bristles, legs), H, none, (0.0, 0.0), 0.0)
        v_dot, rate, _ = model.contact_dynamics(q, v, none, bristles, legs)
        k = np.linalg.solve(np.eye(len(J)) - w * J, w * np.concatenate([v, v_dot, rate]))
        held = st.Legs([0, 1], [legs[[0, 2]]] * 2, [legs[[1, 3]]] * 2)
        start = {"legs": held, "bristles0": bristles.reshape(-1, 2), "t_span": w}
        flight = st.simulate(model, q, v, method="implicit_euler", step=w, output_step=w, **start)
        expected = v + k[model.nv : 2 * model.nv]
        np.testing.assert_allclose(
            flight.v[-1], expected, rtol=1e-8, atol=1e-9 * np.abs(expected).max()
        )
        count += 1
    assert count
