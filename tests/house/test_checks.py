"""Checks of what users give: what is sound comes back, all else is refused in one idiom."""

import numpy as np
import pytest

from serpentail import checks


@pytest.mark.parametrize(
    ("check", "words"),
    [
        (
            lambda e: checks.number("x", "600", e, above=0),
            "x: value '600': needs a number above 0, not a text: remove the quotes",
        ),
        (
            lambda e: checks.number("x", "short", e),
            "x: value 'short': needs a finite number, not a text",
        ),
        (
            lambda e: checks.numbers("x", "1", 3, e),
            "x: value '1': needs one or 3 finite numbers, not a text: remove the quotes",
        ),
        (
            lambda e: checks.whole_number("x", "2", e, least=1, most=9),
            "x: value '2': needs a whole number from 1 to 9, not a text: remove the quotes",
        ),
        (lambda e: checks.number("x", True, e), "x: value True: needs a finite number"),
        (lambda e: checks.number("x", [1.0], e), "x: value [1.0]: needs a finite number"),
        (lambda e: checks.number("x", np.nan, e), "x: value nan: needs a finite number"),
        (lambda e: checks.number("x", 0, e, above=0), "x: value 0: needs a number above 0"),
        (lambda e: checks.number("x", np.inf, e, above=0), "x: value inf: needs a number above 0"),
        (lambda e: checks.number("x", -1, e, least=0), "x: value -1: needs a number from 0"),
        (
            lambda e: checks.numbers("x", [1, 2], 3, e),
            "x: value [1, 2]: needs one or 3 finite numbers",
        ),
        (
            lambda e: checks.numbers("x", -1, 3, e, least=0),
            "x: value -1: needs one or 3 numbers from 0",
        ),
        (lambda e: checks.real_array("x", ["a"], e), "x: type <U1: needs real numbers"),
        (
            lambda e: checks.finite_array("x", [[1, np.inf]], e),
            "x[0, 1]: value inf: needs a finite number",
        ),
        (lambda e: checks.finite_array("x", np.nan, e), "x: value nan: needs a finite number"),
        (
            lambda e: checks.one_of("x", "lnks", ["links"], e),
            "x: value 'lnks': did you mean 'links'?",
        ),
        (lambda e: checks.one_of("x", "q", ["a", "b"], e), "x: value 'q': needs 'a' or 'b'"),
        (lambda e: checks.one_of("x", 1, ["a", "b"], e), "x: value 1: needs 'a' or 'b'"),
    ],
)
@pytest.mark.parametrize("error", [ValueError, KeyError])
def test_what_is_wrong_is_named_with_its_remedy(check, words, error):
    with pytest.raises(error) as caught:
        check(error)
    assert caught.value.args == (words,)


def test_what_is_sound_comes_back():
    assert checks.number("x", np.float32(2), ValueError, above=0) == 2.0
    assert checks.number("x", 0, ValueError, least=0) == 0.0
    np.testing.assert_array_equal(checks.numbers("x", 2, 3, ValueError), [2.0, 2.0, 2.0])
    np.testing.assert_array_equal(checks.numbers("x", [1, 2, 3], 3, ValueError), [1.0, 2.0, 3.0])
    assert np.isnan(checks.real_array("x", [np.nan])).all()
    assert checks.finite_array("x", [[1, 2]]).dtype == np.float64
    assert checks.one_of("x", "a", {"a": 1}, ValueError) == "a"
    assert checks.did_you_mean("zzz", ["links"]) == ""
