"""How errors are measured, and at which states."""

import copy

import numpy as np
import pytest

import serpentail as st
from serpentail.verification import errors, law, states
from tests.references import metrics
from tests.support.models import model_folder

# Measures and states


def test_errors_are_measured_as_the_references_measure():
    rng = np.random.default_rng(1)
    root = rng.normal(size=(8, 8))
    H = root @ root.T
    other = H + 1e-9 * rng.normal(size=(8, 8))
    assert errors.matrix_error(other, H) == pytest.approx(
        metrics.mass_matrix_error(other, H), rel=1e-12
    )
    assert errors.block_error(other[0], H[0]) == pytest.approx(
        metrics.block_error(other[0], H[0]), rel=1e-12
    )
    assert errors.condition(H) == pytest.approx(metrics.equilibrated_condition(H), rel=1e-12)


def test_condition_without_a_mass_matrix_is_of_the_same_size(model):
    partial = copy.copy(model)
    partial.kernels = {"forward_dynamics": model.kernel("forward_dynamics")}
    for s in states.states(model):
        ratio = errors.sensitivity(partial, s.q) / errors.sensitivity(model, s.q)
        assert 0.01 < ratio < 1.001


def test_slope_is_the_derivative():
    slope, largest = law.slope(lambda t: np.array([np.sin(3 * t + 1), np.cos(3 * t)]), 3.0)
    np.testing.assert_allclose(slope, [3 * np.cos(1), 0], rtol=0, atol=3e-14)
    assert (largest <= 1).all() and largest[1] > 0.99


def test_moved_follows_the_velocity(model):
    s = next(states.states(model))
    there = law.moved(s.q, s.v, 1e-6)
    rate = (there - law.moved(s.q, s.v, -1e-6)) / 2e-6
    w, x, y, z = s.q[3:7]
    Q = np.array([[-x, -y, -z], [w, -z, y], [z, w, -x], [-y, x, w]])
    np.testing.assert_allclose(
        rate, np.concatenate([s.v[:3], Q @ s.v[3:6] / 2, s.v[6:]]), rtol=1e-8, atol=1e-8
    )
    assert np.linalg.norm(there[3:7]) == pytest.approx(1, abs=1e-14)


def test_states_are_of_all_kinds_seeded_and_exact_in_the_real_type():
    for options in ({}, {"real": "float"}):
        model = st.load(model_folder(1, 2, **options))
        first, again = list(states.states(model)), list(states.states(model))
        assert [s.kind for s in first] == [kind for kind in states.KINDS for _ in range(4)]
        for one, other in zip(first, again, strict=True):
            for name in ("q", "v", "v_dot", "tau", "f_ext"):
                x = getattr(one, name)
                np.testing.assert_array_equal(x, getattr(other, name))
                np.testing.assert_array_equal(x, x.astype(model.parameter_vector.dtype))
        assert not any(s.q[7:].any() for s in first if s.kind == "straight")
        assert all(abs(abs(s.q[7:]) - np.pi).max() < 0.011 for s in first[8::2])
