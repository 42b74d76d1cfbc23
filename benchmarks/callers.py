"""The waiting time of a caller in Python beside the time in C: single calls and flights."""

if __name__ == "__main__":
    from benchmarks import alone

    alone.main("callers", __doc__)

import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from unittest import mock

import numpy as np

import serpentail as st
from benchmarks.batches import DFD, FD, HESSIAN, best
from benchmarks.derivatives import multiplied
from benchmarks.fixtures import built, fixture, label
from benchmarks.peers import timing
from benchmarks.simulations import ERROR, FLYING, fly, impact
from serpentail.simulation.runs.single import CompiledRun

SIZES = ((1, 3), (3, 4))
ROUNDS, CALLS = 100, 64
FLIGHTS = (((1, 3), 0.6), ((3, 4), 0.6), ((1, 3), 0.03), ((3, 4), 0.03))  # s
FLIGHT_ERROR = 1e-6  # m, rad
TOLERANCES = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-8)
REPEATS = 40


def call_times(folder: Path) -> list[dict]:
    """Microseconds of one call: in C, for the caller in Python, and the part of that outside C."""
    rows = []
    for size in SIZES:
        model, states = built(*size, functions=[FD, DFD, HESSIAN]), timing.random_states(size[0])
        for name in (FD, DFD, HESSIAN):
            given = multiplied(states) if name == HESSIAN else states
            ours = fixture(model, folder, name)
            inside = timing.time_rounds([ours.closure], given, ROUNDS, CALLS)[0][0] / 1e3
            q, v, rest = (x[0] for x in given)
            arguments = (q, v, *(np.split(rest, 2) if name == HESSIAN else (rest,)))
            whole = call_us(getattr(model, name), arguments)
            row = {"function": name, "model": label(*size), "c_us": inside}
            rows.append(row | {"caller_us": whole, "overhead_us": whole - inside})
    return rows


def call_us(call: Callable, arguments: tuple, count: int = 100, repeats: int = 300) -> float:
    """Return the least microseconds of one call; repeats are short, so that some are
    undisturbed.
    """

    def calls() -> None:
        for _ in range(count):
            call(*arguments)

    return best(calls, repeats) / count / 1e3


def flight_times(folder: Path) -> list[dict]:
    """Microseconds that the caller of st.simulate waits, and the part of that in C: damped flights
    with an error of q of at most 1e-6 (m, rad) at the end, and the impact of a (3, 4) tail with an
    error of at most 1e-4. 201 samples, the default; each by the fastest tolerance that is as
    accurate.
    """
    rows = []
    for size, span in FLIGHTS:
        scene = partial(flown, size, span)
        name = f"{label(*size)}, flight of {span:g} s"
        rows.append({"scene": name} | waited(scene, "tsit5", FLIGHT_ERROR))
    return [*rows, {"scene": "(3, 4), impact"} | waited(impact, "ros34pw2", ERROR)]


def flown(size: tuple[int, int], span: float) -> tuple[Callable, float]:
    """Return a damped flight of a model that is loaded for it."""
    return fly(built(*size, functions=FLYING), span)


def waited(scene: Callable[[], tuple[Callable, float]], method: str, error: float) -> dict:
    """Return the row of the fastest tolerance of a method that is accurate enough."""
    run, span = scene()
    exact = run(method="tsit5", rtol=1e-12, atol=1e-13, output_step=span)
    found = []
    for rtol in TOLERANCES:
        off = float(np.abs(run(method=method, rtol=rtol).q[-1] - exact.q[-1]).max())
        if off <= error:
            whole = best(partial(run, method=method, rtol=rtol), REPEATS)
            found.append((whole, rtol, off))
    whole, rtol, off = min(found)
    inside = inside_ns(scene()[0], method=method, rtol=rtol)
    row = {"setting": f"{method}, rtol {rtol:g}", "error": off, "c_us": inside / 1e3}
    row |= {"caller_us": whole / 1e3, "overhead_us": (whole - inside) / 1e3}
    return row | {"real_time_factor": span * 1e9 / whole}


def inside_ns(run: Callable[..., st.Trajectory], **how) -> float:
    """Return the least nanoseconds of a run that are spent in the C that makes it."""
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
    given = CompiledRun.function

    def function(self, name: str, *arguments: type) -> Callable[..., int]:
        inside = given(self, name, *arguments)

        def timed(*values) -> int:
            begun = time.perf_counter_ns()
            status = inside(*values)
            spent[-1] += time.perf_counter_ns() - begun
            return status

        return timed

    return function
