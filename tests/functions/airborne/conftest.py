"""Models with the functions of nodes, and states of every kind."""

import pytest

from .states import KINDS, airborne_arguments, airborne_model, exact_tail, moving_states

QUICK = [(1, 3, "straight"), (2, 2, "loops"), (1, None, "loops"), (2, None, "loops")]
SLOW = [(1, 3, "loops"), (2, 2, "straight"), (3, 2, "loops"), (6, 2, "loops"), (3, None, "loops")]


@pytest.fixture(
    scope="module",
    params=[*QUICK, *(pytest.param(size, marks=pytest.mark.slow) for size in SLOW)],
    ids=lambda size: "_".join(map(str, size)),
)
def size(request):
    """Segments, links and emission."""
    return request.param


@pytest.fixture(scope="module")
def model(size):
    """A compiled model."""
    return airborne_model(*size)


@pytest.fixture(params=KINDS)
def moving(request, size):
    """Tuples (q, v, tau) of one kind; folded arcs stay within the range of bends."""
    states = moving_states(size[0], request.param)
    if size[1] is None and request.param == "folded":
        for q, _, _ in states:
            q[7:] /= 3
    return states


@pytest.fixture
def calls(size, moving):
    """The arguments of these states, with the momentum that they have to 40 digits."""
    exact = exact_tail(*size[:2])
    return [airborne_arguments(q, v, tau, exact.momentum(q, v)[1]) for q, v, tau in moving]
