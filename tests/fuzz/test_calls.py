"""Every function of a model answers with finite numbers or refuses, whatever it is given.
Trajectories are made, sampled anew and kept, or refused by a ValueError.
"""

import inspect

import numpy as np
import pytest
from hypothesis import strategies as some

import serpentail as st
from tests.model.methods.conftest import SOUND
from tests.motion.conftest import fields, motion
from tests.support import zoo
from tests.support.rows import row

from .conftest import answer, plain, strange

MODELS = some.sampled_from(["ground_m1_n1", "arcs1", "single"])


@some.composite
def calls(draw):
    """Return a method of a model that evaluates, with moderate arguments."""
    model = zoo.model(draw(MODELS))
    functions = model.manifest["functions"]
    name = draw(some.sampled_from(sorted(name for name in functions if hasattr(model, name))))
    ports = {port["name"]: tuple(port["shape"]) for port in functions[name]["inputs"]}
    words = inspect.signature(getattr(model, name)).parameters
    return getattr(model, name), {word: draw(plain(ports[word])) for word in words if word in ports}


def test_a_call_is_answered_or_refused(search):
    """One argument or all may be strange."""

    def law(call, wrong, every, data):
        method, arguments = call
        for k, (word, x) in enumerate(arguments.items()):
            if every or k == wrong % len(arguments):
                arguments = arguments | {word: data.draw(strange(x.shape))}
        answer(method, **arguments)

    search(law, call=calls(), wrong=some.integers(0, 5), every=some.booleans(), data=some.data())


def test_a_step_is_made_or_refused(search):
    """One argument or all may be strange; one run, or nine."""

    def law(name, many, wrong, every, steps, data):
        model = zoo.model(name)
        sizes = {"q": model.nq, "v": model.nv, "tau": model.nv - 6}
        if model.contacts:
            sizes |= {"bristles": 2 * sum(model.contacts.values()), "legs": 8}
        given = {"h": 1e-4, "steps": steps}
        for k, (word, size) in enumerate(sizes.items()):
            shape = (9, size) if many else (size,)
            given[word] = data.draw(strange(shape) if every or k == wrong else plain(shape))
        if wrong == len(sizes):
            given["h"] = data.draw(strange())
        answer(model.step, **given)

    names, steps = some.sampled_from(["ground_m1_n1", "m1_n1"]), some.sampled_from([1, 3])
    how = {"wrong": some.integers(0, 5), "every": some.booleans(), "data": some.data()}
    search(law, name=names, many=some.booleans(), steps=steps, **how)


def test_parameters_are_taken_or_refused(search):
    """What is taken gives a model that evaluates, and leaves this one as it was."""

    def law(of, which, value):
        model = zoo.model(of)
        name = [*model.parameters, "mass"][which % (len(model.parameters) + 1)]
        state = {"q": np.full(model.nq, 0.3), "v": np.full(model.nv, 0.1)}
        state["tau"] = np.zeros(model.nv - 6)
        before = model.forward_dynamics(**state)
        other = answer(model.with_parameters, **{name: value})
        if other is not None:
            answer(other.forward_dynamics, **state)
            assert np.isfinite(other.parameter_vector).all()
        answer(st.load, model.folder, {name: value}, compiled=False)
        np.testing.assert_array_equal(model.forward_dynamics(**state), before)

    search(law, of=MODELS, which=some.integers(0, 99), value=strange((3,)))


def test_models_and_loads_at_points_are_made_or_refused(search):
    def law(name, which, value):
        model = zoo.model(name)
        given = {"folder": model.folder, "parameters": {}, "profile": None, "compiled": False}
        if which in given:
            answer(st.load, **given | {which: value})
        else:
            answer(model.external_force, **{which: value})

    words = ["folder", "parameters", "profile", "compiled", "force", "moment", "tail"]
    value = strange() | strange((3,))
    search(law, name=MODELS, which=some.sampled_from(words), value=value)


# Trajectories.

REFUSED = (ValueError, st.SerpentailError)
INSIDE = some.lists(some.floats(0, 0.4), min_size=1, max_size=5, unique=True).map(sorted)


@pytest.fixture(scope="module")
def flight():
    return motion(np.linspace(0, 0.4, 21), segments=1)


def test_fields_are_taken_or_refused(flight, taken_or_refused):
    own, value = fields(flight), strange((21,)) | strange((21, 9))
    taken_or_refused(st.Trajectory, [*own, "contact"], value, own, REFUSED)


def test_the_same_numbers_make_the_same_motion(flight):
    given = {name: x for name, x in fields(flight).items() if name != "info"}
    given = {name: x.astype(np.float32).astype(float) for name, x in given.items()}
    for form, formed in (SOUND | {"single": np.float32}).items():
        found = st.Trajectory(**{name: formed(x) for name, x in given.items()})
        for name, expected in given.items():
            array = getattr(found, name)
            with row(form, name):
                np.testing.assert_array_equal(array, expected)
                assert type(array) is np.ndarray and array.flags.c_contiguous


def test_new_samples_are_one_by_one_what_they_are_together(flight, search):
    def law(times, odd):
        answer(flight.resample, odd, refusals=REFUSED)
        together = answer(flight.resample, times)
        for k, t in enumerate(times):
            alone = answer(flight.resample, [t])
            for name in ("q", "v", "tau", "kinetic"):
                one, same = getattr(alone, name)[0], getattr(together, name)[k]
                np.testing.assert_allclose(one, same, rtol=0, atol=1e-13)

    search(law, times=INSIDE, odd=strange((3,)) | some.lists(some.floats(-0.1, 0.5), max_size=5))


def test_names_of_files_are_taken_or_refused(flight, search, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    names = some.text(some.characters(codec="utf-8", exclude_characters="/"), max_size=300)

    def law(method, name):
        found = answer(getattr(flight, method), name, refusals=(*REFUSED, TypeError))
        assert found is None or found.stat().st_size > 100
        if found is not None and method == "save":
            np.testing.assert_array_equal(st.Trajectory.load(found).q, flight.q)
        assert {p.resolve().parent for p in tmp_path.iterdir()} <= {tmp_path.resolve()}

    methods = some.sampled_from(["save", "to_csv", "to_netcdf"])
    search(law, method=methods, name=names | some.none() | some.integers())
