"""Every function takes any array of numbers, alone or in batches, and leaves arguments alone."""

import copy
import pickle

import numpy as np
import pytest

import serpentail as st
from serpentail_codegen.scene.signatures.table import ALL, NEEDS

from ...support.rows import row
from .calls import ARGUMENTS, CALLS, SIZES, assert_same, call, shapes, state, states

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
TYPES = {
    kind.__name__: lambda a, kind=kind: a.astype(kind)
    for kind in (np.float32, np.float16, np.int64, np.int8, np.uint16)
}


def test_neither_layout_nor_type_matters(model):
    """Every kind for one function, one kind for every function."""
    whole = {key: np.arange(1.0, 1 + size) % 5 for key, size in SIZES.items()}
    kinds = [(kind, KINDS[kind], given) for kind in KINDS for given in (state(), states(3))]
    kinds += [(kind, TYPES[kind], whole) for kind in TYPES]
    kinds += [("whole numbers", lambda a: a.astype(int).tolist(), whole)]
    for kind, change, given in kinds:
        for name in CALLS if kind in ("list", "float32") else ["forward_dynamics_external"]:
            with row(kind, name):
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
