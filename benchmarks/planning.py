"""Whole calls of `st.plan` with its default settings, by processor time in one process.

Random tumbling starts of several tails, upright and at rest, with truth and tracking; IPOPT beside
FATROP on the same starts and on the same mesh; other objectives; what a repeated start costs
outside the solver, without tracking; and ticks of `st.Mpc`. True: within 0.01 deg when the torques
are applied. A plan that explains a failed search is not true.
"""

import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import serpentail as st
from benchmarks.models import label
from examples import righting
from examples.studies.righting_kinds import is_true

EXAMPLE = 4  # the random start
SOLVERS = {"FATROP": "fatrop", "IPOPT": "ipopt"}
MESHES = {(1, 3): (40, 2.0), (6, 2): (83, 2.0)}  # intervals, least times as fast as IPOPT
BESIDE = {(1, 3): 20, (3, 2): 5}  # starts from which both solvers plan
OBJECTIVES = 10  # starts
AGAIN = 20  # starts of one problem, after the first
OUTSIDE = 2e-3  # s of a repeated start, outside the solver
WITHIN = 0.2  # s
UNTRUE = st.Tolerances(attitude=None)


@dataclass(frozen=True)
class Body:
    """A body, how many starts it has, and its targets.

    size: of the tail; parts: factors of parameters; median: s of a call; least: true plans.
    """

    size: tuple[int, int | None]
    starts: int
    parts: dict[str, float]
    median: float | None
    least: int


BODIES = {
    "(1, 3)": Body((1, 3), 40, {}, 0.05, 40),
    "(3, 2)": Body((3, 2), 10, {}, 0.3, 10),
    "continuum 4": Body((4, None), 5, {}, None, 5),
    "half the tail": Body((1, 3), 20, {"tail_length": 0.5}, None, 18),
}


@dataclass(frozen=True)
class Call:
    """A plan, and the processor time of the call that made it (s)."""

    plan: st.Plan
    cpu_s: float

    @property
    def true(self) -> bool:
        """Tell if its torques bring the torso to the goal."""
        return is_true(self.plan.report)


def measured(folder: Path) -> list[dict]:
    """Return a row for each figure."""
    models = {size: righting.model(*size) for size in {*MESHES, *(b.size for b in BODIES.values())}}
    rat = models[1, 3]
    rows: list[dict] = []
    for name, body in BODIES.items():
        rows += starts_of(models[body.size], name, body)
    rows += [beside(models[size], count) for size, count in BESIDE.items()]
    rows += [iteration(models[size], *MESHES[size]) for size in MESHES]
    rows += [objective(rat, name) for name in ("energy", "time")]
    return [*rows, again(rat), *ticks(rat)]


def plan(rat: st.Model, seed: int = EXAMPLE, **settings) -> st.Plan:
    """Plan from a random start; the whole tail bends by 180 degrees as in Sect. 4.2, by 360 as in
    4.3.
    """
    limits = righting.bounds(rat, np.pi if rat.segments == 1 else 2 * np.pi)
    common = {"start": righting.tumbling(rat, seed), "duration": (0.3, righting.FLIGHT)}
    return st.plan(rat, **(common | {"bounds": limits} | settings))


def timed(rat: st.Model, seed: int = EXAMPLE, **settings) -> Call:
    """Return a plan and the processor time of making it."""
    begun = time.process_time()
    found = plan(rat, seed, **settings)
    return Call(found, time.process_time() - begun)


def figure(name: str, value: str, target: str, about: str = "") -> dict:
    """Return a row."""
    return {"figure": name, "value": value, "target": target, "about": about}


def median_of(calls: Sequence[Call]) -> float:
    """Return the median of the processor times (s)."""
    return float(np.median([one.cpu_s for one in calls]))


def starts_of(model: st.Model, name: str, body: Body) -> list[dict]:
    """Plan from random starts with default settings."""
    changed = {k: f * np.asarray(model.parameters[k]) for k, f in body.parts.items()}
    own = model.with_parameters(**changed)
    timed(own)  # derives and compiles
    calls = [timed(own, seed) for seed in range(1, body.starts + 1)]
    true = [one.cpu_s for one in calls if one.true]
    explained = sum(one.plan.report["advice"] is not None for one in calls)
    other = sum(one.plan.report["solver"] == "ipopt" for one in calls if one.true)
    last = np.percentile([one.cpu_s for one in calls], 95)
    about = f"95 % {last:.2f} s; true within {WITHIN} s: "
    about += f"{sum(s <= WITHIN for s in true)}; explained {explained}; by IPOPT {other}"
    count = f"{len(true)} of {body.starts}"
    most = "" if body.median is None else f"<= {body.median:g} s"
    head = f"{name}, {body.starts} starts"
    return [
        figure(f"{head}, median", f"{median_of(calls):.3f} s", most, about),
        figure(f"{head}, true", count, f">= {body.least}"),
    ]


def beside(rat: st.Model, count: int) -> dict:
    """Plan from the same starts by both solvers, alternately: whole calls."""
    calls: dict[str, list[Call]] = {name: [] for name in SOLVERS}
    for seed in range(1, count + 1):
        for name, way in SOLVERS.items():
            calls[name].append(timed(rat, seed, solver=way))
    ratios = [i.cpu_s / f.cpu_s for f, i in zip(*calls.values(), strict=True)]
    true = ", ".join(f"{name} {sum(one.true for one in of)} true" for name, of in calls.items())
    name = f"{label(rat.segments, rat.links)}, {count} starts, IPOPT over FATROP, median"
    return figure(name, f"{np.median(ratios):.1f}x", ">= 1x", true)


def iteration(rat: st.Model, intervals: int, least: float) -> dict:
    """Time an iteration from passive flight, torques and states on one mesh."""
    each = dict.fromkeys(SOLVERS, np.inf)
    mesh = {"mesh": st.Mesh(intervals=intervals, controls=intervals), "tolerances": UNTRUE}
    for _ in range(3):
        for name, way in SOLVERS.items():
            solver = st.Solver(way, options={f"{way}.max_iter": 30}, retries=0, track=False)
            report = plan(rat, **mesh, solver=solver).report
            each[name] = min(each[name], report["solve_cpu_s"] / report["iterations"])
    about = ", ".join(f"{name} {1e3 * s:.2f} ms" for name, s in each.items())
    name = f"{label(rat.segments, rat.links)}, an iteration of {intervals} intervals"
    return figure(
        f"{name}, IPOPT over FATROP",
        f"{each['IPOPT'] / each['FATROP']:.1f}x",
        f">= {least:g}x",
        about,
    )


def objective(rat: st.Model, name: str) -> dict:
    """Plan for another objective from random starts."""
    calls = [timed(rat, seed, objective=name) for seed in range(1, OBJECTIVES + 1)]
    true = sum(one.true for one in calls)
    about = f"median {median_of(calls):.2f} s"
    head = f"{label(rat.segments, rat.links)}, least {name}, {OBJECTIVES} starts, true"
    return figure(head, f"{true} of {OBJECTIVES}", f">= {OBJECTIVES}", about)


def again(rat: st.Model) -> dict:
    """Plan again from near states, with the plan as the guess: a call without its solver."""
    q, v = righting.tumbling(rat, EXAMPLE)
    untracked = {"solver": st.Solver(track=False)}
    first, random, calls = plan(rat, **untracked), np.random.default_rng(0), []
    for _ in range(AGAIN):
        near = q, v * (1 + random.uniform(-0.01, 0.01, v.size))
        calls.append(timed(rat, start=near, guess=first, tolerances=UNTRUE, **untracked))
    reports = [one.plan.report for one in calls]
    rest = [r["call_cpu_s"] - r["solve_cpu_s"] for r in reports]
    truth = 1e3 * np.median([r["truth_s"] for r in reports])
    good = sum(r["converged"] for r in reports)
    about = f"of it simulations {truth:.1f} ms; call {1e3 * median_of(calls):.1f} ms; "
    about += f"{good} of {AGAIN} converged"
    value = f"{1e3 * np.median(rest):.1f} ms"
    head = f"{label(rat.segments, rat.links)}, planning again, outside the solver"
    return figure(head, value, f"<= {1e3 * OUTSIDE:g} ms", about)


def ticks(rat: st.Model) -> list[dict]:
    """Time `st.Mpc` from near states: one step, and the two that plan again."""
    q, v = righting.tumbling(rat, EXAMPLE)
    first, random = plan(rat, goal=st.Goal(torso_rate=None)), np.random.default_rng(0)
    rows = []
    for steps, what, most in ((1, "a tick", 2.0), (2, "planning again by two steps", 3.0)):
        mpc, least = st.Mpc(rat, first, iterations=steps), np.inf
        for _ in range(60):
            near = v * (1 + random.uniform(-0.01, 0.01, v.size))
            mpc.begin()
            begun = time.process_time()
            mpc.tick(0.0, q, near)
            least = min(least, time.process_time() - begun)
        about = f"{mpc.settings.intervals} intervals, {first.duration:.2f} s ahead"
        name = f"{label(rat.segments, rat.links)}, predictive control, {what}"
        rows.append(figure(name, f"{1e3 * least:.2f} ms", f"<= {most:g} ms", about))
    return rows
