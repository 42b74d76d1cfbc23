"""Times batches and rollouts beside single calls, with the thresholds that users get."""

if __name__ == "__main__":
    from benchmarks import alone

    alone.main("batches", __doc__)

import ctypes
import time
from pathlib import Path

import numpy as np

import serpentail as st
from benchmarks.fixtures import built, label
from serpentail.model.kernel import aligned, argument_record
from serpentail.model.library import MIN_BATCH

STATES, ROUNDS = 512, 100  # a batch that stays in the cache
MANY = 20  # factor: that many more in a call from Python
FD, DFD = "forward_dynamics", "forward_dynamics_derivatives"
HESSIAN = "inverse_dynamics_hessian"
BATCHES = {
    FD: ((1, 3), (2, 3), (3, 4), (6, 6), (8, 16), (3, None)),
    DFD: ((1, 3), (3, 4)),
    HESSIAN: ((1, 3), (3, 4)),
}
FLIGHTS = (64, 6000)  # of 200 steps each; the second number makes more than a million steps
FLOWN = ((1, 3), (3, 4), (6, 6), (3, None))


def batch_times(folder: Path) -> list[dict]:
    """Nanoseconds a state: on one core in C, one by one, and in batches of 1000 states or more, as
    a user gets them; and for the caller in Python, on all cores. All check that arguments and
    results are finite. If a function has no batches, its batch is evaluated one by one.
    """
    return [batch_row(name, size) for name, sizes in BATCHES.items() for size in sizes]


def batch_row(name: str, size: tuple) -> dict:
    """Return the times of one function of one tail."""
    model = built(*size, functions=[name])
    alone, together = c_times(model, name)
    many = random_inputs(model, name, MANY * STATES)
    kernel = model.kernels[name]
    kernel(*many)  # compiles, starts threads
    whole = best(lambda: kernel(*many), 5) / len(many[0])
    row = {"function": name, "model": label(*size), "one by one, ns": alone}
    row |= {"side by side, ns": together, "ratio": alone / together}
    return row | {"for the caller, all cores, ns": whole}


def rollout_rates(folder: Path) -> list[dict]:
    """Damped flights per second (200 steps of RK4, 11 samples), for the caller: one call for each
    flight, and many flights in one call on all cores, each with its own parameters. st.simulate
    decides whether those are integrated side by side in lanes. Last column: microseconds of a
    flight of one step among 64, which is the cost of a run besides its steps.
    """
    rows = []
    for size in FLOWN:
        model = built(*size)
        row: dict = {"model": label(*size), "one call each, 1/s": alone_rate(model)}
        for count in FLIGHTS:
            row[f"{count} in a call, 1/s"] = 1e9 / flight_ns(model, count, 0.2, 0.02)
        rows.append(row | {"a run, us": flight_ns(model, FLIGHTS[0], 1e-3, 1e-3) / 1e3})
    return rows


def alone_rate(model: st.Model) -> float:
    """Return flights a second, each by a call of its own."""
    q, v = flown(model, FLIGHTS[0])
    settings = settled(0.2, 0.02)
    models = [model.with_parameters(tail_mass=mass) for mass in masses(len(q))]
    calls = list(zip(models, q, v, strict=True))
    return 1e9 * len(q) / best(lambda: [st.simulate(*call, **settings) for call in calls], 5)


def flight_ns(model: st.Model, count: int, t_span: float, output_step: float) -> float:
    """Return nanoseconds a flight, for a number of flights in one call."""
    q, v = flown(model, count)
    own, settings = {"tail_mass": masses(count)}, settled(t_span, output_step)
    return best(lambda: st.simulate(model, q, v, parameters=own, **settings), 3) / count


def settled(t_span: float, output_step: float) -> dict:
    """Return the settings of a flight."""
    times = {"t_span": t_span, "output_step": output_step}
    return {"controller": st.Damping(1e-6), "step": 1e-3, "method": "rk4"} | times


def masses(count: int) -> np.ndarray:
    """Return a tail's mass (kg) for each flight."""
    return np.linspace(0.003, 0.004, count)


def flown(model: st.Model, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return q, v of a number of starts."""
    q, v, _ = random_states(model, count)
    q[:, 3] += 2
    return q, v


def random_states(model: st.Model, count: int) -> tuple[np.ndarray, ...]:
    """Return q, v and tau."""
    return random_inputs(model, FD, count)


def random_inputs(model: st.Model, name: str, count: int) -> tuple[np.ndarray, ...]:
    """Return all inputs of a function, for a number of states."""
    rng, shapes = np.random.default_rng(1), model.kernels[name].shapes
    return tuple(0.5 * rng.normal(size=(count, *shape)) for shape in shapes)


def c_times(model: st.Model, name: str = FD) -> tuple[float, float]:
    """Return nanoseconds a state of both C functions of one function, in interleaved rounds;
    without batches, the same time twice.
    """
    kernel, keep, calls = model.kernels[name], [], []
    states = [x.astype(kernel.dtype) for x in random_inputs(model, name, STATES)]
    out = [np.empty((STATES, *shape), kernel.dtype) for shape in kernel.out_shapes]
    ways = [(kernel.function, kernel.work)]
    if (together := kernel.batch_library.entry(name, MIN_BATCH)) is not None:
        ways.append((together, kernel.batch_library.work[name]))
    for function, size in ways:
        keep.append(aligned(size, kernel.dtype))
        record = argument_record(kernel.parameters, STATES, keep[-1], (*states, *out))
        calls.append(lambda function=function, record=record: function(ctypes.addressof(record)))
    if failed := [call() for call in calls if call()]:
        raise RuntimeError(f"{name}: status {failed[0]} at a random state")
    times = np.min([[best(call, 1) for call in calls] for _ in range(ROUNDS)], axis=0) / STATES
    return times[0], times[-1]


def best(call, repeats: int) -> float:
    """Return the least nanoseconds of one call."""
    times = []
    for _ in range(repeats):
        begun = time.perf_counter_ns()
        call()
        times.append(time.perf_counter_ns() - begun)
    return min(times)
