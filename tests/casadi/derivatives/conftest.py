"""Derivatives of compiled functions in CasADi: those of the SX functions, with exact sparsity, and
IPOPT takes them.
"""

import pytest

from ..test_casadi_target import Model
from .external_models import BY_PARAMETERS, PARTS, TAILS


@pytest.fixture(
    scope="module",
    params=[
        pytest.param(name, marks=() if name in ("m1_n3", "arcs1") else pytest.mark.slow)
        for name in TAILS
    ],
)
def model(request):
    """A model with all derivatives but those with respect to parameters."""
    return Model(*TAILS[request.param], functions=PARTS)


@pytest.fixture(scope="module")
def small():
    """A model with first derivatives with respect to parameters."""
    return Model(1, 3, functions=[*PARTS, *BY_PARAMETERS])
