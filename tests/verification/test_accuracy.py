"""Accuracy against 40 digits: H and C to 1e-13, v_dot to 5e-15 times the condition of H."""

import numpy as np
import pytest

import serpentail as st
from serpentail.verification import states
from tests.references import metrics
from tests.references.exact_chain import ExactChain
from tests.references.exact_continuum import ExactContinuum
from tests.support import zoo
from tests.support.models import model_folder
from tests.support.rows import row


def assert_accurate(model, chain, s):
    """Every error is within its limit, that of v_dot relative to the condition of H.

    Where every joint is folded, what H sums cancels: libraries' v_dot is off by 1e-14 to 2e-14,
    H by 3e-13.
    """
    crowd = 5 if s.kind == "folded" and (model.links or 0) > 8 else 1
    H, limit = chain.mass_matrix(s.q), 2e-14 * crowd if s.kind == "folded" else 5e-15
    found, expected = (of.forward_dynamics(s.q, s.v, s.tau) for of in (model, chain))
    bias = metrics.block_error(model.bias_force(s.q, s.v), chain.bias_force(s.q, s.v))
    with row(model.segments, model.links, s.kind):
        assert metrics.mass_matrix_error(model.mass_matrix(s.q), H) <= 1e-13 * crowd
        assert bias <= 1e-13 * crowd
        assert metrics.block_error(found, expected) <= limit * metrics.equilibrated_condition(H)


def exact(model):
    """The same tail in 40 digits."""
    sizes = (model.segments, model.links) if model.links else (model.segments,)
    return (ExactChain if model.links else ExactContinuum)(model.parameters, *sizes)


def test_accuracy_where_the_last_link_lies_along_its_own_pitch_axis():
    model = zoo.model("m1_n1")
    for s in states.states(model, 1):
        for short_of in (0.0, 1e-3, 1e-2, 0.1):
            s.q[-1] = np.pi / 2 - short_of
            assert_accurate(model, exact(model), s)


def test_accuracy_of_short_tails():
    for name in ("m2_n2", "arcs2"):
        for s in states.states(zoo.model(name), 1):
            assert_accurate(zoo.model(name), exact(zoo.model(name)), s)


@pytest.mark.slow
@pytest.mark.parametrize("size", [(1, 8), (4, 7), (6, 1), (8, 16), (6, None)])
def test_accuracy_of_long_tails(size):
    """Their size is the point; they have what accuracy is measured of."""
    functions = ["mass_matrix", "bias_force", "forward_dynamics"]
    model = st.load(model_folder(*size, functions=functions))
    for s in states.states(model, 2):
        assert_accurate(model, exact(model), s)
