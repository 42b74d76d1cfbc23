"""How laws are searched for examples that break them, what every call keeps, what users give."""

import contextlib
import copy
import datetime
import decimal
import fractions
import signal
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, configuration, given, settings
from hypothesis import strategies as some
from hypothesis.extra import numpy as arrays

import serpentail as st
from tests.support.forms import Foreign
from tests.support.models import BUILD

configuration.set_hypothesis_home_dir(BUILD / "hypothesis")  # not in the checkout

SECONDS = 30  # that one call may take


@pytest.fixture(params=["few", pytest.param("many", marks=pytest.mark.slow)])
def search(request):
    """Return a function that checks a law on examples of strategies: the same ones in every run."""
    most = 60 if request.param == "few" else 300
    how = {"derandomize": True, "database": None, "deadline": None}
    chosen = settings(max_examples=most, suppress_health_check=list(HealthCheck), **how)

    def check(law: Callable, **strategies) -> None:
        chosen(given(**strategies)(law))()

    return check


def answer(function: Callable, *arguments, refusals=(st.SerpentailError,), **more):
    """Return what a call answers, None where it refuses; it must do one of both in time, give
    finite numbers or words, and leave its arguments as they were.
    """
    before = kept((arguments, more))
    try:
        with in_time(), warnings.catch_warnings():
            warnings.simplefilter("ignore", st.UnlikeBodies)
            warnings.simplefilter("ignore", st.UnusualSize)
            found = function(*arguments, **more)
    except refusals as refusal:
        assert str(refusal).strip(), f"{type(refusal).__name__} says nothing"
        found = None
    # by their text, in which nan equals nan
    assert repr(kept((arguments, more))) == repr(before), "an argument was changed"
    assert finite(found), f"not finite: {found!r:.300}"
    return found


@contextlib.contextmanager
def in_time() -> Iterator[None]:
    """Refuse to wait for ever."""

    def late(*_):
        raise AssertionError(f"no answer in {SECONDS} s")

    usual = signal.signal(signal.SIGALRM, late)
    signal.setitimer(signal.ITIMER_REAL, SECONDS)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, usual)


def kept(thing):
    """Return what a thing holds: of arrays the bytes, also of the array that a view looks at."""
    if isinstance(thing, np.ndarray):
        base = thing.base if isinstance(thing.base, np.ndarray) else thing
        told = (thing.shape, thing.strides, thing.dtype, thing.flags.writeable)
        return (*told, repr(base.tolist()) if base.dtype == object else base.tobytes())
    if isinstance(thing, dict):
        return [(key, kept(value)) for key, value in thing.items()]
    if isinstance(thing, list | tuple):
        return [kept(entry) for entry in thing]
    return copy.copy(thing) if isinstance(thing, set | bytearray) else thing


def finite(thing) -> bool:
    """Tell if all numbers of a result are finite."""
    if isinstance(thing, st.Trajectory):
        thing = (thing.t, thing.q, thing.v, thing.tau, thing.energy, thing.angular_momentum)
    if isinstance(thing, tuple):
        return all(map(finite, thing))
    return not isinstance(thing, np.ndarray | float) or bool(np.isfinite(thing).all())


# What users give.

EXTREMES = (0.0, -0.0, 5e-324, 1e-308, 1e-160, 1e160, 1e308, np.nan, np.inf, -np.inf)
NUMBERS = some.one_of(some.floats(-3, 3), some.sampled_from(EXTREMES), some.floats())
SHAPES = arrays.array_shapes(min_dims=0, max_dims=3, min_side=0, max_side=13)


class Growing:
    """A sequence that is longer whenever it is asked."""

    count = 0

    def __len__(self):
        self.count += 1
        return self.count

    def __getitem__(self, index):
        if index > 3:
            raise IndexError
        return 0.5


def plain(shape) -> some.SearchStrategy:
    """Return arrays of doubles of moderate size, as a model takes them."""
    moderate = some.floats(-2, 2, width=32)
    return arrays.arrays(np.float64, shape, elements=moderate, fill=some.nothing())


THINGS = (
    *(Ellipsis, slice(None), range(9), Path("x"), 10**400, NotImplemented, int, len),
    *(decimal.Decimal("0.5"), fractions.Fraction(1, 3), datetime.date(2000, 1, 1)),
)
JUNK = some.one_of(
    *(some.none(), some.booleans(), some.text(max_size=4), some.binary(max_size=8), NUMBERS),
    *(some.integers(), some.integers(-(2**70), 2**70), some.complex_numbers()),
    some.lists(some.one_of(some.none(), NUMBERS, some.lists(NUMBERS, max_size=3)), max_size=13),
    some.dictionaries(some.text(max_size=2), NUMBERS, max_size=2),
    some.one_of(*map(some.builds, (set, object, Foreign, Growing))),
    some.sampled_from(THINGS),
    some.builds(lambda n: memoryview(bytes(8 * n)), some.integers(0, 13)),
    some.builds(lambda n: (x for x in range(n)), some.integers(0, 13)),
)
DTYPES = some.one_of(
    *(arrays.boolean_dtypes(), arrays.complex_number_dtypes(), arrays.datetime64_dtypes()),
    *(arrays.integer_dtypes(endianness="?"), arrays.unsigned_integer_dtypes(endianness="?")),
    arrays.floating_dtypes(endianness="?"),
    *(arrays.byte_string_dtypes(max_len=4), arrays.unicode_string_dtypes(max_len=4)),
)
ANY_ARRAY = some.one_of(
    DTYPES.flatmap(lambda dtype: arrays.arrays(dtype, SHAPES)),
    SHAPES.map(lambda shape: np.full(shape, None)),
    SHAPES.map(lambda shape: np.full(shape, 0.5, object)),
    SHAPES.map(np.ma.masked_all),
    SHAPES.map(lambda shape: np.zeros(shape, [("x", float)])),
)


def strange(shape=()) -> some.SearchStrategy:
    """Return anything: in place of an array of a shape, or of what no shape is known of."""
    wide = (3, *shape)
    holed = [
        arrays.arrays(np.float64, each, elements=NUMBERS)
        for each in (shape, wide, (*shape, 1), (0, *shape))
    ]
    return some.one_of(JUNK, ANY_ARRAY, *holed, plain(wide))
