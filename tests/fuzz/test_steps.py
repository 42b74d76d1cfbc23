"""`model.step` answers with finite numbers or refuses, whatever it is given."""

import pytest
from hypothesis import strategies as some

from ..simulation.rollouts.many import rat, tail
from .searching import answer
from .strange import plain, strange

MODELS = {"flight": tail, "ground": rat}


@pytest.mark.parametrize("kind", MODELS)
def test_a_step_is_made_or_refused(search, kind):
    """One argument or all may be strange; one run, or nine."""
    model = MODELS[kind]()
    sizes = {"q": model.nq, "v": model.nv, "tau": 2 * model.segments}
    if model.contacts:
        sizes |= {"bristles": 2 * sum(model.contacts.values()), "legs": 8}

    def law(data, many, wrong, every, steps):
        given = {"h": 1e-4, "steps": steps}
        for k, (name, size) in enumerate(sizes.items()):
            shape = (9, size) if many else (size,)
            odd = every or k == wrong
            given[name] = data.draw(strange(shape) if odd else plain(shape))
        if wrong == len(sizes):
            given["h"] = data.draw(strange())
        answer(model.step, **given)

    search(
        law,
        data=some.data(),
        many=some.booleans(),
        wrong=some.integers(0, len(sizes)),
        every=some.booleans(),
        steps=some.sampled_from([1, 3]),
    )
