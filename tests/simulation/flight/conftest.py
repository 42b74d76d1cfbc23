"""Flight: what mechanics conserves stays, what damping takes is accounted for, and torque laws act
as written.
"""

import functools

import pytest

import serpentail as st

from ...support.models import model_folder
from .thrown import LINKS, Q0, SEGMENTS, V0, WANTED


@pytest.fixture(scope="module")
def model():
    return st.load(model_folder(SEGMENTS, LINKS, name="tail", functions=WANTED))


@pytest.fixture(scope="module")
def fly(model):
    """Simulate from Q0, V0."""
    return functools.partial(st.simulate, model, Q0, V0)
