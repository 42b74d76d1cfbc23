"""Two sizes of every search: few examples quickly, many among the slow tests."""

import pytest
from hypothesis import configuration

from tests.support.models import BUILD

configuration.set_hypothesis_home_dir(BUILD / "hypothesis")  # not in the checkout


@pytest.fixture(params=["few", pytest.param("many", marks=pytest.mark.slow)])
def search(request):
    """Return a function that checks a law on examples: the same ones in every run."""
    from .searching import searched

    return searched(60 if request.param == "few" else 300)
