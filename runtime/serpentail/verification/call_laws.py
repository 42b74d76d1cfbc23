"""Laws of calls: repeated, in batches and through CasADi, a function gives the same."""

from itertools import starmap

import numpy as np

from ..model.model import Model
from .errors import differences, differing, differing_outputs, is_derivative
from .law import VALUE_LIMIT, Errors, law
from .states import (
    Case,
    arguments,
    casadi_outputs,
    functions_of,
    named,
    outputs,
    scaled,
)


@law()
def calls_repeat(model: Model, s: Case) -> Errors:
    """The same call gives the same bits, at once and after another call."""
    errors = {}
    for name in functions_of(model, airborne=True):
        first, second, _, last = (outputs(model, name, case) for case in (s, s, scaled(s, 0.5), s))
        errors[name] = differing_outputs(first, second) + differing_outputs(first, last)
    return errors


@law(units=VALUE_LIMIT)
def batches_are_singles(model: Model, s: Case) -> Errors:
    """A batch of nine states gives the bits of nine calls; in lanes of the fast profile, which
    fuses other products and sums, all but rounding.
    """
    cases = [scaled(s, 1 - k / 16) for k in range(9)]
    errors = {}
    for name in functions_of(model, airborne=True):
        batches = zip(*(arguments(model, name, case) for case in cases), strict=True)
        whole = named(model, name, model.kernel(name)(*map(np.stack, batches)))
        if model.profile == "fast" and model.batch_library.entry(name, len(cases)):
            rows = zip(*whole.values(), strict=True)
            found = zip(cases, rows, strict=True)
            errors[name] = max(differences(model, name, case, row) for case, row in found)
            continue
        singles = [outputs(model, name, case) for case in cases]
        stacked = {key: np.stack([single[key] for single in singles]) for key in whole}
        errors[name] = differing_outputs(whole, stacked)
    return errors


@law(units=VALUE_LIMIT, casadi=True)
def casadi_functions_agree(model: Model, s: Case) -> Errors:
    """The CasADi functions of SX operations give what the C gives, v_dot relative to cond(H)."""
    return {
        name: differences(
            model, name, s, casadi_outputs(model, name, getattr(model.casadi, name), s)
        )
        for name in functions_of(model)
        if not is_derivative(model, name)
    }


@law(only="double", casadi=True)
def casadi_externals_are_the_compiled_code(model: Model, s: Case) -> Errors:
    """casadi.external on the compiled C gives the bits of the model's own call."""
    errors = {}
    for name in functions_of(model, airborne=True):
        results = casadi_outputs(
            model, name, model.casadi.external(name), s, model.casadi.parameter_vector
        )
        errors[name] = sum(
            starmap(differing, zip(outputs(model, name, s).values(), results, strict=True))
        )
    return errors
