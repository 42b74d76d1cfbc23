"""Laws of sampled motions: interpolation against analytic motions, files bit by bit, angles by
inversion.
"""

import numpy as np
import pytest

from .analytic import motion


@pytest.fixture
def flight():
    """Forty-one samples of the analytic motion."""
    return motion(np.linspace(0, 0.4, 41))
