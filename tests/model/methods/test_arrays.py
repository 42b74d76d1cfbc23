"""Models: every function takes any array of numbers, alone or in batches, and refuses the rest by
name.
"""

import copy
import pickle

import numpy as np
import pytest

import serpentail as st
from serpentail_codegen.scene.signatures.table import ALL, NEEDS

from .calls import (
    CALLS,
    LINKS,
    NQ,
    NV,
    SEGMENTS,
    SIZES,
    assert_same,
    call,
    every_function,
    state,
    states,
)

ELSEWHERE = {"rollout", "implicit", *NEEDS}  # tested in files of their own


def test_every_function_is_called_here():
    assert {*CALLS, *ELSEWHERE} == {*ALL, "contact_rates"}  # which no scene names


def test_sizes(model):
    assert (model.segments, model.links, model.nq, model.nv) == (SEGMENTS, LINKS, NQ, NV)
    assert repr(model) == "<serpentail.Model tail: 2 x 1 links, nv = 10>"


@every_function
def test_outputs_are_plain_arrays(model, name):
    for count in (None, 3):
        outputs = call(model, name, state() if count is None else states(count))
        for output, shape in zip(outputs, CALLS[name][1], strict=True):
            assert output.shape == (shape if count is None else (count, *shape))
            assert output.dtype == np.float64 and np.isfinite(output).all()
            assert output.ndim == 0 or output.flags.c_contiguous


# Arrays of all kinds


@every_function
@pytest.mark.parametrize("count", [0, 1, 500])
def test_batch_is_its_states_one_by_one(model, name, count):
    batch = states(count)
    found = call(model, name, batch)
    for output, shape in zip(found, CALLS[name][1], strict=True):
        assert output.shape == (count, *shape)
    for k in range(0, count, 7):
        alone = call(model, name, {key: rows[k] for key, rows in batch.items()})
        assert_same([output[k] for output in found], alone)


@every_function
def test_single_states_are_repeated_over_a_batch(model, name):
    batch, one, names = states(5), state(seed=2), CALLS[name][0]
    for varied in names:
        mixed = one | {varied: batch[varied]}
        repeated = {key: np.broadcast_to(mixed[key], (5, SIZES[key])) for key in names}
        assert_same(call(model, name, mixed), call(model, name, repeated))


def test_batches_of_different_size_are_refused(model):
    with pytest.raises(
        st.StateError, match=r"^forward_dynamics: batch sizes differ \(1, 3, 5\): give one size$"
    ):
        model.forward_dynamics(states(3)["q"], states(5)["v"], states(1)["tau"])
    with pytest.raises(
        st.StateError, match=r"^energy: batch sizes differ \(0, 1\): give one size$"
    ):
        model.energy(states(1)["q"], states(0)["v"])


KINDS = {
    "list": lambda a: a.tolist(),
    "tuple": lambda a: tuple(map(tuple, a.tolist())) if a.ndim == 2 else tuple(a.tolist()),
    "Fortran order": np.asfortranarray,
    "strided": lambda a: np.repeat(a, 2, axis=-1)[..., ::2],
    "reversed": lambda a: a[..., ::-1].copy()[..., ::-1],
    "read-only": lambda a: np.frombuffer(a.tobytes()).reshape(a.shape),
    "big-endian": lambda a: a.astype(">f8"),
    "pickled": lambda a: pickle.loads(pickle.dumps(a)),
    "long double": lambda a: a.astype(np.longdouble),
    "matrix of a subclass": lambda a: a.view(type("Sub", (np.ndarray,), {})),
}


@every_function
@pytest.mark.parametrize("kind", KINDS)
def test_layout_does_not_matter(model, name, kind):
    for arguments in (state(), states(3)):
        changed = {key: KINDS[kind](value) for key, value in arguments.items()}
        assert_same(call(model, name, changed), call(model, name, arguments))


@every_function
@pytest.mark.parametrize("kind", [np.float32, np.float16, np.int64, np.int8, np.uint16, list])
def test_numbers_of_any_type(model, name, kind):
    whole = {key: np.arange(1, 1 + size) % 5 for key, size in SIZES.items()}
    changed = {
        key: value.tolist() if kind is list else value.astype(kind) for key, value in whole.items()
    }
    assert_same(
        call(model, name, changed),
        call(model, name, {k: v.astype(float) for k, v in whole.items()}),
    )


def test_arguments_are_left_alone(model):
    for name in CALLS:
        for arguments in (state(), states(3)):
            before = copy.deepcopy(arguments)
            call(model, name, arguments)
            assert_same(arguments.values(), before.values())


@every_function
def test_outputs_are_the_callers_own(model, name):
    for arguments, other in ((state(1), state(2)), (states(3, 1), states(3, 2))):
        kept = call(model, name, arguments)
        copies = copy.deepcopy(kept)
        for output in call(model, name, other):
            if output.ndim:
                output[...] = np.nan
        assert_same(kept, copies)
        assert_same(call(model, name, arguments), copies)
