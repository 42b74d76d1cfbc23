"""Times many states on the ground at once, in lanes, beside one state after another."""

if __name__ == "__main__":
    from benchmarks import alone

    alone.main("ground_lanes", __doc__)

import time
from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path

import numpy as np

import serpentail as st
from benchmarks.fixtures import built, label
from serpentail.model.batch import MIN_BATCH
from serpentail.model.stepping.makers import StepCall

SIZES = ((1, 3), (3, 4), (3, None))
FUNCTIONS = ("contact_dynamics", "contact_points")
CONTACTS = ["feet", "tail", "torso"]
WANTED = [*FUNCTIONS, "rollout", "implicit"]
STATES, RUNS, ROUNDS = 1024, 64, 200
H, STEPS = 2e-4, 10  # s, and steps of a call
SETTLING, DAMPING = 100, 1e-5  # calls, N m s
LEGS = [3.66, -0.26, 3.66, -0.26, 0, 0, 0, 0]


@cache
def grounded(segments: int, links: int | None) -> st.Model:
    """Return a model that touches the ground with feet, tail and torso."""
    return built(segments, links, contacts=CONTACTS, functions=WANTED)


def ground_batch_times(folder: Path) -> list[dict]:
    """Nanoseconds a state on one core: one by one, and with states as lanes. In each of 1024 states
    some points of feet, tail and torso may touch the ground.
    """
    rows = []
    for size in SIZES:
        model = grounded(*size)
        for name in FUNCTIONS:
            alone, together = function_times(model, name, dropped(model, STATES))
            row = {"function": name, "model": label(*size), "one by one, ns": alone}
            rows.append(row | {"side by side, ns": together, "ratio": alone / together})
    return rows


def ground_step_times(folder: Path) -> list[dict]:
    """Microseconds for an implicit step of one run of 64 that stand, as `model.step` makes it, with
    10 steps in a call, on one core: run by run, and with runs as lanes.
    """
    rows = []
    for size in SIZES:
        model = grounded(*size)
        values = settled(model)
        touching = (model.contact_dynamics(*values.values())[2][..., 2] > 0).sum(axis=1)
        alone, together = step_times(model, values)
        row = {"model": label(*size), "points in the ground": f"{touching.min()}-{touching.max()}"}
        row |= {"run by run, us": alone, "in lanes, us": together, "ratio": alone / together}
        rows.append(row)
    return rows


def dropped(model: st.Model, count: int) -> dict[str, np.ndarray]:
    """Return random states by name, their lowest points about as high as the ground."""
    rng, nt = np.random.default_rng(0), model.nv - 6
    q, v = np.zeros((count, model.nq)), 0.3 * rng.normal(size=(count, model.nv))
    q[:, 3:7] = [1, 0, 0, 0] + 0.1 * rng.normal(size=(count, 4))
    q[:, 7:] = 0.3 * rng.normal(size=(count, nt))
    legs = LEGS + 0.1 * rng.normal(size=(count, 8))
    lowest = model.contact_points(q, v, legs)[0][..., 2].min(axis=1)
    q[:, 2] = rng.uniform(-2e-3, 1e-3, count) - lowest
    bristles = 1e-4 * rng.normal(size=(count, 2 * sum(model.contacts.values())))
    tau = 1e-4 * rng.normal(size=(count, nt))
    return {"q": q, "v": v, "tau": tau, "bristles": bristles, "legs": legs}


def settled(model: st.Model) -> dict[str, np.ndarray]:
    """Return states that have come to stand, their tails damped."""
    values = dropped(model, RUNS)
    values["v"] *= 0.3
    values["legs"][:, 4:] = values["bristles"][:] = 0
    out = [values[name] for name in ("q", "v", "bristles")]
    given = {"legs": values["legs"], "bristles": out[2]}
    for _ in range(SETTLING):
        model.step(*out[:2], -DAMPING * values["v"][:, 6:], H, steps=STEPS, out=out, **given)
    return values


def function_times(
    model: st.Model, name: str, values: dict[str, np.ndarray]
) -> tuple[float, float]:
    """Return nanoseconds a state of a function: one by one, and in lanes."""
    kernel = model.kernels[name]
    inputs = [values[argument] for argument in kernel.names]
    outputs = [np.zeros((STATES, *shape)) for shape in kernel.out_shapes]
    lanes = kernel.batch_library.entry(name, MIN_BATCH)
    ways = (
        lambda: kernel._each(inputs, outputs, 0, STATES),
        lambda: kernel._side_by_side(lanes, inputs, outputs, 0, STATES),
    )
    alone, together = least(ways)
    return alone / STATES, together / STATES


def step_times(model: st.Model, values: dict[str, np.ndarray]) -> tuple[float, float]:
    """Return microseconds a step: run by run, and in lanes."""
    stepping, legs = model.stepping, values["legs"].reshape(-1, 2, 4).swapaxes(1, 2).copy()
    parameters = stepping.parameters(model, None, RUNS)

    def once(way: int) -> None:
        state = [values[name].copy() for name in ("q", "v", "tau", "bristles")]
        statuses = np.zeros(RUNS, np.intc)
        held = StepCall(*state, legs, parameters, H, STEPS, "implicit_euler", statuses)
        maker = (stepping.singly, stepping.maker(model, held)[0])[way]
        maker.make(held, 0, RUNS)
        if statuses.any():
            raise RuntimeError(f"status {statuses.max()} of a run that stands")

    alone, together = least((lambda: once(0), lambda: once(1)))
    return alone / (1e3 * RUNS * STEPS), together / (1e3 * RUNS * STEPS)


def least(ways: Sequence[Callable[[], object]]) -> list[float]:
    """Return the least nanoseconds of each call, all of them in each round."""
    times = []
    for _ in range(ROUNDS):
        for way in ways:
            begun = time.perf_counter_ns()
            way()
            times.append(time.perf_counter_ns() - begun)
    return [min(times[k :: len(ways)]) for k in range(len(ways))]
