"""Flights that are pushed hard: predictive control alone, and with new plans where its flags ask
for them.
"""

import json
from functools import partial
from pathlib import Path

import numpy as np

import serpentail as st
from examples.righting import TORQUE, tumbling
from examples.studies.replanning import NOISE, RATE, STEP, flown_from, measured, rat
from serpentail.basics.attitude import tilt_deg

PUSH = 10.0  # rad/s, the torso's, at once, about a random axis, in the first half of the flight
WRONG, DELAY = 0.15, 5e-3  # tail's mass or length is off by this fraction; s
TOLERANCE = 3.0  # deg
LOST = st.MpcFlag.MISS | st.MpcFlag.KEPT
ASKED = 2  # lost ticks, one after another, after which there is a new plan
PLANS, SHORTEST = 3, 0.08  # most new plans of a flight; s, shortest time that is left for one
BOUNDS = st.Bounds(angle=np.pi / 3, torque=TORQUE)
GOAL = st.Goal(torso_rate=None)


def body_of(model: st.Model, random: np.random.Generator) -> st.Model:
    """Return the body that flies."""
    name = str(random.choice(["tail_mass", "tail_length"]))
    factor = 1 + WRONG * random.choice([-1, 1])
    return model.with_parameters(**{name: np.asarray(model.parameters[name]) * factor})


def planned_again(model: st.Model, state: tuple, longest: float) -> st.Plan | None:
    """Return a plan from a measured state, None if none is found; the search takes no time."""
    q, v = state[0].copy(), state[1]
    q[7:] = np.clip(q[7:], -BOUNDS.angle, BOUNDS.angle)
    span = (SHORTEST / 2, longest)
    try:
        plan = st.plan(model, start=(q, v), duration=span, goal=GOAL, bounds=BOUNDS)
    except st.PlanningError:
        return None
    return plan if plan.success else None


def flown(plan: st.Plan, seed: int, plans: int) -> dict:
    """Fly one start with at most so many new plans; return tilt (deg), whether the last tick has a
    flag, and the number of new plans.
    """
    model, random = rat(), np.random.default_rng([5, seed])
    body, axis = body_of(model, random), random.normal(size=3)
    pushed = int(plan.duration * RATE * random.uniform(0, 0.5))
    begun, lost, again = 0.0, 0, 0
    mpc = st.Mpc(model, plan, rate=RATE, delay=DELAY)
    q, v, t, k, end = plan.problem.q0, plan.problem.v0, 0.0, 0, plan.duration
    sizes = np.repeat(NOISE, [3, 3, len(q) - 7, len(q) - 7])
    while t < begun + mpc.plan.duration - 1e-6:
        if k == pushed:
            v = v + np.concatenate([np.zeros(3), PUSH * axis / np.linalg.norm(axis), 0 * v[6:]])
        seen, last = measured(q, v, sizes * random.normal(size=len(sizes))), mpc.settings
        if t - begun <= mpc.plan.duration - last.rest - DELAY + 1e-9:
            mpc.tick(t - begun, *seen)
            lost = lost + 1 if mpc.info["flags"][-1] & LOST else 0
        if lost >= ASKED and again < plans and end - t > SHORTEST:
            again, lost = again + 1, 0
            fresh = planned_again(model, seen, end - t)
            if fresh is not None:
                mpc, begun = st.Mpc(model, fresh, rate=RATE, delay=DELAY), t
                mpc.tick(0.0, *seen)
        edge = min(t + 1 / RATE, begun + mpc.plan.duration)
        law = partial(_torque, mpc, begun)
        settings = {"controller": law, "method": "rk4", "step": STEP, "output_step": edge - t}
        run = st.simulate(body, q, v, t_span=(t, edge), **settings)
        q, v, t, k = run.q[-1], run.v[-1], edge, k + 1
    flagged = bool(mpc.info["flags"][-1] & LOST)
    return {"tilt": float(tilt_deg(q[3:7])), "flagged": flagged, "plans": again}


def _torque(mpc: st.Mpc, begun: float, t: float, _q: np.ndarray, _v: np.ndarray) -> np.ndarray:
    return mpc.torque(min(t - begun, mpc.plan.duration))


def trials_of(seed: int) -> dict:
    """Return the flights of a start by law; empty if there is no true plan."""
    model = rat()
    span = (0.3, 0.58)
    plan = st.plan(model, start=tumbling(model, seed), duration=span, goal=GOAL, bounds=BOUNDS)
    if not plan.success:
        return {}
    return {"MPC": flown(plan, seed, 0), "MPC, new plans": flown(plan, seed, PLANS)}


def study(folder: Path, starts: int = 100) -> None:
    """Make all flights, write summary.json, and print a table."""
    found = flown_from("pushed", folder, starts, trials_of, Path(__file__))
    (folder / "summary.json").write_text(json.dumps(found, indent=1) + "\n")
    print(f"{len(found)} true plans from {starts} starts, pushed by {PUSH:g} rad/s")
    print(f"| | within {TOLERANCE:g} deg | beyond, without a flag | median | new plans |")
    print("|---" * 5 + "|")
    for name in found[0]:
        rows = [row[name] for row in found]
        tilts = np.array([row["tilt"] for row in rows])
        silent = sum(row["tilt"] > TOLERANCE and not row["flagged"] for row in rows)
        within, plans = int((tilts <= TOLERANCE).sum()), sum(row["plans"] for row in rows)
        print(f"| {name} | {within} | {silent} | {np.median(tilts):.2g} deg | {plans} |")
