"""Accuracy against 40 digits: H and C to 1e-13, v_dot to 5e-15 times the condition of H."""

import numpy as np
import pytest

import serpentail as st
from serpentail.verification import states
from tests.references import metrics
from tests.references.exact_chain import ExactChain
from tests.references.exact_continuum import ExactContinuum
from tests.support.models import model_folder

# Accuracy: H and C to 1e-13, v_dot to 5e-15 times the condition of H, at 40 digits


def exact_errors(model, chain, s):
    """Errors of H, C and v_dot, the last relative to the condition number, by the references'
    measures.
    """
    H = chain.mass_matrix(s.q)
    v_dot = metrics.block_error(
        model.forward_dynamics(s.q, s.v, s.tau), chain.forward_dynamics(s.q, s.v, s.tau)
    )
    return {
        "H": metrics.mass_matrix_error(model.mass_matrix(s.q), H),
        "C": metrics.block_error(model.bias_force(s.q, s.v), chain.bias_force(s.q, s.v)),
        "v_dot": v_dot / metrics.equilibrated_condition(H),
    }


def limits(model, kind):
    """Where every joint is folded, what H sums cancels: libraries' v_dot is off by 1e-14 to 2e-14,
    H by 3e-13.
    """
    crowd = 5 if kind == "folded" and (model.links or 0) > 8 else 1
    return {
        "H": 1e-13 * crowd,
        "C": 1e-13 * crowd,
        "v_dot": 2e-14 * crowd if kind == "folded" else 5e-15,
    }


def assert_accurate(model, chain, states):
    """Every error is within its limit at every state."""
    for s in states:
        limit = limits(model, s.kind)
        errors = exact_errors(model, chain, s)
        assert {key: error for key, error in errors.items() if not error <= limit[key]} == {}, (
            s.kind
        )


def lean(segments, links):
    """A model with what accuracy is measured of."""
    return st.load(
        model_folder(segments, links, functions=["mass_matrix", "bias_force", "forward_dynamics"])
    )


@pytest.mark.slow
@pytest.mark.parametrize("links", range(1, 9))
@pytest.mark.parametrize("segments", range(1, 7))
def test_accuracy(segments, links):
    model = lean(segments, links)
    assert_accurate(model, ExactChain(model.parameters, segments, links), states.states(model, 2))


@pytest.mark.slow
def test_accuracy_of_128_links():
    model = lean(8, 16)
    assert_accurate(model, ExactChain(model.parameters, 8, 16), states.states(model, 2))


@pytest.mark.slow
@pytest.mark.parametrize("segments", [1, 2, 3, 6])
def test_accuracy_of_the_continuum(segments):
    model = lean(segments, None)
    assert_accurate(model, ExactContinuum(model.parameters, segments), states.states(model, 1))


@pytest.mark.slow
@pytest.mark.parametrize("segments", [1, 3])
def test_accuracy_where_the_last_link_lies_along_its_own_pitch_axis(segments):
    model = lean(segments, 1)
    chain = ExactChain(model.parameters, segments, 1)
    for s in states.states(model, 1):
        for short_of in (0.0, 1e-3, 1e-2, 0.1):
            s.q[-1] = np.pi / 2 - short_of
            assert_accurate(model, chain, [s])
