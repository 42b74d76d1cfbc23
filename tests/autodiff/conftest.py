"""Derivatives are compared in many digits."""

import mpmath
import pytest

DIGITS = 50


@pytest.fixture(autouse=True)
def many_digits():
    """Compute with many digits."""
    with mpmath.workdps(DIGITS):
        yield
