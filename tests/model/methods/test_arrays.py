"""Every function takes any array of numbers, alone or in batches, and leaves arguments alone."""

import copy

import numpy as np
import pytest

import serpentail as st
from serpentail_codegen.scene.signatures.table import ALL, NEEDS

from ...support.rows import row
from .calls import ARGUMENTS, CALLS, SIZES, SOUND, assert_same, call, shapes, state, states

ELSEWHERE = {"rollout", "implicit", *NEEDS}  # tested in files of their own


def test_every_function_is_called_here():
    assert {*CALLS, *ELSEWHERE} == {*ALL, "contact_rates"}  # which no scene names


def test_sizes(model):
    assert (model.segments, model.links, model.nq, model.nv) == (2, 2, 11, 10)
    assert repr(model) == "<serpentail.Model m2_n2: 2 x 2 links, nv = 10>"


def test_outputs_are_plain_arrays(model):
    for name in CALLS:
        for lead in ((), (0,), (1,), (3,)):
            with row(name, lead):
                outputs = call(model, name, states(*lead) if lead else state())
                for output, shape in zip(outputs, shapes(name), strict=True):
                    assert output.shape == lead + shape
                    assert output.dtype == np.float64 and np.isfinite(output).all()
                    assert output.ndim == 0 or output.flags.c_contiguous


def test_batch_is_its_states_one_by_one(model):
    for name in CALLS:
        for count, apart in ((1, 1), (500, 97)):
            batch = states(count)
            found = call(model, name, batch)
            for k in range(0, count, apart):
                with row(name, count, k):
                    alone = call(model, name, {key: rows[k] for key, rows in batch.items()})
                    assert_same([output[k] for output in found], alone)


def test_single_states_are_repeated_over_a_batch(model):
    batch, one = states(5), state(seed=2)
    for name, arguments in ARGUMENTS.items():
        for varied in arguments:
            with row(name, varied):
                mixed = one | {varied: batch[varied]}
                repeated = {key: np.broadcast_to(mixed[key], (5, SIZES[key])) for key in arguments}
                assert_same(call(model, name, mixed), call(model, name, repeated))


def test_batches_of_different_size_are_refused(model):
    for (a, b, c), told in (((3, 5, 1), "1, 3, 5"), ((1, 0, 1), "0, 1")):
        arguments = states(a)["q"], states(b)["v"], states(c)["tau"]
        with pytest.raises(st.StateError, match=rf"^forward_dynamics: .*\({told}\)"):
            model.forward_dynamics(*arguments)


TYPES = (np.float32, np.float16, np.int64, np.int8, np.uint16)


def test_neither_layout_nor_type_matters(model):
    """Every kind for one function, one kind for every function."""
    whole = {key: np.arange(1.0, 1 + size) % 5 for key, size in SIZES.items()}
    ways = [(form, SOUND[form], given) for form in SOUND for given in (state(), states(3))]
    ways += [(each.__name__, lambda a, each=each: a.astype(each), whole) for each in TYPES]
    ways += [("whole numbers", lambda a: a.astype(int).tolist(), whole)]
    for form, change, given in ways:
        for name in CALLS if form in ("list", "float32") else ["forward_dynamics_external"]:
            with row(form, name):
                changed = {key: change(value) for key, value in given.items()}
                assert_same(call(model, name, changed), call(model, name, given))


def test_arguments_are_left_alone_and_outputs_are_the_callers_own(model):
    for name in CALLS:
        for given, other in ((state(1), state(2)), (states(3, 1), states(3, 2))):
            with row(name):
                before, kept = copy.deepcopy(given), call(model, name, given)
                copies = copy.deepcopy(kept)
                assert all(not np.ndim(o) or o.flags.writeable for o in kept)
                for output in call(model, name, other):
                    if output.ndim:
                        output[...] = np.nan
                assert_same(kept, copies)
                assert_same(call(model, name, given), copies)
                assert_same(given.values(), before.values())
