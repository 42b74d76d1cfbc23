"""Run time against error of every integration method, in flight and on the ground."""

if __name__ == "__main__":
    from benchmarks import alone

    alone.main("simulations", __doc__)

import time
from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np

import serpentail as st
from benchmarks.fixtures import built
from benchmarks.peers import mujoco_scene
from serpentail.show.animal import leg_joints

GAMMA, CROUCH, STAND, STRETCH = np.radians([210.0, -15.0, -40.0, -75.0])
DAMPING = 1e-3  # N m s
ERROR = 1e-4  # at which methods are compared
RUNS = 5
GENERATED, SCIPY = ("tsit5", "ros34pw2", "implicit_euler", "rk4"), ("lsoda", "dop853")
SETTINGS = {
    "tsit5": [{"rtol": r} for r in (1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-8)],
    "ros34pw2": [{"rtol": r} for r in (1e-2, 1e-3, 3e-4, 1e-4, 3e-5, 1e-5, 1e-6)],
    "implicit_euler": [{"step": h} for h in (1e-3, 1e-4, 2e-5)],
    "rk4": [{"step": h} for h in (1e-3, 1e-4, 2e-5)],
    "lsoda": [{"rtol": r, "atol": r} for r in (1e-2, 1e-3, 3e-4, 1e-4, 3e-5, 1e-5, 1e-6, 1e-8)],
    "dop853": [{"rtol": r, "atol": r} for r in (1e-4, 1e-6, 1e-8)],
}


FLYING = ["energy", "momentum", "rollout", "implicit", "pfl", "tail_points", "forward_dynamics"]
TOUCHING = {
    "contacts": ["feet", "tail"],
    "friction": "cone",
    "functions": [*FLYING, "contact_points", "leg_points", "contact_dynamics"],
}


def flying() -> st.Model:
    """Return a tail of three segments of four links in the air."""
    return built(3, 4, functions=FLYING)


def touching() -> st.Model:
    """Return it on the ground."""
    return built(3, 4, **TOUCHING)


def thrown(model: st.Model) -> tuple[np.ndarray, np.ndarray]:
    """Return a state that spins about all axes with a bent tail."""
    q, v = np.zeros(model.nq), np.zeros(model.nv)
    q[2:4], q[7::2], q[8::2] = (0.3, 1.0), 0.1, 0.05
    v[2], v[3:6] = 2.0, (20.0, 1.0, -2.0)
    return q, v


def flight() -> tuple[Callable, float]:
    """0.6 s of damped flight."""
    return fly(flying(), 0.6)


def fly(model: st.Model, span: float) -> tuple[Callable, float]:
    """Return a damped flight of a number of seconds."""
    start = thrown(model)
    damped = st.Damping(DAMPING)
    return lambda **how: st.simulate(model, *start, controller=damped, t_span=span, **how), span


def tracking() -> tuple[Callable, float]:
    """0.6 s of flight whose tail tracks a motion by partial feedback linearisation."""
    model = flying()
    bends = [[0.4, 0.4, 0.4], [-0.5, 0.8, 0.3], [0.6, -0.4, 0.2]]
    law = st.Pfl(model, st.Reference.of_bends(model, [0.0, 0.3, 0.6], bends))
    return lambda **how: st.simulate(model, *thrown(model), controller=law, t_span=0.6, **how), 0.6


def standing(model: st.Model) -> dict:
    """Return the arguments of a run that begins at rest on feet and tail."""
    q, legs = np.zeros(model.nq), st.Legs.fixed(GAMMA, STAND)
    q[2:5] = 0.1, np.cos(0.1), np.sin(0.1)
    acting = {"controller": st.Damping(DAMPING), "legs": legs}
    q, v, bristles = st.settle(model, q, rounds=8, duration=0.25, rtol=1e-5, **acting)
    return {"q0": q, "v0": v, "bristles0": bristles} | acting


def sliding() -> tuple[Callable, float]:
    """0.5 s of sliding on feet and tail, from 1 m/s askew."""
    model = touching()
    start = standing(model.with_parameters(mu=0.3))
    start["v0"][:2] = 0.8, 0.6
    return lambda **how: st.simulate(model.with_parameters(mu=0.3), t_span=0.5, **start | how), 0.5


def impact() -> tuple[Callable, float]:
    """0.5 s of falling onto feet and tail from 50 mm, pitched and rolled."""
    model = touching()
    q, v = np.zeros(model.nq), np.zeros(model.nv)
    q[2:7] = 0.12, np.cos(0.15), np.sin(0.15), 0.05, 0
    own = {"controller": st.Damping(DAMPING), "legs": st.Legs.fixed(GAMMA, STAND), "t_span": 0.5}
    return lambda **how: st.simulate(model, q, v, **own | how), 0.5


SCENES = {"flight": flight, "tracking": tracking, "sliding": sliding, "impact": impact}


def setting(options: dict) -> str:
    """The first of a run's options as text."""
    name, value = next(iter(options.items()))
    return f"{name} {value:g}"


def scene_rows(name: str) -> list[dict]:
    """Run time and error of every method in one scene: the least of five runs."""
    run, span = SCENES[name]()
    exact = run(method="tsit5", rtol=1e-12, atol=1e-13, output_step=span)
    rows = []
    for method, settings in SETTINGS.items():
        for options in settings:
            row = {"scene": name, "method": method, "setting": setting(options)}
            rows.append(
                row
                | timed(
                    lambda how=options | {"method": method}: run(output_step=span, **how),
                    exact,
                    span,
                )
            )
    return rows


def timed(run: Callable, exact: st.Trajectory, span: float) -> dict:
    """Return the least times of some runs, for the caller and for the processor within, and their
    error; no numbers if the method fails.
    """
    waits, motions = [], []
    try:
        for _ in range(RUNS):
            begun = time.perf_counter()
            motions.append(run())
            waits.append(1e3 * (time.perf_counter() - begun))
    except st.SimulationError:
        return dict.fromkeys(("ms", "cpu_ms", "error", "real_time_factor"), float("nan"))
    cpu_ms = 1e3 * min(motion.info["cpu_seconds"] for motion in motions)
    error = float(np.abs(motions[0].q[-1] - exact.q[-1]).max())
    times = {"ms": min(waits), "cpu_ms": cpu_ms, "error": error}
    return times | {"real_time_factor": 1e3 * span / min(waits)}


@cache
def simulation_times(folder: Path) -> list[dict]:
    """Waiting time of the caller against error (largest of q at the end) of all methods in four
    scenes of a (3, 4) tail; beside it the processor's time in the run itself, once it is prepared.
    Flight and tracking 0.6 s, sliding and impact 0.5 s; lsoda and dop853 are SciPy's on the
    compiled model. nan: the method failed, for example because its steps are too long.
    """
    return [row for name in SCENES for row in scene_rows(name)]


def least(rows: list[dict], methods: tuple[str, ...], error: float) -> dict:
    """Return the fastest run of some methods whose error does not exceed a bound."""
    return min(
        (row for row in rows if row["method"] in methods and row["error"] <= error),
        key=lambda row: row["ms"],
    )


def simulation_summary(folder: Path) -> list[dict]:
    """The fastest run of a generated method in each scene with an error of at most 1e-4, beside
    SciPy's LSODA. LSODA is given the same bound of the error, and also our actual error, which is
    far below the bound where stability, not accuracy, limits our steps.
    """
    found = []
    for name in SCENES:
        rows = [row for row in simulation_times(folder) if row["scene"] == name]
        own, lsoda = least(rows, GENERATED, ERROR), least(rows, ("lsoda",), ERROR)
        equal = least(rows, ("lsoda",), own["error"])
        found.append(own | {"lsoda_ms": lsoda["ms"], "lsoda_error": lsoda["error"]})
        found[-1] |= {
            "lsoda_ratio": lsoda["ms"] / own["ms"],
            "lsoda_ratio_at_our_error": equal["ms"] / own["ms"],
        }
    return found


def draw(rows: list[dict], path: Path) -> None:
    """Draw run time against error of all methods, one panel for each scene."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9, 6.5), layout="constrained")
    for axes, name in zip(figure.subplots(2, 2).ravel(), SCENES, strict=True):
        for method, mark in zip(SETTINGS, "osd^xv", strict=True):
            own = sorted(
                (row["error"], row["ms"])
                for row in rows
                if (row["scene"], row["method"]) == (name, method)
            )
            axes.loglog(
                *np.array(own).T,
                marker=mark,
                label=f"SciPy's {method}" if method in SCIPY else method,
            )
        axes.set(title=name, xlabel="error of q at the end [m, rad]", ylabel="run time [ms]")
        axes.axvline(ERROR, color="0.7", linewidth=0.8)
        axes.grid(color="0.92")
        if name == "flight":
            axes.legend(frameon=False, fontsize=8)
    figure.savefig(path, dpi=150)


def mujoco_times(folder: Path) -> list[dict]:
    """0.5 s of sliding on feet and tail by MuJoCo, whose contacts and ties are soft constraints: a
    different physics.
    """
    model = touching().with_parameters(mu=0.3)
    start = standing(model)
    start["v0"][:2] = 0.8, 0.6
    still = st.simulate(model, t_span=1e-6, **start)
    joints = leg_joints(model, still, start["legs"].curve.at(still.t)[0])[0, :, 3:].reshape(-1, 3)
    feet = (joints - still.q[0, :3]) @ st.rotation_matrix(still.q[0, 3:7])
    text = mujoco_scene.mjcf(model, feet, DAMPING)
    (folder / "sliding.xml").write_text(text, encoding="utf-8")
    steps = (1e-3, 5e-4, 2e-4)
    times = [mujoco_scene.milliseconds(text, start["q0"], start["v0"], 0.5, step) for step in steps]
    return [
        {"mujoco_step_s": step, "ms": ms, "real_time_factor": 500 / ms}
        for step, ms in zip(steps, times, strict=True)
    ]
