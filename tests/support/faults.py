"""Faulty models, and the laws that they break."""

import copy

import numpy as np

from serpentail.verification import report as verify
from serpentail.verification import states
from serpentail_scene.signatures.signature import IMPLICIT, SIMULATION
from serpentail_scene.signatures.table import NEEDS, in_group

SLIGHT_FAULT = 1e-9
# functions of more than a state
TAKING_MORE = (*NEEDS, *in_group(IMPLICIT), *in_group(SIMULATION))


def failed(checks):
    """Names of the checks that failed."""
    return {c.name for c in checks if not c.passed}


def laws_broken(model, count=2):
    """Return the names of the laws that a model breaks, without those of CasADi, which compare with
    the faulty C.
    """
    cases = list(states.states(model, count))
    entries = [entry for entry in verify.LAWS if "casadi" not in entry.name]
    return failed(verify.check(entry, model, cases) for entry in entries)


def broken(model, name, change):
    """Return the model with one function whose result, and arguments, are changed."""
    faulty, kernel = copy.copy(model), model.kernel(name)

    def call(*arrays, out=None):
        return change(kernel(*arrays), *arrays)

    call.names = kernel.names
    faulty.kernels = copy.copy(model.kernels)
    faulty.kernels[name] = call
    return faulty


def times(factor):
    """Return a change that multiplies every output."""
    return lambda result, *_: (
        tuple(factor * x for x in result) if isinstance(result, tuple) else factor * result
    )


def not_a_number(result, *_):
    """Replace the last entry of the last output by NaN."""
    outputs = [np.array(x) for x in (result if isinstance(result, tuple) else (result,))]
    outputs[-1][(..., *(-1,) * min(1, outputs[-1].ndim))] = np.nan
    return tuple(outputs) if isinstance(result, tuple) else outputs[0]
