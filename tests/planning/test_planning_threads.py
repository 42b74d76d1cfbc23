"""Stages evaluated in threads: side by side, with the numbers of one thread, also after a fork."""

import ctypes
import os
import threading
from contextlib import contextmanager

import numpy as np
import pytest

import serpentail as st
from serpentail.planning.condensed import fatrop, helpers
from serpentail.planning.condensed.fatrop import kernel
from tests.planning.test_planning_stages import NODE, H, state
from tests.support.stages import first_stage
from tests.support.tumbling import DURATION, rat, start

LIMIT = 30  # s


@contextmanager
def program(**settings):
    """Yield the code and a program of six stages, and variables at which it can be evaluated."""
    model, x = rat(), state(2)
    with first_stage(model, x, H, **settings) as stage:
        code = kernel()
        code.program_slopes.argtypes = (ctypes.c_void_p,) * 2
        w = np.zeros(code.program_variables(stage.program))
        nu, own = stage.size - len(x) - 1, stage.size
        w[nu] = 0.4
        for k in range(1, 6):
            first = k * own - len(x)
            w[first + nu : first + own] = [*x, 0.4]
        yield code, stage, w


def slopes(code, stage, w):
    """Jacobians of the results of all six stages."""
    code.program_slopes(stage.program, w.ctypes.data)
    stages = stage.all[:6]
    assert all(own.sloped for own in stages)
    return [np.ctypeslib.as_array(own.Jr, (own.results, own.variables)).copy() for own in stages]


def test_helpers_evaluate_stages_side_by_side():
    """A node waits until another thread is in one, too: alone it would wait in vain."""
    together, seen = threading.Barrier(2), set()

    def node(*_pointers):
        if threading.get_ident() not in seen:
            seen.add(threading.get_ident())
            together.wait(LIMIT)
        return 1

    functions = {"rates": NODE(node), "slopes": NODE(node), "curvature": NODE(node)}
    with program(functions=functions) as (code, stage, w), helpers.helped(code, stage.program, 1):
        code.program_slopes(stage.program, w.ctypes.data)
    assert len(seen) == 2
    assert not together.broken


@pytest.mark.parametrize("crew", [1, 2, 5])
def test_stages_have_the_numbers_of_one_thread(crew):
    with program() as (code, stage, w):
        wanted = slopes(code, stage, w)
    with program() as (code, stage, w), helpers.helped(code, stage.program, crew):
        found = slopes(code, stage, w)
    for a, b in zip(wanted, found, strict=True):
        np.testing.assert_array_equal(a, b)


def test_plans_do_not_depend_on_the_number_of_threads(monkeypatch):
    found = []
    for count in (1, 2, 3):
        monkeypatch.setenv("SERPENTAIL_THREADS", str(count))
        found.append(
            st.plan(
                rat(),
                start=start(rat()),
                duration=DURATION,
                bounds=st.Bounds(angle=np.pi / 3),
                solver="fatrop",
                intervals=30,
                tolerance=None,
                track=False,
            )
        )
    for other in found[1:]:
        assert other.report["iterations"] == found[0].report["iterations"]
        np.testing.assert_array_equal(other.solution.w, found[0].solution.w)


def test_a_solve_has_as_many_threads_as_the_model_allows(monkeypatch):
    """But not for a few stages; none of them is left afterwards."""
    seen, before = set(), threading.active_count()
    monkeypatch.setattr(fatrop, "stop_reason", lambda: seen.add(threading.active_count()))
    monkeypatch.delenv("SERPENTAIL_THREADS", raising=False)
    for count, intervals, used in ((1, 30, 1), (3, 30, 3), (3, 6, 1)):
        monkeypatch.setattr(rat().batch_library, "threads", count)
        st.plan(
            rat(),
            start=start(rat()),
            duration=DURATION,
            solver="fatrop",
            intervals=intervals,
            tolerance=None,
            track=False,
        )
        assert seen == {before + used - 1}
        seen.clear()
    assert threading.active_count() == before


@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs os.fork")
@pytest.mark.filterwarnings("ignore:.*fork.*:DeprecationWarning")
def test_a_forked_child_evaluates_alone():
    with program() as (code, stage, w), helpers.helped(code, stage.program, 2):
        wanted = slopes(code, stage, w)
        child = os.fork()
        if child == 0:
            code.program_slopes(stage.program, (1.001 * w).ctypes.data)
            again = slopes(code, stage, w)
            same = all(np.allclose(a, b) for a, b in zip(wanted, again, strict=True))
            os._exit(0 if same else 1)
        assert os.waitpid(child, 0)[1] == 0
