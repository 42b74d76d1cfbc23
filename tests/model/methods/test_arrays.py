"""Every function takes any array of numbers, alone or in batches, and leaves arguments alone; what
none takes is refused by the function's name, the argument and the place.
"""

import copy
import re

import numpy as np
import pytest

import serpentail as st
from serpentail_codegen.scene.signatures.table import ALL, NEEDS
from tests.fuzz import strange
from tests.support import zoo

from ...support.rows import row
from .conftest import ARGUMENTS, CALLS, SIZES, SOUND, assert_same, call, shapes, state, states

ELSEWHERE = {"rollout", "implicit", *NEEDS}  # tested in files of their own
ONE = "forward_dynamics_external"  # on which every form and every wrong value is tried


def test_every_function_is_called_here(model):
    assert {*CALLS, *ELSEWHERE} == {*ALL, "contact_rates"}  # which no scene names
    assert repr(model) == "<serpentail.Model m2_n2: 2 x 2 links, nv = 10>"


def test_outputs_are_plain_arrays_of_the_callers_own_and_arguments_are_left_alone(model):
    for name in CALLS:
        for lead in ((), (0,), (1,), (3,)):
            with row(name, lead):
                given, other = (states(*lead, seed) if lead else state(seed) for seed in (1, 2))
                before, kept = copy.deepcopy(given), call(model, name, given)
                for output, shape in zip(kept, shapes(name), strict=True):
                    assert output.shape == lead + shape
                    assert output.dtype == np.float64 and np.isfinite(output).all()
                    assert not output.ndim or (output.flags.carray and output.flags.writeable)
                copies = copy.deepcopy(kept)
                for output in call(model, name, other):
                    if output.ndim:
                        output[...] = np.nan
                assert_same(kept, copies)
                assert_same(call(model, name, given), copies)
                assert_same(given.values(), before.values())


def test_batch_is_its_states_one_by_one(model):
    """And single states are repeated over a batch."""
    for name in CALLS:
        for count, apart in ((1, 1), (500, 97)):
            batch = states(count)
            found = call(model, name, batch)
            for k in range(0, count, apart):
                with row(name, count, k):
                    alone = call(model, name, {key: rows[k] for key, rows in batch.items()})
                    assert_same([output[k] for output in found], alone)
    batch, one = states(5), state(seed=2)
    for name, arguments in ARGUMENTS.items():
        for varied in arguments:
            with row(name, varied):
                mixed = one | {varied: batch[varied]}
                repeated = {key: np.broadcast_to(mixed[key], (5, SIZES[key])) for key in arguments}
                assert_same(call(model, name, mixed), call(model, name, repeated))


def test_neither_layout_nor_type_matters(model):
    """Every kind for one function, one kind for every function."""
    types = (np.float32, np.float16, np.int64, np.int8, np.uint16)
    whole = {key: np.arange(1.0, 1 + size) % 5 for key, size in SIZES.items()}
    ways = [(form, SOUND[form], given) for form in SOUND for given in (state(), states(3))]
    ways += [(each.__name__, lambda a, each=each: a.astype(each), whole) for each in types]
    ways += [("whole numbers", lambda a: a.astype(int).tolist(), whole)]
    for form, change, given in ways:
        for name in CALLS if form in ("list", "float32") else [ONE]:
            with row(form, name):
                changed = {key: change(value) for key, value in given.items()}
                assert_same(call(model, name, changed), call(model, name, given))


# What is refused


def of_arguments(rows):
    """Yield function, argument and value: the first on every argument of all, others on ONE's."""
    for k, value in enumerate(rows):
        for name in ARGUMENTS if k == 0 else [ONE]:
            for argument in ARGUMENTS[name]:
                yield name, argument, value


def refuse(model, name, arguments, words):
    """Check that arguments are refused with words after the function's name."""
    with pytest.raises(st.StateError, match=f"^{name}: {words}"):
        call(model, name, arguments)


def test_other_things_than_real_numbers_are_refused(model):
    kinds = (bool, complex, np.complex64, object, "datetime64[s]")
    values = [np.ones(11, kind) for kind in kinds]
    values += [["1.0"] * 11, [None] * 11, None, "upright", {1.0, 2.0}, [[1.0], [1.0, 2.0]]]
    for name, argument, value in of_arguments([*values, strange.Foreign()]):
        if argument == "f_ext" and value is None:
            continue  # no load
        with row(name, argument, value):
            refuse(model, name, state() | {argument: value}, f"{argument}: type .*real numbers")
    for name, argument, given in of_arguments([state(), states(5)]):
        with row(name, argument):
            masked = np.ma.masked_array(given[argument], np.zeros(given[argument].shape, bool))
            masked[..., 2] = np.ma.masked
            words = f"{argument}: {masked.size // masked.shape[-1]} masked entries"
            refuse(model, name, given | {argument: masked}, words)


def test_wrong_shape_is_named_with_the_right_one(model):
    changes = [lambda n: (n - 1,), lambda n: (n + 1,), lambda _: (), lambda _: (0,)]
    changes += [lambda n: (3, n - 1), lambda n: (n, 2), lambda n: (2, 2, n), lambda n: (n, 1)]
    for name, argument, change in of_arguments([*changes, lambda _: (1, 0)]):
        size = SIZES[argument]
        shape = change(size)
        with row(name, argument, shape):
            words = f"{argument} has shape {shape}, not ({size},) or (batch, {size})"
            refuse(model, name, state() | {argument: np.zeros(shape)}, re.escape(words))
    for counts, told in (((3, 5, 1), "1, 3, 5"), ((1, 0, 1), "0, 1")):
        of_counts = zip(("q", "v", "tau"), counts, strict=True)
        arguments = {argument: states(count)[argument] for argument, count in of_counts}
        refuse(model, "forward_dynamics", arguments, rf".*\({told}\)")
    for arguments in ([], [np.zeros(3)] * 2, [np.zeros(3)] * 12):
        with pytest.raises(TypeError, match="forward_dynamics takes q, v, tau"):
            model.kernel("forward_dynamics")(*arguments)


def test_what_gives_no_finite_result_is_named_with_its_place(model):
    for name, argument, bad in of_arguments([np.nan, np.inf, -np.inf]):
        one, batch = state(), states(9)
        one[argument][1], batch[argument][6, 2] = bad, bad
        with row(name, argument, bad):
            refuse(model, name, one, rf"{argument}\[1\]: value {bad}")
            refuse(model, name, batch, rf"{argument}\[2\] of state 6: value {bad}")
    one, batch = state(), states(9)  # whose results are beyond numbers
    one["v"] *= 1e200
    batch["v"][6] *= 1e200
    for name in ("bias_force", "forward_dynamics", "energy"):
        for arguments, where in ((one, ""), (batch, " of state 6")):
            refuse(model, name, arguments, f"the result{where} is not finite")
    norms = {0.0: "is zero", 1e-160: "has norm 1e-160", 1e200: r"has norm 1e\+200"}
    for norm, words in norms.items():
        for name in ARGUMENTS if norm == 0 else ["energy", "airborne_rates"]:
            argument = ARGUMENTS[name][0]
            where, place = {"q": (slice(3, 7), "3:7"), "x": (slice(0, 4), "0:4")}[argument]
            one, batch = state(), states(9)
            one[argument][where] = batch[argument][6, where] = 0, norm, 0, 0
            with row(name, norm):
                refuse(model, name, one, rf"the quaternion {argument}\[{place}\] {words}")
                refuse(model, name, batch, rf"the quaternion .*{place}\] of state 6 {words}")


@pytest.mark.filterwarnings("ignore::serpentail.errors.UnusualSize")
def test_indefinite_inertia_is_named():
    """A tail so long that H overflows."""
    with pytest.warns(st.UnlikeBodies, match="factor of inf"):
        parameters = {"link_inertia": (1, 1, 1), "tail_length": 1e200}
        endless = st.load(zoo.folder("m2_n2"), parameters)
    for arguments, where in ((state(), ""), (states(2), " of state 0")):
        words = f"the inertia matrix{where} is not positive definite"
        refuse(endless, "forward_dynamics", arguments, words)
