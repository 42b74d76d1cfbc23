"""Calls through the extension give what calls through ctypes give, and leave nothing behind."""

import copy
import gc
import os
import subprocess
import sys
import sysconfig
import tracemalloc
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

import serpentail as st
from serpentail.compiling.toolchain import candidates
from serpentail.model import fast_call as calls
from serpentail.model import kernel
from tests.support import zoo

from ...support.rows import row
from .conftest import ARGUMENTS, CALLS, FORMS, assert_same, call, state, states

HEADERS = Path(sysconfig.get_path("include"))


def by_ctypes(model):
    plain = copy.copy(model)
    for each in plain.kernels.values():
        each.fast = calls.no_call
    return plain


def answer(model, name, arguments):
    """What a call comes to: outputs with their types, or the words of the error."""
    try:
        outputs = call(model, name, arguments)
    except Exception as error:
        return type(error), str(error)
    return [(type(o), o.dtype, o.shape, o.flags.writeable, o.tobytes()) for o in outputs]


def test_both_ways_give_the_same_bits_and_words(model):
    """The fast one takes matching arrays and no others."""
    s = state()
    model.energy(s["q"], s["v"])
    fast, there = model.kernels["energy"].fast, calls.extension() is not None
    assert (fast(s["q"], s["v"]) is not None) == there and fast(s["q"], [0] * 10) is None
    single, floats = st.load(zoo.folder("single")), {k: np.float32(a) for k, a in state().items()}
    for each, givens in ((model, (state(), states(1), states(3))), (single, (state(), floats))):
        plain = by_ctypes(each)
        for name in CALLS:
            for given in givens:
                for form, change in FORMS.items():
                    changed = {key: change(array) for key, array in given.items()}
                    alone = ARGUMENTS[name] if given["q"].ndim == 1 else []
                    for arguments in (changed, *(given | {one: changed[one]} for one in alone)):
                        with row(each, name, given["q"].shape, form):
                            assert answer(each, name, arguments) == answer(plain, name, arguments)


def test_calls_hold_neither_results_nor_arguments_and_leave_nothing_in_memory(model):
    """Not those that pass, are declined or fail, nor those of models that come and go."""
    given = state()
    counts = [sys.getrefcount(array) for array in given.values()]
    for name in CALLS:
        for _ in range(100):
            outputs = call(model, name, given)
        assert all(not np.ndim(o) or o.base is None for o in outputs), name
    assert [sys.getrefcount(array) for array in given.values()] == counts
    s, other = state(), state()["q"].astype("datetime64[s]")

    def work(times):
        for k in range(times):
            model.forward_dynamics(s["q"], s["v"], s["tau"])
            model.energy(s["q"], s["v"])
            model.momentum(s["q"], FORMS["spread"](s["v"]))
            if k % 100 == 0:
                for wrong in (other, 0 * s["q"]):
                    with pytest.raises(st.StateError):
                        model.energy(wrong, s["v"])
        return now()

    def now():
        """Bytes that Python holds, and pages of the process."""
        gc.collect()
        pages = Path("/proc/self/statm").read_text().split()[1]
        return np.array([tracemalloc.get_traced_memory()[0], int(pages)])

    tracemalloc.start()
    try:
        work(1000)
        grown = -work(1000) + work(5000)
    finally:
        tracemalloc.stop()
    assert grown[0] < 5000  # of each call less than one
    grown -= now()
    for _ in range(300):
        copy.copy(model).energy(s["q"], s["v"])
    assert (grown + now())[1] * os.sysconf("SC_PAGE_SIZE") < 1_000_000


def test_a_call_keeps_what_it_works_on_and_may_run_within_a_call(model):
    """Threads that make a kernel's first call at once each make what calls; one of them stays.

    Garbage that is collected while outputs are copied may run a call of the same function.
    """
    (a, b), function = (state(1), state(2)), copy.copy(model).kernel("energy")
    outer, inner = (model.energy(s["q"], s["v"]) for s in (a, b))
    first, second = function._prepared(), function._prepared()
    assert first is not second and function.fast is second
    del function
    gc.collect()
    filler = [np.full(size, np.nan) for size in range(1, 40) for _ in range(200)]
    assert first(a["q"], a["v"]) == second(a["q"], a["v"]) == outer and filler
    found, within = [], []

    def collected(phase, _):
        if phase == "start" and not within:
            within.append(True)
            found.append(model.energy(b["q"], b["v"]))
            within.clear()

    thresholds = gc.get_threshold()
    gc.callbacks.append(collected)
    gc.set_threshold(1)
    try:
        around = {model.energy(a["q"], a["v"]) for _ in range(200)}
    finally:
        gc.set_threshold(*thresholds)
        gc.callbacks.remove(collected)
    assert {*found} == {inner} and around == {outer}


def test_threads_share_a_model(model):
    """By ctypes other threads run while C does."""
    rows = list(zip(*map(states(300).get, ("q", "v", "tau")), strict=True))
    expected, usual = [model.forward_dynamics(*each) for each in rows], sys.getswitchinterval()
    sys.setswitchinterval(1e-6)  # as often as can be
    try:
        for function in (each.forward_dynamics for each in (model, by_ctypes(model))):
            with ThreadPoolExecutor(8) as pool:
                found = pool.map(function, *zip(*(8 * rows), strict=True))
                np.testing.assert_array_equal(list(found), 8 * expected)
    finally:
        sys.setswitchinterval(usual)


def test_where_it_cannot_be_had_or_calls_are_long_ctypes_serves(model, monkeypatch, tmp_path):
    assert (calls.extension() is not None) == (HEADERS / "Python.h").is_file()
    monkeypatch.setenv("SERPENTAIL_CACHE", str(tmp_path))
    for change in (
        lambda changed: changed.setattr(sysconfig, "get_path", lambda _: str(tmp_path)),
        lambda changed: changed.setattr(sysconfig, "get_config_var", lambda _: 1),
        lambda changed: changed.setenv("CC", "false"),
    ):
        with monkeypatch.context() as changed:
            change(changed)
            assert calls.extension.__wrapped__() is None
    for owner, name, lack in ((calls, "extension", lambda: None), (kernel, "MOST_UNDER_LOCK", 0)):
        monkeypatch.setattr(owner, name, lack)
        other = copy.copy(model)
        for function in CALLS:
            with row(name, function):
                found = call(other, function, state())
                call(other, function, state(2))
                assert_same(found, call(model, function, state()))
                assert other.kernels[function].fast is calls.no_call
        monkeypatch.undo()
    # it compiles without warnings
    flags = ("-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Werror", "-c")
    places = ("-isystem", HEADERS, calls.SOURCE, "-o", tmp_path / "calls.o")
    command = [*next(iter(candidates())), *flags, *places]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
