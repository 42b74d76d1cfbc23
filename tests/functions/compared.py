"""Models whose derivatives are compared, and what an error of them may be."""

from functools import cache

import pytest

from tests.references.metrics import equilibrated_condition
from tests.support import zoo

QUICK = ["m1_n3", "segments", "arcs2_loops"]
SLOW = ["straight", "loops", "lanes", "m3_n4", "arcs1", "arcs3", "own_links", "own_arcs", "mixed"]
ROUNDING = 1e-12  # largest error of a block, relative
SOLVED = 1e-13  # the same for each unit of the condition number, where H is solved with


def marked(more=(), quick=()):
    """Names of models as parameters of a test; most of them are slow."""
    return [
        pytest.param(name, marks=() if name in (*QUICK, *quick) else pytest.mark.slow)
        for name in (*QUICK, *SLOW, *more)
    ]


@cache
def model_of(name):
    """A model; the stops of a passive tail stiffen on so long a way that states are on it."""
    model = zoo.model(name)
    return model.with_parameters(tail_stop_width=1.0) if "elastic" in name else model


def called(model, name, state):
    """The outputs of a function at a state, by name."""
    arguments = [each["name"] for each in model.manifest["functions"][name]["inputs"]]
    found = getattr(model, name)(*(state[argument] for argument in arguments))
    names = [a["name"] for a in model.manifest["functions"][name]["outputs"]]
    return dict(zip(names, found if len(names) > 1 else (found,), strict=True))


def limit(model, name, state):
    """Largest error of a block: rounding, and what solving with H makes of it."""
    return (
        SOLVED * equilibrated_condition(model.mass_matrix(state["q"]))
        if "forward" in name
        else ROUNDING
    )
