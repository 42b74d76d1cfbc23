"""Steps of 1 ms a second, on one core, beside MuJoCo's on the same tail with equalities of joints.

Of 4096 environments of righting, including observations, rewards and new episodes, with five steps
for each action; of `model.step` alone; and of MuJoCo's mj_step on the MJCF that `st.export` writes,
by its own integrator and by Runge-Kutta.
"""

import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

import serpentail as st
from benchmarks.models import built, label

PER_PROCESSOR = True
# environments; rounds of each, alternately; MuJoCo's steps in one round
COUNT, ROUNDS, STEPS = 4096, 20, 400
SIZES = ((1, 3), (3, 4))
WANTED = ["forward_dynamics", "rollout"]


def measured(folder: Path) -> list[dict]:
    """Return a row for each tail."""
    return [rates(size) for size in SIZES]


def rates(size: tuple[int, int]) -> dict:
    """Return the rates of one tail: the best of alternate rounds."""
    model = st.load(built(*size, functions=WANTED).folder, threads=1)
    clocks = {"gymnasium": environments(model), "model.step": steps(model)}
    for name in ("mujoco", "mujoco, RK4"):
        clocks[name] = mujoco_steps(model, name.endswith("RK4"))
    best = dict.fromkeys(clocks, np.inf)
    for _ in range(ROUNDS):
        best = {name: min(best[name], clock()) for name, clock in clocks.items()}
    row = {"model": label(*size)} | {f"{name}, steps/s": 1 / s for name, s in best.items()}
    return row | {
        "gymnasium / mujoco": best["mujoco"] / best["gymnasium"],
        "gymnasium / mujoco, RK4": best["mujoco, RK4"] / best["gymnasium"],
    }


def environments(model: st.Model) -> Callable[[], float]:
    """Return a function that measures the seconds of a step of one environment among many."""
    worlds = st.environments(model, "righting", COUNT, step=1e-3, substeps=5)
    worlds.reset(seed=0)
    worlds.action_space.seed(0)
    return lambda: timed(worlds.step, worlds.action_space.sample()) / (5 * COUNT)


def steps(model: st.Model) -> Callable[[], float]:
    """Return the same for ``model.step``."""
    q, v = np.zeros((COUNT, model.nq)), np.zeros((COUNT, model.nv))
    q[:, 3] = 1
    tau = 1e-4 * np.random.default_rng(0).normal(size=(COUNT, 2 * model.segments))

    def fresh() -> float:
        own = q.copy(), v.copy()
        return timed(lambda: model.step(*own, tau, 1e-3, steps=5, out=own)) / (5 * COUNT)

    return fresh


def mujoco_steps(model: st.Model, runge_kutta: bool) -> Callable[[], float]:
    """Return the same for a flight in MuJoCo."""
    import mujoco

    with tempfile.TemporaryDirectory() as scratch:
        path = st.export(model, "mjcf", Path(scratch) / "tail.xml")
        engine = mujoco.MjModel.from_xml_path(str(path))
    engine.opt.timestep = 1e-3
    if runge_kutta:
        engine.opt.integrator = mujoco.mjtIntegrator.mjINT_RK4

    def flight() -> float:
        data = mujoco.MjData(engine)
        data.qvel[3] = 5.0
        data.ctrl[:] = 1e-4

        def fly() -> None:
            for _ in range(STEPS):
                mujoco.mj_step(engine, data)

        return timed(fly) / STEPS

    return flight


def timed(work: Callable[..., object], *given: object) -> float:
    """Return the processor time (s) that a call takes."""
    begun = time.process_time()
    work(*given)
    return time.process_time() - begun
