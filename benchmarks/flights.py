"""Microseconds that the caller of st.simulate waits, and the part of that in C.

Damped flights with an error of q of at most 1e-6 (m, rad) at the end, and the impact of a (3, 4)
tail with an error of at most 1e-4. 201 samples, the default; each by the fastest tolerance that is
as accurate.
"""

import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from unittest import mock

import serpentail as st
from benchmarks.models import built, label
from benchmarks.scenes import ERROR, FLYING, error_at_end, exact_run, fly, impact
from benchmarks.timing import best
from serpentail.simulation.runs.single import CompiledRun

PER_PROCESSOR = True
FLIGHTS = (((1, 3), 0.6), ((3, 4), 0.6), ((1, 3), 0.03), ((3, 4), 0.03))  # s
FLIGHT_ERROR = 1e-6  # m, rad
TOLERANCES = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-8)
REPEATS = 40


def measured(folder: Path) -> list[dict]:
    """Return a row for each flight, and one for the impact."""
    rows = []
    for size, span in FLIGHTS:
        row = {"model": label(*size), "scene": f"flight of {span:g} s"}
        rows.append(row | waited(partial(flown, size, span), "tsit5", FLIGHT_ERROR))
    return [*rows, {"model": "(3, 4)", "scene": "impact"} | waited(impact, "ros34pw2", ERROR)]


def flown(size: tuple[int, int], span: float) -> tuple[Callable, float]:
    """Return a damped flight of a model that is loaded for it."""
    return fly(built(*size, functions=FLYING), span)


def waited(scene: Callable[[], tuple[Callable, float]], method: str, error: float) -> dict:
    """Return the row of the fastest tolerance of a method that is accurate enough."""
    run, span = scene()
    exact, found = exact_run(run, span), []
    for rtol in TOLERANCES:
        off = error_at_end(run(method=method, rtol=rtol), exact)
        if off <= error:
            found.append((best(partial(run, method=method, rtol=rtol), REPEATS), rtol, off))
    whole, rtol, off = min(found)
    inside = inside_ns(scene()[0], method=method, rtol=rtol)
    row = {"setting": f"{method}, rtol {rtol:g}", "error": off, "in C, us": inside / 1e3}
    row |= {"for the caller, us": whole / 1e3, "outside C, us": (whole - inside) / 1e3}
    return row | {"times real time": span * 1e9 / whole}


def inside_ns(run: Callable[..., st.Trajectory], **how) -> float:
    """Return the least nanoseconds of a run that are spent in the C that makes it.

    run: of a model that has made no run yet, because the preparations that a model keeps are not
    timed.
    """
    spent: list[float] = []
    with mock.patch.object(CompiledRun, "function", timed_function(spent)):
        for _ in range(REPEATS):
            spent.append(0.0)
            run(**how)
    if not all(spent):
        raise RuntimeError("a run took its C from elsewhere than CompiledRun.function")
    return min(spent)


def timed_function(spent: list[float]) -> Callable:
    """Return a replacement of the method that gives runs their C functions; these add their time to
    the last entry of ``spent``.
    """
    original = CompiledRun.function

    def function(self, name: str, *arguments: type) -> Callable[..., int]:
        inside = original(self, name, *arguments)

        def timed(*values) -> int:
            begun = time.perf_counter_ns()
            status = inside(*values)
            spent[-1] += time.perf_counter_ns() - begun
            return status

        return timed

    return function
