"""How laws are searched for examples that break them, few quickly and many among the slow tests,
and what every call must keep.
"""

import contextlib
import copy
import signal
import warnings
from collections.abc import Callable, Iterator

import numpy as np
import pytest
from hypothesis import HealthCheck, configuration, given, settings
from hypothesis import strategies as some

import serpentail as st
from tests.support.models import BUILD

configuration.set_hypothesis_home_dir(BUILD / "hypothesis")  # not in the checkout

SECONDS = 30  # that one call may take
REFUSALS = (st.SerpentailError,)


@pytest.fixture(params=["few", pytest.param("many", marks=pytest.mark.slow)])
def search(request):
    """Return a function that checks a law on examples of strategies: the same ones in every run."""
    chosen = settings(
        max_examples=60 if request.param == "few" else 300,
        derandomize=True,
        database=None,
        deadline=None,
        suppress_health_check=list(HealthCheck),
    )

    def check(law: Callable, **strategies) -> None:
        chosen(given(**strategies)(law))()

    return check


@pytest.fixture
def taken_or_refused(search):
    """Return a function that gives a call its usual arguments, one of them, or another, strange."""

    def check(function: Callable, names, value, usual=None, refusals=REFUSALS):
        def law(name, value):
            answer(function, refusals=refusals, **(usual or {}) | {name: value})

        search(law, name=some.sampled_from(names), value=value)

    return check


def answer(function: Callable, *arguments, refusals=REFUSALS, **more):
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
