"""Results where the caller asks for them, and the memory of large ones, which later ones take."""

import os
import warnings
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

import serpentail as st
from serpentail.model import memory
from tests.support import zoo

from ...c.batches.tails import on_ground
from ...support.forms import locked, misaligned
from ...support.rows import row
from .conftest import ARGUMENTS, CALLS, assert_same, call, shapes, state, states

LARGE = 400  # states whose inertia matrices fill more than a page, and too few to be worth lanes


def rows_of(seed=0):
    return states(LARGE, seed)["q"]


def address(array):
    return array.__array_interface__["data"][0]


def test_out_receives_what_would_be_returned(model):
    for name in CALLS:
        method = getattr(model, name.removesuffix("_external"))
        for lead in ((), (0,), (3,), (LARGE,)):
            given = states(*lead) if lead else state()
            expected = call(model, name, given)
            out = [np.full(each.shape, np.nan) for each in expected]
            whole = out if len(out) > 1 else out[0]
            with row(name, lead):
                found = method(*(given[each] for each in ARGUMENTS[name]), out=whole)
                found = found if len(out) > 1 else (found,)
                assert all(one is other for one, other in zip(found, out, strict=True))
                assert_same(out, expected)
    ground = zoo.model("ground_m2_n2")
    values = on_ground(ground, ["some"] * 3)
    given = [values[each] for each in ("q", "v", "tau", "bristles", "legs")]
    expected = ground.contact_dynamics(*given)
    out = tuple(map(np.zeros_like, expected))
    assert_same(ground.contact_dynamics(*given, out=out), out)
    assert_same(out, expected)
    x, u = np.hstack([given[0], given[1]]), given[2]
    for method in (model.x_dot, model.x_dot_derivatives):
        expected = method(x, u)
        out = [*map(np.zeros_like, expected)] if type(expected) is tuple else 0 * expected
        assert_same(method(x, u, out=out), expected)
        assert_same(out, expected)
    with pytest.raises(st.StateError, match=r"^x_dot: out: .*\(3, 21\)"):
        model.x_dot(x, u, out=np.zeros((3, 20)))


def test_what_cannot_receive_results_is_refused_and_left_alone(model):
    one = np.zeros((3, 10, 10))
    wrong = [one.tolist(), one[:2], one[0], one.astype(np.float32), np.asfortranarray(one)]
    wrong += [np.zeros((3, 10, 20))[..., ::2], locked(one), misaligned(one), one.astype(">f8"), 1]
    rows = [("mass_matrix", "out", each, "a writeable C array of float64") for each in wrong]
    three = [np.zeros((3, *shape)) for shape in shapes("forward_dynamics_derivatives")]
    for each in (three[:2], [*three, one], one, {1, 2, 3}, np.zeros((3, 3, 10, 10))):
        rows.append(("forward_dynamics_derivatives", "out", each, "a sequence of 3 arrays"))
    for k in range(3):
        each = [*three[:k], np.zeros(3), *three[k + 1 :]]
        rows.append(("forward_dynamics_derivatives", f"out[{k}]", each, "a writeable C array"))
    twice = [three[0], three[0], three[2]]
    rows.append(("forward_dynamics_derivatives", "out[1]", twice, "memory that no argument"))
    given = states(3)
    rows.append(("bias_force", "out", given["v"], "memory that no argument"))
    for name, field, out, needs in rows:
        arguments = [given[each] for each in ARGUMENTS[name]]
        with row(name, needs, out), pytest.raises(st.StateError) as told:
            getattr(model, name)(*arguments, out=out)
        assert str(told.value).startswith(f"{name}: {field}: value ") and needs in str(told.value)
    assert not np.any(one) and not any(map(np.any, three))
    assert_same([given["v"]], [states(3)["v"]])
    with pytest.raises(TypeError, match="mass_matrix takes q"):
        model.kernel("mass_matrix")(out=one)


def test_memory_of_results_that_are_gone_serves_later_ones_of_their_size(model):
    q, again = rows_of(), None
    expected = model.mass_matrix(q).copy()
    for views in (lambda a: a[3], memoryview, lambda a: a[::-1].T[0], lambda a: [a]):
        again = memory._unseen.clear()
        first = model.mass_matrix(q)
        place, view = address(first), views(first)
        del first
        again = model.mass_matrix(rows_of(2))  # somebody still sees the first
        assert address(again) != place
        assert_same([view], [views(expected)])
        del view
        assert address(model.mass_matrix(q[:-1])) != place  # of another size
        assert {address(model.mass_matrix(q)) for _ in range(20)} == {place}
        for _ in range(20):  # two take turns
            again = model.mass_matrix(q)
        assert_same([again], [expected])
    assert len({address(a) for a in [model.mass_matrix(q) for _ in range(20)]}) == 20
    assert len(memory._unseen) == memory.MOST_RESULTS
    memory._unseen.clear()
    model.mass_matrix(q[:5]), memory.fresh(memory.MOST_KEPT + 1)  # too small, too large
    assert not memory._unseen


def test_threads_and_forks_see_results_of_their_own(model):
    given = [rows_of(k) for k in range(8)]
    expected = [model.mass_matrix(q) for q in given]

    def work(k):
        for _ in range(100):
            held = [model.mass_matrix(given[k]) for _ in range(2)]
            assert_same(held, [expected[k]] * 2)

    with ThreadPoolExecutor(8) as pool:
        assert list(pool.map(work, range(8))) == [None] * 8
    if not hasattr(os, "fork"):
        return
    mine = model.mass_matrix(given[0])
    with warnings.catch_warnings(action="ignore"):  # of threads, which are idle
        child = os.fork()
    if not child:
        model.mass_matrix(given[0])[...] = mine[...] = np.nan
        work(1)
        os._exit(0)
    work(2)
    assert os.waitpid(child, 0)[1] == 0
    assert_same([mine], [expected[0]])
