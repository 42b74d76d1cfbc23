"""What no function takes is refused by the function's name, the argument and the place."""

import re

import numpy as np
import pytest

import serpentail as st
from tests.support import zoo

from ...support.rows import row
from .calls import ARGUMENTS, NQ, NT, SIZES, assert_close, assert_same, call, state, states

ONE = "forward_dynamics_external"  # on which every wrong value is tried


class Foreign:
    """An array of another package that NumPy cannot read, as casadi.SX is."""

    def __array__(self, *_args, **_options):
        raise Exception("no numbers in here")


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
    values = [np.ones(NQ, kind) for kind in kinds]
    values += [["1.0"] * NQ, [None] * NQ, None, "upright", {1.0, 2.0}, [[1.0], [1.0, 2.0]]]
    for name, argument, value in of_arguments([*values, Foreign()]):
        if argument == "f_ext" and value is None:
            continue  # no load
        with row(name, argument, value):
            refuse(model, name, state() | {argument: value}, f"{argument}: type .*real numbers")


def test_masked_entries_are_refused_and_counted(model):
    for name, argument, given in of_arguments([state(), states(5)]):
        with row(name, argument):
            masked = np.ma.masked_array(given[argument], np.zeros(given[argument].shape, bool))
            whole = call(model, name, given | {argument: masked})
            assert_same(whole, call(model, name, given))
            masked[..., 2] = np.ma.masked
            count = masked.size // masked.shape[-1]
            words = f"{argument}: {count} masked entries"
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


def test_a_wrong_number_of_arguments(model):
    for arguments in ([], [np.zeros(3)] * 2, [np.zeros(3)] * 12):
        with pytest.raises(TypeError, match="forward_dynamics takes q, v, tau"):
            model.kernel("forward_dynamics")(*arguments)


def test_not_finite_entry_is_named_with_its_place(model):
    for name, argument, bad in of_arguments([np.nan, np.inf, -np.inf]):
        one, batch = state(), states(9)
        one[argument][1], batch[argument][6, 2] = bad, bad
        with row(name, argument, bad):
            refuse(model, name, one, rf"{argument}\[1\]: value {bad}")
            refuse(model, name, batch, rf"{argument}\[2\] of state 6: value {bad}")


def test_quaternion_without_direction_is_named(model):
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


def test_quaternion_may_have_any_norm(model):
    arguments = state()
    unit = arguments["q"].copy()
    unit[3:7] /= np.linalg.norm(unit[3:7])
    for factor in (-1.0, 2.0**-40, 3.7, 1e-100, 1e100):
        scaled = unit.copy()
        scaled[3:7] *= factor
        for name in ARGUMENTS:
            with row(name, factor):
                found, expected = (call(model, name, arguments | {"q": q}) for q in (scaled, unit))
                assert_close(found, expected, 1e-11, 1e-13)


def test_model_works_on_after_a_refusal(model):
    expected = call(model, "forward_dynamics", state())
    for bad in ({"q": np.zeros(NQ)}, {"tau": np.full(NT, np.nan)}, {"v": "no"}):
        refuse(model, "forward_dynamics", state() | bad, "")
        assert_same(call(model, "forward_dynamics", state()), expected)


@pytest.mark.filterwarnings("ignore::serpentail.errors.UnusualSize")
def test_indefinite_inertia_is_named():
    """A tail so long that H overflows."""
    with pytest.warns(st.UnlikeBodies, match="factor of inf"):
        parameters = {"link_inertia": (1, 1, 1), "tail_length": 1e200}
        endless = st.load(zoo.folder("m2_n2"), parameters)
    for arguments, where in ((state(), ""), (states(2), " of state 0")):
        words = f"the inertia matrix{where} is not positive definite"
        refuse(endless, "forward_dynamics", arguments, words)


def test_result_beyond_numbers_is_named(model):
    one, batch = state(), states(9)
    one["v"] *= 1e200
    batch["v"][6] *= 1e200
    for name in ("bias_force", "forward_dynamics", "energy"):
        for arguments, where in ((one, ""), (batch, " of state 6")):
            refuse(model, name, arguments, f"the result{where} is not finite")
