"""States of exact tails."""

from itertools import pairwise

import pytest

from .exact import State


@pytest.fixture(params=[(1, 3), (2, 2), (3, 1)], ids=["m1_n3", "m2_n2", "m3_n1"])
def state(request):
    """A random rational state of a tail."""
    return State(*request.param, seed=7)


@pytest.fixture
def links(state):
    """Every link with its parent and its segment, at v and v_dot."""
    bodies = state.bodies(state.v, state.v_dot)
    return [
        (parent, body, g // state.tail.links) for g, (parent, body) in enumerate(pairwise(bodies))
    ]
