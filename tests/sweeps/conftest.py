"""The model that sweeps run."""

import pytest

import serpentail as st


@pytest.fixture(scope="session")
def model():
    """A tail that rolls out, with exact derivatives for plans."""
    return st.build(tail="articulated", segments=1, links=2)
