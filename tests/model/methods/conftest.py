"""Models: every function takes any array of numbers, alone or in batches, and refuses the rest by
name.
"""

import pytest

import serpentail as st

from ...support.models import model_folder
from .calls import folder


@pytest.fixture(scope="module")
def model():
    return st.load(folder())


@pytest.fixture(scope="module")
def small():
    """A model with one function."""
    return st.load(model_folder(1, 2, name="small", functions=["mass_matrix"]))
