"""Checks of what users give: what is sound comes back, all else is refused in one idiom."""

import numpy as np
import pytest

from serpentail.checks import (
    Refusals,
    did_you_mean,
    finite_array,
    number,
    numbers,
    one_of,
    real_array,
    shown,
    whole_number,
)
from serpentail.errors import PlanningError, StateError
from tests.support.rows import row

BAD = [  # what is checked, how, and the value and the need that the error names
    (number, ["600"], {"above": 0}, "'600'.*above 0.*remove the quotes"),
    (number, ["short"], {}, "'short'.*not a text$"),
    (number, [True], {}, "True.*finite"),
    (number, [[1.0]], {}, r"\[1.0\].*finite"),
    (number, [np.nan], {}, "nan.*finite"),
    (number, [0], {"above": 0}, "0.*above 0$"),
    (number, [0.0], {"above": 0}, "0.*above 0$"),
    (number, [np.inf], {"above": 0}, "inf.*above 0$"),
    (number, [-1], {"least": 0}, "-1.*from 0$"),
    (number, [1.5], {"least": 0, "most": 1}, "1.5.*from 0 to 1$"),
    (numbers, ["1", 3], {}, "'1'.*one or 3.*remove the quotes"),
    (numbers, [[1, 2], 3], {}, r"\[1, 2\].*one or 3 finite"),
    (numbers, [-1, 3], {"least": 0}, "-1.*one or 3.*from 0$"),
    (numbers, [[1, 2, 9], 3], {"most": 5}, r"9\].*finite numbers to 5$"),
    (whole_number, ["2"], {"least": 1, "most": 9}, "'2'.*from 1 to 9.*remove the quotes"),
    (whole_number, [0], {"least": 1, "most": 9}, "0.*from 1 to 9$"),
    (whole_number, [10], {"least": 1, "most": 9}, "10.*from 1 to 9$"),
    (whole_number, [True], {"least": 0, "most": 9}, "True"),
    (whole_number, [2.0], {"least": 1, "most": 9}, "2.0"),
    (real_array, [["a"]], {}, "type <U1"),
    (real_array, [np.ma.masked_array([1.0, 2.0], [True, False])], {}, "1 masked"),
    (finite_array, [[[1, np.inf]]], {}, r"\[0, 1\].*inf"),
    (finite_array, [np.nan], {}, "nan"),
    (one_of, ["lnks", ["links"]], {}, "'lnks'.*mean 'links'"),
    (one_of, ["q", ["a", "b"]], {}, "'q'.*'a' or 'b'"),
    (one_of, [1, ["a", "b"]], {}, "1.*'a' or 'b'"),
]


def test_what_is_wrong_is_named_with_its_value_and_what_is_needed():
    for check, arguments, bounds, words in BAD:
        with row(check.__name__, *arguments), pytest.raises(PlanningError, match=f"^x.*{words}"):
            check("x", *arguments, PlanningError, **bounds)


def test_what_is_sound_comes_back():
    assert number("x", np.float32(2), ValueError, above=0) == 2.0
    assert number("x", 0, ValueError, least=0) == number("x", 0.0, ValueError, least=0) == 0.0
    assert number("x", 1, ValueError, most=1) == number("x", 1.0, ValueError, most=1) == 1.0
    assert [whole_number("x", k, ValueError, least=1, most=9) for k in (1, np.int8(9))] == [1, 9]
    np.testing.assert_array_equal(numbers("x", 2, 3, ValueError), [2.0, 2.0, 2.0])
    np.testing.assert_array_equal(numbers("x", [0, 2, 3], 3, ValueError, least=0), [0, 2, 3])
    assert np.isnan(real_array("x", [np.nan])).all()
    whole = np.ones(2)
    assert real_array("x", whole) is whole
    assert real_array("x", [1, 2]).dtype == finite_array("x", [[1, 2]]).dtype == np.float64
    assert one_of("x", "a", {"a": 1}, ValueError) == "a"
    assert did_you_mean("zzz", ["links"]) == did_you_mean(1, ["links"]) == ""


def test_values_are_shown_on_one_line_that_is_not_long():
    assert shown("a\nb") == repr("a\nb") and shown(np.zeros((2, 1))) == "array([[0.], [0.]])"
    assert [len(shown("x" * k)) for k in (198, 199)] == [200, 200]
    assert shown("x" * 198).endswith("x'") and shown("x" * 199).endswith("...")
    assert shown(10**5000) == "of type int, too long to show"


def test_refusals_tell_all_parts_at_once_and_try_none_twice():
    found = Refusals(PlanningError)
    found.tell()  # nothing is wrong yet
    assert found.attempt("first", number, "first", 2, StateError) == 2.0
    for part, value in [("second", "a"), ("third", np.nan), ("second", 1)]:
        assert found.attempt(part, number, part, value, StateError) is None
    with pytest.raises(PlanningError, match=r"^second.*'a'.*\nthird.*nan.*number$"):
        found.tell()
