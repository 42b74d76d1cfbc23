"""Every function of a model answers with finite numbers or refuses, whatever it is given; the same
numbers give the same bits in whatever form they come; a batch is its single calls.
"""

import inspect

import numpy as np
import pytest
from hypothesis import assume
from hypothesis import strategies as some

import serpentail as st
from tests.support.models import model_folder

from .searching import answer, outputs
from .strange import FORMS, plain, strange

SCENES = {
    "links": (2, 1, {"functions": "all", "contacts": ["feet", "tail", "torso"]}),
    "arcs": (1, None, {"functions": "all"}),
    "floats": (1, 1, {"functions": ["forward_dynamics", "energy"], "real": "float"}),
}
CLOSE = {np.float64: 1e-9, np.float32: 2e-3}  # of a batch to its states, of the largest number


@pytest.fixture(scope="module", params=SCENES)
def model(request):
    segments, links, options = SCENES[request.param]
    return st.load(model_folder(segments, links, **options))


def functions(model):
    """Methods of a model that evaluate: name -> shapes of their arguments."""
    found = {}
    for name, entry in model.manifest["functions"].items():
        shapes = {port["name"]: tuple(port["shape"]) for port in entry["inputs"]}
        if callable(getattr(model, name, None)):
            words = inspect.signature(getattr(model, name)).parameters
            found[name] = {word: shapes[word] for word in words if word in shapes}
    return found


def calls(model, value):
    """Strategies of a function's name with arguments, each by a strategy of its shape."""
    return some.sampled_from(sorted(functions(model).items())).flatmap(
        lambda entry: some.tuples(
            some.just(entry[0]),
            some.fixed_dictionaries({name: value(shape) for name, shape in entry[1].items()}),
        )
    )


def upright(arguments):
    """Refuse examples whose quaternion has no direction."""
    q = np.asarray(arguments.get("q", np.ones(7)))
    assume((np.linalg.norm(q[..., 3:7], axis=-1) > 1e-2).all())


def test_a_call_is_answered_or_refused(model, search):
    """One argument or all may be strange."""

    def law(call, wrong, every):
        name, arguments = call
        for k, word in enumerate(arguments):
            if every or k == wrong[0] % len(arguments):
                shape = functions(model)[name][word]
                arguments = arguments | {word: wrong[1].draw(strange(shape))}
        answer(getattr(model, name), **arguments)

    search(
        law,
        call=calls(model, plain),
        wrong=some.tuples(some.integers(0, 5), some.data()),
        every=some.booleans(),
    )


@pytest.mark.parametrize("form", FORMS)
def test_the_same_numbers_give_the_same_bits(model, search, form):
    def law(call, batch):
        name, arguments = call
        upright(arguments)
        if batch:
            arguments = {word: np.stack([x, x]) for word, x in arguments.items()}
        expected = answer(getattr(model, name), **arguments)
        assume(expected is not None)
        formed = {word: FORMS[form](x) for word, x in arguments.items()}
        found = answer(getattr(model, name), **formed)
        for one, other in zip(outputs(found), outputs(expected), strict=True):
            np.testing.assert_array_equal(one, other)
            assert type(one) is type(other) and one.dtype == other.dtype

    search(law, call=calls(model, plain), batch=some.booleans())


def test_a_batch_is_its_single_calls(model, search):
    """Arguments of one state are repeated over the batch."""

    def law(call, several, count):
        name, arguments = call
        upright(arguments)
        rows = {}
        for k, (word, x) in enumerate(arguments.items()):
            rows[word] = x if k and several[k] else np.linspace(0.5, 1.5, count)[:, None] * x
        found = answer(getattr(model, name), **rows)
        assume(found is not None)
        for k in range(count):
            of_k = {word: x if x.ndim == 1 else x[k] for word, x in rows.items()}
            for one, many in zip(
                outputs(answer(getattr(model, name), **of_k)), outputs(found), strict=True
            ):
                size = max(np.abs(one).max(), 1e-12)
                near = CLOSE[many.dtype.type]
                np.testing.assert_allclose(many[k], one, rtol=near, atol=near * size)

    search(
        law,
        call=calls(model, plain),
        several=some.lists(some.booleans(), min_size=8, max_size=8),
        count=some.sampled_from([1, 2, 3, 9]),
    )


def test_parameters_are_taken_or_refused(model, search):
    """What is taken gives a model that evaluates, and leaves this one as it was."""
    q = np.array([0, 0, 0, 1.0, 0, 0, 0, *[0.3] * (model.nq - 7)])
    state = {"q": q, "v": np.full(model.nv, 0.1), "tau": np.zeros(model.nv - 6)}
    before = model.forward_dynamics(**state)

    def law(name, value):
        other = answer(model.with_parameters, **{name: value})
        if other is not None:
            answer(other.forward_dynamics, **state)
            assert np.isfinite(other.parameter_vector).all()
        answer(st.load, model.folder, {name: value}, compiled=False)
        np.testing.assert_array_equal(model.forward_dynamics(**state), before)

    search(law, name=some.sampled_from([*model.parameters, "mass"]), value=strange((3,)))


def test_models_are_loaded_or_refused(model, search):
    def law(wrong, which):
        given = {"folder": model.folder, "parameters": {}, "profile": None, "compiled": False}
        answer(st.load, **given | {which: wrong})

    some_word = some.sampled_from(["folder", "parameters", "profile", "compiled"])
    search(law, wrong=strange(), which=some_word)


def test_loads_at_points_are_taken_or_refused(model, search):
    def law(which, value):
        answer(model.external_force, **{which: value})

    search(law, which=some.sampled_from(["force", "moment", "tail"]), value=strange((3,)))


def test_unknown_words_and_too_many_are_type_errors(model):
    for name, shapes in functions(model).items():
        with pytest.raises(TypeError):
            getattr(model, name)(*[np.zeros(3)] * (len(shapes) + 3))
        with pytest.raises(TypeError):
            getattr(model, name)(nothing=1)
