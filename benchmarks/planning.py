"""Measures planning against its targets and against other ways to solve the same problem.

All times are CPU seconds of this process. The problem of one plan is that of Sect. 4.2 from a
random tumbling start, with 59 nodes (Hermite-Simpson, 29 intervals). All ways of solving it start
from passive flight.
"""

if __name__ == "__main__":
    from benchmarks import alone

    alone.main("planning", __doc__)

import importlib.util
import time
from pathlib import Path

import numpy as np

import serpentail as st
from examples import righting
from serpentail.planning import backends as ways
from serpentail.planning.nlp.equations import equations_of_motion
from serpentail.planning.problem import SMOOTHING
from serpentail_codegen.scene.parse import scene_for

SLOWER, CAP = (
    500,
    300.0,
)  # times slower than the best, or s of CPU: endless solves are cut at the lesser of both
EXAMPLE = 4  # the random start
REPEATS = 5
NODES = {
    "rule": "hermite-simpson",
    "intervals": 29,
    "tolerance": None,
    "retries": 0,
    "track": False,
}
PAPER = righting.PAPER | {"intervals": 58, "track": False}
LIMITED = {"options": {"ipopt.hessian_approximation": "limited-memory", "ipopt.max_iter": 3000}}
STARTS = {
    (1, 3): (200, 0.5, 95),
    (2, 3): (50, 10.0, 80),
    (3, 2): (50, 10.0, 80),
}  # starts, s, % of them


class Cut(Exception):
    """Raised when a solve has taken long enough."""


def planning(folder: Path) -> list[dict]:
    """Ways to solve one problem of 59 nodes; how often, and how fast, plans become true (<= 0.01
    deg); planning again. The paper's method is SciPy's SLSQP with finite differences of the
    trapezoidal program in Euler angles; it is cut, unsolved, at 500 times the best way's time, at
    most 5 minutes.
    """
    models = {size: righting.model(*size) for size in STARTS}
    rat, free = models[1, 3], st.Goal(torso_rate=None)
    rows = [
        *one_problem(rat),
        *replanned(rat),
        true_plans(rat, "(1, 3), upright at any rate", STARTS[1, 3], goal=free),
    ]
    return rows + [
        true_plans(models[m, n], f"({m}, {n}), at rest", STARTS[m, n]) for m, n in STARTS
    ]


def plan(rat: st.Model, seed: int = EXAMPLE, **settings) -> st.Plan:
    """Plan from a random start; the whole tail bends by 180 degrees as in Sect. 4.2, by 360 as in
    4.3.
    """
    limits = righting.bounds(rat, np.pi if rat.segments == 1 else 2 * np.pi)
    common = {
        "start": righting.tumbling(rat, seed),
        "duration": (0.3, righting.FLIGHT),
        "bounds": limits,
    }
    return st.plan(rat, **(common | settings))


def one_problem(rat: st.Model) -> list[dict]:
    """Return the rows of one program solved in several ways, alternately."""
    ways = {
        "exact Hessian": NODES,
        "L-BFGS Hessian": NODES | LIMITED,
        "paper's program, exact Hessian": PAPER,
    }
    reports = {way: [] for way in ways}
    for _ in range(REPEATS):
        for way, settings in ways.items():
            reports[way].append(plan(rat, **settings).report)
    rows, best = [], min(r["solve_cpu_s"] for r in reports["exact Hessian"])
    for way, found in reports.items():
        least, target = (
            min(r["solve_cpu_s"] for r in found),
            "<= 0.15 s" if way == "exact Hessian" else "",
        )
        about = f"{found[0]['iterations']} iterations, {least / best:.1f}x, {found[0]['status']}"
        rows.append(figure(f"(1, 3), 59 nodes, {way}", f"{least:.3f} s", target, about))
    spent, about = finite_differences(rat, min(SLOWER * best, CAP))
    about = f"{spent / best:.0f}x, {about}"
    rows.append(figure("(1, 3), 59 nodes, paper's method", f"{spent:.1f} s", ">= 500x", about))
    return [*rows, opty(rat, best)]


def figure(name: str, value: str, target: str, about: str = "") -> dict:
    """Return a row."""
    return {"figure": name, "value": value, "target": target, "about": about}


def opty(rat: st.Model, best: float) -> dict:
    """Return the row of opty: 59 nodes, passive flight as the guess, the duration fixed."""
    name = "(1, 3), 59 nodes, opty"
    if any(importlib.util.find_spec(needed) is None for needed in ("opty", "cyipopt")):
        return figure(name, "not measured", "", "opty or cyipopt is not installed")
    from benchmarks.peers.opty_righting import solved

    flight = righting.passive(rat, righting.tumbling(rat, EXAMPLE), righting.FLIGHT)
    guess = flight.resample(np.linspace(0, righting.FLIGHT, 59))
    found = solved(
        scene_for("articulated", rat.segments, rat.links), guess, righting.bounds(rat), SMOOTHING
    )
    about = f"{found['solve_s'] / best:.0f}x, {found['status']}; {found['setup_s']:.0f} s before"
    return figure(name, f"{found['solve_s']:.1f} s", "", about)


def finite_differences(rat: st.Model, cap: float) -> tuple[float, str]:
    """Return CPU seconds of SLSQP without derivatives on the paper's program, at most `cap`, and
    its outcome.
    """
    transcription, limits, w, p = captured(rat)
    nlp, fixed = transcription.functions["nlp"], limits.lbg == limits.ubg
    begun = time.process_time()

    def both(x):
        if time.process_time() - begun > cap:
            raise Cut
        return nlp(x, p)

    from scipy.optimize import Bounds, minimize

    constraint = {
        "type": "eq",
        "fun": lambda x: (np.array(both(x)[1]).ravel() - limits.lbg)[fixed],
    }
    box, most = Bounds(limits.lbx, limits.ubx), {"maxiter": 10000}
    try:
        found = minimize(
            lambda x: float(both(x)[0]),
            w,
            method="SLSQP",
            bounds=box,
            constraints=constraint,
            options=most,
        )
        status = f"{found.nit} iterations, success {found.success}"
    except Cut:
        status = f"unsolved: cut at {cap:.0f} s"
    return time.process_time() - begun, status


def captured(rat: st.Model) -> tuple:
    """Return the paper's program, its limits, passive flight as the guess and the parameters, as
    ``plan`` forms them.
    """
    seen, solve = [], ways.solve

    def note(engine, limits, w, p, multipliers=None):
        seen.append((limits, np.clip(w, limits.lbx, limits.ubx), p))
        return solve(engine, limits, w, p, multipliers)

    ways.solve = note
    try:
        found = plan(rat, **PAPER)
    finally:
        ways.solve = solve
    transcription = ways.transcription_of(
        rat, found.problem, found.mesh, found.rule, equations_of_motion(rat)
    )
    return transcription, *seen[0]


def replanned(rat: st.Model) -> list[dict]:
    """Plan again from states up to 1 % away, with the previous plan as the guess: the whole call,
    including the true flight.
    """
    q, v = righting.tumbling(rat, EXAMPLE)
    first, random, times = plan(rat, track=False), np.random.default_rng(0), []
    for _ in range(20):
        near = q, v * (1 + random.uniform(-0.01, 0.01, v.size))
        begun = time.process_time()
        again = plan(rat, start=near, guess=first, tolerance=None, track=False)
        times.append(
            (time.process_time() - begun, again.report["solve_cpu_s"], again.report["converged"])
        )
    call, solver, good = np.array(times[1:]).T
    about = (
        f"least {1e3 * call.min():.1f} ms; solver {1e3 * np.median(solver):.1f} ms; "
        f"{int(good.sum())} of {len(good)}"
    )
    return [figure("(1, 3), planning again", f"{1e3 * np.median(call):.1f} ms", "<= 30 ms", about)]


def true_plans(rat: st.Model, name: str, target: tuple, **settings) -> dict:
    """Plans that become true within a time, from random tumbling starts, upright and, by default,
    at rest.
    """
    starts, seconds, share = target
    times, errors = [], []
    for seed in range(1, starts + 1):
        begun = time.process_time()
        found = plan(rat, seed, track=False, **settings)
        times.append(time.process_time() - begun if found.success else np.inf)
        errors.append(found.report["open_loop_attitude_error_deg"] or np.inf)
    within, true = np.mean(np.array(times) <= seconds), np.mean(np.isfinite(times))
    about = (
        f"{100 * true:.1f} % true at all; median {np.median(times):.2f} s, {np.median(errors):.4f} "
        "deg"
    )
    return figure(
        f"{name}, {starts} starts, within {seconds:g} s",
        f"{100 * within:.1f} %",
        f">= {share} %",
        about,
    )
