"""Calls through the extension give what calls through ctypes give, and leave nothing behind."""

import copy
import gc
import os
import subprocess
import sys
import sysconfig
import tracemalloc
from pathlib import Path

import numpy as np
import pytest

import serpentail as st
from serpentail.model import calls, kernel
from serpentail.model.toolchain import candidates
from tests.support import zoo

from ...support.rows import row
from .calls import ARGUMENTS, CALLS, assert_same, call, state, states

HEADERS = Path(sysconfig.get_path("include"))
WARNINGS = ("-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Werror")


def by_ctypes(model):
    """The model with the extension left out."""
    plain = copy.copy(model)
    for each in plain.kernels.values():
        each.fast = calls.declined
    return plain


def answer(model, name, arguments):
    """What a call comes to: outputs with their types, or the words of the error."""
    try:
        outputs = call(model, name, arguments)
    except Exception as error:
        return type(error), str(error)
    return [(type(o), o.dtype, o.shape, o.flags.writeable, o.tobytes()) for o in outputs]


def apart(array):
    """The numbers of an array with gaps between them."""
    wide = np.full((*array.shape, 3), np.nan, array.dtype)
    wide[..., 1] = array
    return wide[..., 1]


def misaligned(array):
    """The numbers of an array where no number begins at a multiple of its size."""
    memory = np.zeros(array.nbytes + 1, np.uint8)
    memory[1:] = array.reshape(-1).view(np.uint8)
    return memory[1:].view(array.dtype).reshape(array.shape)


def locked(array):
    array = array.copy()
    array.setflags(write=False)
    return array


class Subclass(np.ndarray):
    """Such as matrices are."""


FORMS = {
    "plain": np.array,
    "strided": apart,
    "backward": lambda a: a[..., ::-1].copy()[..., ::-1],
    "misaligned": misaligned,
    "read only": locked,
    "swapped": lambda a: a.astype(a.dtype.newbyteorder()),
    "single": np.float32,
    "long": np.longdouble,
    "whole": lambda a: np.rint(a).astype(np.int64) + 1,
    "list": lambda a: a.tolist(),
    "masked": np.ma.masked_array,
    "subclass": lambda a: a.view(Subclass),
    "column": lambda a: a[:, None],
    "short": lambda a: a[..., :-1],
    "long by one": lambda a: np.append(a, 0.0),
    "nothing": lambda a: a[..., :0],
    "scalar": lambda _: np.float64(1.0),
    "nan": lambda a: np.where(np.arange(a.shape[-1]) == 1, np.nan, a),
    "infinite": lambda a: np.where(np.arange(a.shape[-1]) == 1, -np.inf, a),
    "zero": np.zeros_like,
    "huge": lambda a: 1e200 * a,
    "complex": lambda a: a + 0j,
    "times": lambda a: a.astype("datetime64[s]"),
    "text": lambda a: a.astype(str),
    "objects": lambda a: a.astype(object),
    "none": lambda _: None,
}


def test_the_extension_is_there_where_python_has_headers():
    assert (calls.extension() is not None) == (HEADERS / "Python.h").is_file()


def test_both_ways_give_the_same_bits_and_words(model):
    plain = by_ctypes(model)
    for name in CALLS:
        for given in (state(), states(1), states(3)):
            single = given["q"].ndim == 1
            for form, change in FORMS.items():
                changed = {key: change(array) for key, array in given.items()}
                mixed = [given | {each: changed[each]} for each in ARGUMENTS[name] if single]
                for arguments in (changed, *mixed):
                    with row(name, given["q"].shape, form):
                        assert answer(model, name, arguments) == answer(plain, name, arguments)


def test_floats_go_both_ways():
    model = st.load(zoo.folder("single"))
    plain = by_ctypes(model)
    for name in CALLS:
        for form in (np.float32, np.array, lambda a: apart(np.float32(a)), lambda a: a[:-1]):
            changed = {key: form(array) for key, array in state().items()}
            with row(name):
                assert answer(model, name, changed) == answer(plain, name, changed)


def test_a_wrong_number_of_arguments(model):
    function = model.kernel("forward_dynamics")
    for arguments in ([], [np.zeros(3)] * 2, [np.zeros(3)] * 12):
        with pytest.raises(TypeError, match="forward_dynamics takes q, v, tau"):
            function(*arguments)


def test_neither_results_nor_arguments_are_held(model):
    given = state()
    counts = [sys.getrefcount(array) for array in given.values()]
    for name in CALLS:
        for _ in range(100):
            outputs = call(model, name, given)
        assert all(not np.ndim(o) or o.base is None for o in outputs), name
    assert [sys.getrefcount(array) for array in given.values()] == counts


def test_calls_leave_nothing_in_memory(model):
    """Not those that pass, nor those that are declined, nor those that fail."""
    s, other = state(), state()["q"].astype("datetime64[s]")

    def work(times):
        """Do so much, and return the bytes and pages that are in use then."""
        for _ in range(times):
            model.forward_dynamics(s["q"], s["v"], s["tau"])
            model.energy(s["q"], s["v"])
            model.momentum(s["q"], apart(s["v"]))
        for _ in range(times // 100):
            with pytest.raises(st.StateError):
                model.energy(other, s["v"])
            with pytest.raises(st.StateError):
                model.mass_matrix(0 * s["q"])
        gc.collect()
        return np.array([tracemalloc.get_traced_memory()[0], pages()])

    tracemalloc.start()
    try:
        work(1000)
        grown = -work(1000) + work(15_000)
    finally:
        tracemalloc.stop()
    assert grown[0] < 15_000  # bytes: of each call less than one
    assert grown[1] * os.sysconf("SC_PAGE_SIZE") < 1_000_000


def pages():
    """How many pages of memory this process has."""
    return int(Path("/proc/self/statm").read_text().split()[1])


def test_models_come_and_go(model):
    def work(times):
        for _ in range(times):
            copy.copy(model).energy(state()["q"], state()["v"])
        gc.collect()
        return pages()

    work(50)
    grown = -work(50) + work(300)
    assert grown * os.sysconf("SC_PAGE_SIZE") < 1_000_000


def test_a_call_keeps_what_it_works_on(model):
    """Threads that make a kernel's first call at once each make what calls; one of them stays."""
    s = state()
    expected = model.energy(s["q"], s["v"])
    function = copy.copy(model).kernel("energy")
    first, second = function._prepared(), function._prepared()
    assert first is not second and function.fast is second
    del function
    gc.collect()
    filler = [np.full(size, np.nan) for size in range(1, 40) for _ in range(200)]
    assert first(s["q"], s["v"]) == second(s["q"], s["v"]) == expected and filler


def test_a_call_within_a_call(model):
    """Garbage that is collected while outputs are copied may run a call of the same function."""
    a, b = state(1), state(2)
    expected = {k: model.energy(s["q"], s["v"]) for k, s in enumerate((a, b))}
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
        outer = [model.energy(a["q"], a["v"]) for _ in range(200)]
    finally:
        gc.set_threshold(*thresholds)
        gc.callbacks.remove(collected)
    assert found and set(found) == {expected[1]} and set(outer) == {expected[0]}


def test_what_works_on_much_lets_other_threads_run(model, monkeypatch):
    monkeypatch.setattr(kernel, "MOST_HELD", 0)
    other = copy.copy(model)
    assert_same(call(other, "energy", state()), call(model, "energy", state()))
    assert other.kernel("energy").fast is calls.declined


@pytest.mark.parametrize("lack", ["headers", "lock", "compiler"])
def test_where_it_cannot_be_had_ctypes_serves(model, monkeypatch, tmp_path, lack):
    monkeypatch.setenv("SERPENTAIL_CACHE", str(tmp_path))
    if lack == "headers":
        monkeypatch.setattr(sysconfig, "get_path", lambda _: str(tmp_path))
    elif lack == "lock":
        monkeypatch.setattr(sysconfig, "get_config_var", lambda _: 1)
    else:
        monkeypatch.setenv("CC", "false")
    assert calls.extension.__wrapped__() is None
    monkeypatch.setattr(calls, "extension", lambda: None)
    other = copy.copy(model)
    for name in CALLS:
        assert_same(call(other, name, state()), call(model, name, state()))
        assert other.kernels[name].fast in (calls.declined, None)


def test_it_compiles_without_warnings(tmp_path):
    made = str(tmp_path / "calls.o")
    headers = ("-isystem", str(HEADERS))
    command = (*next(iter(candidates())), *WARNINGS, *headers, "-c", str(calls.SOURCE), "-o", made)
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
