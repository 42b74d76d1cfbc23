"""Models and states that several files of tests share."""

import pytest

import serpentail as st
from serpentail_codegen.scene.signatures.table import ALL, NEEDS
from tests.references.exact_continuum import ExactContinuum
from tests.references.parameters import KINDS, TABLE_1
from tests.support.exact_continuum_states import SIZES, states_of
from tests.support.models import model_folder


@pytest.fixture(scope="module")
def model():
    """A sound model with all functions."""
    return st.load(model_folder(1, 3, functions="all"))


@pytest.fixture(scope="module")
def having(model):
    """Return a function from a function's name to a sound model that has it."""
    names = ["mass_matrix", "bias_force", "rollout", *(name for name in NEEDS if name in ALL)]
    touching = st.load(model_folder(1, 3, functions=names, contacts=["feet", "tail", "torso"]))
    return lambda name: touching if name in NEEDS else model


@pytest.fixture(scope="module", params=SIZES, ids=lambda segments: f"m{segments}")
def exact(request):
    """The exact continuum tail of one size."""
    return ExactContinuum(TABLE_1, request.param)


@pytest.fixture(params=KINDS)
def states(request, exact):
    """Two tuples (q, v, v_dot, tau) of one kind."""
    return states_of(exact.segments, request.param)
