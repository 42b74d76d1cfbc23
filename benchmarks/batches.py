"""Times batches and rollouts beside single calls."""

import ctypes
import time
from pathlib import Path
from unittest import mock

import numpy as np

import serpentail as st
from benchmarks.fixtures import built, label
from serpentail.model.batch import MIN_BATCH
from serpentail.model.kernel import aligned, argument_record
from serpentail.simulation import parallel_runs

STATES, ROUNDS = 512, 300  # a batch that stays in the cache
FLIGHTS = 64
SIZES = ((1, 3), (2, 3), (3, 4), (6, 6), (3, None))


def batch_times(folder: Path) -> list[dict]:
    """Nanoseconds a state of one core: forward dynamics one by one, and side by side; and from
    Python, all cores.

    Both check that arguments and results are finite. Target: side by side 6x faster (AVX-512).
    """
    rows = []
    for size in SIZES:
        model = built(*size)
        alone, together = c_times(model)
        many = random_states(model, 100 * STATES)
        whole = best(lambda model=model, many=many: model.forward_dynamics(*many), 7) / len(many[0])
        row = {"model": label(*size), "one by one, ns": alone, "side by side, ns": together}
        rows.append(row | {"ratio": alone / together, "from Python, all cores, ns": whole})
    return rows


def rollout_rates(folder: Path) -> list[dict]:
    """Damped flights of 200 steps of RK4, 11 samples, a second: one call each, all in one call, and
    abreast in it.

    All but the first on all cores, each flight with its own parameters. Last: what a flight of one
    step takes, which is
    what a run costs besides its steps. Target: abreast 3x faster, 50 us.
    """
    rows = []
    for size in SIZES:
        model = built(*size)
        q, v, _ = random_states(model, FLIGHTS)
        q[:, 3] += 2
        times = np.min([flight_times(model, q, v) for _ in range(9)], axis=0) / FLIGHTS
        rates = dict(
            zip(("one by one, 1/s", "at once, 1/s", "abreast, 1/s"), 1e9 / times, strict=False)
        )
        rows.append(
            {"model": label(*size)}
            | rates
            | {"ratio": times[1] / times[2], "a run, us": times[3] / 1e3}
        )
    return rows


def flight_times(model, q: np.ndarray, v: np.ndarray) -> list[float]:
    """Return nanoseconds of all flights by each way, and of flights of one step."""
    settings = {
        "controller": st.Damping(1e-6),
        "t_span": 0.2,
        "step": 1e-3,
        "output_step": 0.02,
        "method": "rk4",
    }
    own = {"tail_mass": np.linspace(0.003, 0.004, len(q))}
    models = [model.with_parameters(tail_mass=mass) for mass in own["tail_mass"]]
    ways = [lambda: [st.simulate(*one, **settings) for one in zip(models, q, v, strict=True)]]
    ways.append(lambda: st.simulate(model, q, v, parameters=own, **settings))
    found = []
    for way, abreast in zip((*ways, ways[1]), (False, False, True), strict=True):
        with mock.patch.object(parallel_runs, "worth_batching", lambda *_, is_so=abreast: is_so):
            found.append(best(way, 1))
    step = settings | {"t_span": 1e-3, "output_step": 1e-3}
    return [*found, best(lambda: st.simulate(model, q, v, parameters=own, **step), 1)]


def random_states(model, count: int) -> tuple[np.ndarray, ...]:
    """Return q, v and tau."""
    rng = np.random.default_rng(1)
    return tuple(
        0.5 * rng.normal(size=(count, size)) for size in (model.nq, model.nv, model.nv - 6)
    )


def c_times(model) -> tuple[float, float]:
    """Return nanoseconds a state of both C functions of forward dynamics, rounds interleaved."""
    kernel, keep, calls = model.kernels["forward_dynamics"], [], []
    states = [x.astype(kernel.dtype) for x in random_states(model, STATES)]
    out = np.empty((STATES, model.nv), kernel.dtype)
    for function, size in (
        (kernel.function, kernel.work),
        (kernel.batch_library.entry(kernel.name, MIN_BATCH), None),
    ):
        keep.append(aligned(size or kernel.batch_library.work[kernel.name], kernel.dtype))
        record = argument_record(kernel.parameters, STATES, keep[-1], (*states, out))
        calls.append(lambda function=function, record=record: function(ctypes.addressof(record)))
    times = [[best(call, 1) for call in calls] for _ in range(ROUNDS)]
    return tuple(np.min(times, axis=0) / STATES)


def best(call, repeats: int) -> float:
    """Return the least nanoseconds of one call."""
    times = []
    for _ in range(repeats):
        begun = time.perf_counter_ns()
        call()
        times.append(time.perf_counter_ns() - begun)
    return min(times)
