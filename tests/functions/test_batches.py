"""Derivatives of many states at once are those of the functions, found by a complex step."""

import numpy as np
import pytest

from serpentail.model.kernel import Kernel
from tests.support.derivative_models import FIRST, complex_step, jacobian_error

from .compared import limit

BATCHED = ("inverse_dynamics_derivatives", "forward_dynamics_derivatives")


@pytest.mark.parametrize("name", BATCHED)
def test_batches_of_derivatives_are_those_of_a_complex_step(model, some_states, name, monkeypatch):
    monkeypatch.setattr("serpentail.model.batch.MIN_BATCH", 1)
    monkeypatch.setattr(Kernel, "_each", lambda *_: pytest.fail("one by one"))
    function, outputs = FIRST[name]
    entry = model.manifest["functions"][name]
    many = [some_states[k % len(some_states)] for k in range(model.batch_library.states + 1)]
    found = model.kernel(name)(*(np.array([s[a["name"]] for s in many]) for a in entry["inputs"]))
    found = dict(zip((a["name"] for a in entry["outputs"]), found, strict=True))
    for k, state in enumerate(some_states):
        for output, (of, argument) in outputs.items():
            expected = complex_step(model, function, state, argument)[of]
            error = jacobian_error(found[output][k], expected, model.nv)
            assert error <= limit(model, name, state), (output, error)
