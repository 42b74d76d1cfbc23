"""Tumbling kangaroo rats for tests of planning: models, starts, plans and their true motions."""

from functools import cache

import numpy as np
from scipy.integrate import solve_ivp

import serpentail as st
from serpentail.planning.settings import joined
from serpentail_scene.signatures.table import EXACT_DERIVATIVES
from tests.support import zoo
from tests.support.models import model_folder

EXACT = sorted(
    {part for name, orders in EXACT_DERIVATIVES.items() for part in (name, *orders[0], *orders[1])}
)
FUNCTIONS = [*EXACT, "bias_force", "pfl", "energy", "momentum", "rollout", "tail_points"]
NODE = ["airborne_rates", "airborne_rates_derivatives", "airborne_rates_hessian"]
DURATION = 0.4  # s
TIGHT = {"bounds": st.Bounds(angle=np.pi / 3), "track": False}
AGAIN = {"duration": DURATION, "tolerance": None, **TIGHT}


@cache
def rat(segments: int = 1, links: int = 3) -> st.Model:
    """Return a model of the zoo, or one of its own if the zoo has none of that size."""
    name = f"m{segments}_n{links}"
    if name in zoo.ZOO:
        return zoo.model(name)
    return st.load(model_folder(segments, links, functions=[*dict.fromkeys([*NODE, *FUNCTIONS])]))


def start(model: st.Model, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Return q0, v0 of a rat thrown up, pitched by up to a quarter turn, turning about all axes."""
    random = np.random.default_rng(seed)
    q, v = np.zeros(model.nq), np.zeros(model.nv)
    pitch = random.uniform(0.4, 1.2)
    q[2:5] = 0.3, np.cos(pitch / 2), np.sin(pitch / 2)
    v[:3] = 0.0, -0.3, 2.4
    v[3:6] = random.uniform(-3, 3, 3)
    q[7:] = random.uniform(-0.2, 0.2, model.nq - 7)
    return q, v


def keyed(model: st.Model, **asked) -> st.Plan:
    """Return a plan whose settings have the names of a scene's keys, which tests combine."""
    return st.plan(model, **joined(asked, {}))


@cache
def planned(**settings) -> st.Plan:
    """Return a plan for the first start, made once in a process."""
    model = rat()
    return keyed(model, start=start(model), duration=DURATION, **TIGHT, **settings)


def rate(model, plan):
    """Return y -> y_dot of (q, v) under the plan's torques, by NumPy."""

    def y_dot(t, y):
        q, v = y[: model.nq], y[model.nq :]
        w, e, omega = q[3], q[4:7], v[3:6]
        turn = [-e @ omega / 2, *(w * omega + np.cross(e, omega)) / 2]
        tau = plan.torque(t)[0] - plan.problem.damping * v[6:]
        return np.concatenate([v[:3], turn, v[6:], model.forward_dynamics(q, v, tau)])

    return y_dot


def integrated(model, plan):
    """The state at the end, by SciPy's DOP853 from interval to interval."""
    y = np.concatenate([plan.problem.q0, plan.problem.v0])
    for a, b in zip(plan.curve.ends[:-1], plan.curve.ends[1:], strict=True):
        inside = np.nextafter(b, a)  # torques may jump at the ends
        y = solve_ivp(rate(model, plan), (a, inside), y, "DOP853", rtol=1e-11, atol=1e-12).y[:, -1]
    return y[: model.nq], y[model.nq :]
