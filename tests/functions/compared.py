"""Models whose derivatives are compared, and what an error of them may be."""

import inspect

import pytest

from tests.references.metrics import equilibrated_condition
from tests.support.derivative_models import tail_name

QUICK = [(1, 3, "straight"), (2, 2, "loops"), (2, None, "loops"), (3, 2, "segments")]
SLOW = [(1, 3, "loops"), (2, 2, "straight"), (3, 4, "straight"), (3, 4, "loops")]
SLOW += [(6, 6, "loops"), (8, 16, "loops"), (1, 3, "segments"), (8, 16, "segments")]
SLOW += [(1, None, "straight"), (1, None, "loops"), (2, None, "straight"), (3, None, "loops")]
ROUNDING = 1e-12  # largest error of a block, relative
SOLVED = 1e-13  # the same for each unit of the condition number, where H is solved with


PARAMS = [
    pytest.param(size, marks=marks, id=tail_name(size))
    for sizes, marks in [(QUICK, []), (SLOW, [pytest.mark.slow])]
    for size in sizes
]


def called(model, name, state):
    """The outputs of a function at a state, by name."""
    function = getattr(model, name)
    found = function(*(state[argument] for argument in inspect.signature(function).parameters))
    names = [a["name"] for a in model.manifest["functions"][name]["outputs"]]
    return dict(zip(names, found if len(names) > 1 else (found,), strict=True))


def limit(model, name, state):
    """Largest error of a block: rounding, and what solving with H makes of it."""
    return (
        SOLVED * equilibrated_condition(model.mass_matrix(state["q"]))
        if "forward" in name
        else ROUNDING
    )
