"""Models: every function takes any array of numbers, alone or in batches, and refuses the rest by
name.
"""

import numpy as np
import pytest

import serpentail as st

from .calls import CALLS, NQ, NT, SIZES, assert_same, call, every_function, folder, state, states

# What is refused


class Foreign:
    """An array of another package that NumPy cannot read, as casadi.SX is."""

    def __array__(self, *_args, **_options):
        raise Exception("no numbers in here")


@every_function
@pytest.mark.parametrize(
    "value",
    [
        np.ones(NQ, bool),
        np.ones(NQ, complex),
        np.ones(NQ, np.complex64),
        np.ones(NQ, object),
        ["1.0"] * NQ,
        [None] * NQ,
        None,
        "upright",
        {1.0, 2.0},
        [[1.0], [1.0, 2.0]],
        np.ones(NQ, "datetime64[s]"),
        Foreign(),
    ],
    ids=lambda value: type(value).__name__,
)
def test_other_things_than_real_numbers_are_refused(model, name, value):
    for argument in CALLS[name][0]:
        if argument == "f_ext" and value is None:
            continue  # no load
        with pytest.raises(
            st.StateError, match=f"^{name}: {argument}: type .*: needs real numbers"
        ):
            call(model, name, state() | {argument: value})


@every_function
def test_masked_entries_are_refused_and_counted(model, name):
    for argument in CALLS[name][0]:
        for given in (state(), states(5)):
            masked = np.ma.masked_array(given[argument], np.zeros(given[argument].shape, bool))
            whole = call(model, name, given | {argument: masked})
            masked[..., 2] = np.ma.masked
            with pytest.raises(
                st.StateError, match=f"^{name}: {argument}: . masked entries: needs"
            ):
                call(model, name, given | {argument: masked})
            assert_same(whole, call(model, name, given))


@every_function
def test_wrong_shape_is_named_with_the_right_one(model, name):
    for argument in CALLS[name][0]:
        size = SIZES[argument]
        for shape in [
            (),
            (0,),
            (size - 1,),
            (size + 1,),
            (3, size - 1),
            (size, 2),
            (2, 2, size),
            (size, 1),
            (1, 0),
        ]:
            with pytest.raises(st.StateError) as caught:
                call(model, name, state() | {argument: np.zeros(shape)})
            assert (
                str(caught.value)
                == f"{name}: {argument} has shape {shape}, not ({size},) or (batch, {size})"
            )


@every_function
@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_not_finite_entry_is_named_with_its_place(model, name, bad):
    for argument in CALLS[name][0]:
        one, batch = state(), states(9)
        one[argument][5 % NT], batch[argument][6, 2] = bad, bad
        with pytest.raises(st.StateError) as caught:
            call(model, name, one)
        assert (
            str(caught.value) == f"{name}: {argument}[{5 % NT}]: value {bad}: needs a finite number"
        )
        with pytest.raises(st.StateError) as caught:
            call(model, name, batch)
        assert (
            str(caught.value)
            == f"{name}: {argument}[2] of state 6: value {bad}: needs a finite number"
        )


@every_function
@pytest.mark.parametrize(
    ("norm", "words"), [(0.0, "is zero"), (1e-160, "has norm 1e-160"), (1e200, "has norm 1e+200")]
)
def test_quaternion_without_direction_is_named(model, name, norm, words):
    one, batch = state(), states(9)
    argument = CALLS[name][0][0]
    where_it_is, place = {"q": (slice(3, 7), "3:7"), "x": (slice(0, 4), "0:4")}[argument]
    one[argument][where_it_is] = batch[argument][6, where_it_is] = 0, norm, 0, 0
    for arguments, where in ((one, ""), (batch, " of state 6")):
        with pytest.raises(st.StateError) as caught:
            call(model, name, arguments)
        assert (
            str(caught.value)
            == f"{name}: the quaternion {argument}[{place}]{where} {words}: upright is (1, 0, 0, 0)"
        )


@every_function
@pytest.mark.parametrize("factor", [-1.0, 2.0**-40, 3.7, 1e-100, 1e100])
def test_quaternion_may_have_any_norm(model, name, factor):
    arguments = state()
    unit = arguments["q"].copy()
    unit[3:7] /= np.linalg.norm(unit[3:7])
    scaled = unit.copy()
    scaled[3:7] *= factor
    found = (call(model, name, arguments | {"q": q}) for q in (scaled, unit))
    for one, other in zip(*found, strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-11, atol=1e-13 * np.abs(other).max())


def test_model_works_on_after_a_refusal(model):
    expected = call(model, "forward_dynamics", state())
    for bad in ({"q": np.zeros(NQ)}, {"tau": np.full(NT, np.nan)}, {"v": "no"}):
        with pytest.raises(st.StateError):
            call(model, "forward_dynamics", state() | bad)
        assert_same(call(model, "forward_dynamics", state()), expected)


@pytest.mark.filterwarnings("ignore::serpentail.errors.UnusualSize")
def test_indefinite_inertia_is_named():
    """A tail so long that H overflows."""
    with pytest.warns(st.UnlikeBodies, match="differ by a factor of inf"):
        endless = st.load(folder(), {"link_inertia": (1, 1, 1), "tail_length": 1e200})
    words = (
        "forward_dynamics: the inertia matrix{} is not positive definite: is a value too large, or "
        "a parameter"
    )
    for arguments, where in ((state(), ""), (states(2), " of state 0")):
        with pytest.raises(st.StateError, match=f"^{words.format(where)}"):
            call(endless, "forward_dynamics", arguments)


@pytest.mark.parametrize("name", ["bias_force", "forward_dynamics", "energy"])
def test_result_beyond_numbers_is_named(model, name):
    one, batch = state(), states(9)
    one["v"] *= 1e200
    batch["v"][6] *= 1e200
    for arguments, where in ((one, ""), (batch, " of state 6")):
        with pytest.raises(
            st.StateError, match=f"^{name}: the result{where} is not finite: is a value too large"
        ):
            call(model, name, arguments)
