"""Models with all derivatives, and states of every kind."""

import pytest

from tests.support.derivative_models import KINDS, derivative_model, states

from .compared import PARAMS


@pytest.fixture(scope="module", params=PARAMS)
def model(request):
    """A compiled model with all derivatives."""
    return derivative_model(*request.param)


@pytest.fixture(params=KINDS)
def some_states(request, model):
    """Two states of one kind."""
    return states(model, request.param)
