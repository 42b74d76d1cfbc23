"""Accuracy against 40 digits: H and C to 1e-13, v_dot to 5e-15 times the condition of H; and that
more digits change nothing.
"""

from itertools import product

import mpmath
import numpy as np
import pytest

import serpentail as st
from serpentail.verification import states
from tests.references import metrics
from tests.references.exact_chain import ExactChain
from tests.references.exact_continuum import ExactContinuum
from tests.references.parameters import KINDS, TABLE_1, random_states
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


@pytest.mark.slow
@pytest.mark.parametrize("size", [(1, 8), (4, 7), (6, 1), (8, 16), (6, None)])
def test_accuracy_of_long_tails(size):
    """Their size is the point; they have what accuracy is measured of."""
    functions = ["mass_matrix", "bias_force", "forward_dynamics"]
    model = st.load(model_folder(*size, functions=functions))
    for s in states.states(model, 2):
        assert_accurate(model, exact(model), s)


BENDS = [0.0, 1e-300, 1e-16, 1e-8, 1e-3, 1.0, np.pi, 2 * np.pi, 10.0]
NO_DIGITS = 1e-25  # of the largest entry: what is smaller is a remainder of many digits


def states_of(segments, kind):
    """Two tuples (q, v, v_dot, tau)."""
    return list(zip(*random_states(segments, 17, 2, kind), strict=True))


def assert_same_float64(few, many, state):
    """Every quantity of two tails is the same float64, but for zeros."""
    q, v, v_dot, tau = state
    asked = {"mass_matrix": (q,), "inverse_dynamics": (q, v, v_dot), "energy": (q, v)}
    asked |= {"forward_dynamics": (q, v, tau), "momentum": (q, v), "center_of_mass": (q, v)}
    asked |= {"tail_points": (q, 3)} if isinstance(few, ExactContinuum) else {}
    for name, arguments in asked.items():
        found = [getattr(tail, name)(*arguments) for tail in (few, many)]
        for pair in zip(*found, strict=True):
            floor = NO_DIGITS * np.max(np.abs(pair[1]))
            np.testing.assert_array_equal(*(np.where(np.abs(x) < floor, 0, x) for x in pair))


@pytest.mark.slow
def test_more_digits_and_nodes_give_the_same_float64():
    with mpmath.workdps(5):  # digits are a tail's own
        for size, kind in product([(1, 3), (3, 4)], KINDS):
            few, many = (ExactChain(TABLE_1, *size, digits) for digits in (30, 50))
            with row(size, kind):
                assert_same_float64(few, many, states_of(size[0], kind)[0])
        few, many = (ExactContinuum(TABLE_1, 1, *size) for size in ((40, 24), (60, 32)))
        (q, *others), _ = states_of(1, "random")
        for bend in BENDS:
            with row(bend):
                state = (np.array([*q[:7], 0.6 * bend, -0.8 * bend]), *others)
                assert_same_float64(few, many, state)
