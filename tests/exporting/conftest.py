"""Units (FMUs) of the zoo's models, made once."""

from functools import cache

import pytest

import serpentail as st
from tests.support import zoo


@pytest.fixture(scope="session")
def fmu(tmp_path_factory):
    """Return a function from the name of a model to the path of its unit."""
    folder = tmp_path_factory.mktemp("units")
    return cache(lambda name: st.export(zoo.model(name), "fmu", folder / f"{name}.fmu"))
