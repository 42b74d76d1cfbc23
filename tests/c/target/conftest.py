"""The C text: it compiles without a warning, means what its program means bit for bit, and keeps to
itself.
"""

from functools import cache

import pytest

from .emitted import MODELS, TAILS, Model


@pytest.fixture(scope="module")
def models():
    """Return a function from a name in MODELS to its generated folder, made once."""
    return cache(lambda name: Model(name, *TAILS[name[:5]], **MODELS[name]))
