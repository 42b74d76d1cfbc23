"""A model with every function, whose batches nobody else has compiled in this process."""

import pytest

import serpentail as st
from tests.support import zoo


@pytest.fixture(scope="module")
def model():
    return st.load(zoo.folder("m2_n2"))
