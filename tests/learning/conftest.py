"""Models for environments: one that flies, one on feet, tail and torso."""

import pytest

import serpentail as st

from ..support.models import model_folder

WANTED = ["forward_dynamics", "contact_points", "rollout", "implicit"]


@pytest.fixture(scope="session")
def flyer():
    return st.load(model_folder(1, 3, functions=["forward_dynamics", "rollout"]))


@pytest.fixture(scope="session")
def walker():
    return st.load(model_folder(1, 2, contacts=["feet", "tail", "torso"], functions=WANTED))


@pytest.fixture
def of_task(request):
    """Return a function from a task to a model that can do it."""
    homes = {"righting": "flyer", "landing": "walker", "self_recovery": "walker"}
    return lambda task: request.getfixturevalue(homes[task])
