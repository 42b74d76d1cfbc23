"""Flights and runs on the ground that several benchmarks time.

A scene is a function that returns a run, which takes the settings of st.simulate, and its seconds.
"""

from collections.abc import Callable

import numpy as np

import serpentail as st
from benchmarks.models import built

GAMMA, STAND = np.radians([210.0, -40.0])
DAMPING = 1e-3  # N m s
ERROR = 1e-4  # m, rad: at which methods are compared
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
    model = touching().with_parameters(mu=0.3)
    start = standing(model)
    start["v0"][:2] = 0.8, 0.6
    return lambda **how: st.simulate(model, t_span=0.5, **start | how), 0.5


def impact() -> tuple[Callable, float]:
    """0.5 s of falling onto feet and tail from 50 mm, pitched and rolled."""
    model = touching()
    q, v = np.zeros(model.nq), np.zeros(model.nv)
    q[2:7] = 0.12, np.cos(0.15), np.sin(0.15), 0.05, 0
    own = {"controller": st.Damping(DAMPING), "legs": st.Legs.fixed(GAMMA, STAND), "t_span": 0.5}
    return lambda **how: st.simulate(model, q, v, **own | how), 0.5


SCENES = {"flight": flight, "tracking": tracking, "sliding": sliding, "impact": impact}


def exact_run(run: Callable, span: float) -> st.Trajectory:
    """Return a run of a scene without visible error, with two samples."""
    return run(method="tsit5", rtol=1e-12, atol=1e-13, output_step=span)


def error_at_end(motion: st.Trajectory, exact: st.Trajectory) -> float:
    """Return the largest error of q at the end."""
    return float(np.abs(motion.q[-1] - exact.q[-1]).max())
