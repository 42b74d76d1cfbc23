"""Planning by FATROP and by IPOPT with MUMPS, against the targets, in CPU time of the whole call.

An iteration on the same mesh; random tumbling starts, upright and at rest; the kick's state; other
objectives; one problem of 60 nodes with the exact Hessian and with L-BFGS, and the paper's program
of 59; planning again from states up to 1 % away, by IPOPT and by `st.Mpc`. True: within
0.01 deg when the torques are applied. Passive flight is the first guess.
"""

import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import serpentail as st
from benchmarks.models import label
from examples import righting
from examples.studies.righting_kinds import is_true
from examples.studies.righting_paper import planned

EXAMPLE = 4  # the random start
SOLVERS = {"FATROP": {"solver": "fatrop"}, "IPOPT": {"solver": "ipopt"}}
MESHES = {(1, 3): (40, 4), (6, 2): (83, 5)}  # intervals, times as fast as IPOPT
STARTS = {(1, 3): 200, (2, 3): 50, (3, 2): 50}
MEDIAN, WITHIN, SHARE = 0.05, 0.2, 95  # s, s, % of the starts of (1, 3)
KICKED = {(3, 2): 0.5, (4, 2): 2.0, (6, 2): 30.0}  # s
OBJECTIVES, BESIDE = 50, 10  # starts, and those of them from which IPOPT plans, too
LIMIT = 300.0  # s of wall clock that a plan may take
PLAIN = {"tolerance": None, "retries": 0, "track": False}
NODES = PLAIN | {"intervals": 20}
LIMITED = {"options": {"ipopt.hessian_approximation": "limited-memory", "ipopt.max_iter": 3000}}
EXACT, PAPER = "60 nodes, exact Hessian", "the paper's program, 59 nodes, exact Hessian"
WAYS = {EXACT: NODES, "60 nodes, L-BFGS Hessian": NODES | LIMITED}


@dataclass(frozen=True)
class Call:
    """A plan, and the CPU time of the call that made it (s)."""

    plan: st.Plan
    cpu_s: float

    @property
    def true(self) -> bool:
        """Tell if its torques bring the torso to the goal."""
        return is_true(self.plan.report)


def measured(folder: Path) -> list[dict]:
    """Return a row for each figure."""
    sizes = {*MESHES, *STARTS, *KICKED}
    models = {size: righting.model(*size, righting.STAGED) for size in sizes}
    rat = models[1, 3]
    rows = [iteration(models[size], *MESHES[size]) for size in MESHES]
    for size, count in STARTS.items():
        rows += random_starts(models[size], count)
    rows += [from_the_kick(models[size], most) for size, most in KICKED.items()]
    rows += [objective(rat, name) for name in ("energy", "time")]
    return [*rows, *one_problem(rat), again(rat), *ticks(rat)]


def plan(rat: st.Model, seed: int = EXAMPLE, **settings) -> st.Plan:
    """Plan from a random start; the whole tail bends by 180 degrees as in Sect. 4.2, by 360 as in
    4.3.
    """
    limits = righting.bounds(rat, np.pi if rat.segments == 1 else 2 * np.pi)
    common = {"start": righting.tumbling(rat, seed), "duration": (0.3, righting.FLIGHT)}
    return st.plan(rat, **(common | {"bounds": limits, "track": False} | settings))


def timed(rat: st.Model, seed: int = EXAMPLE, **settings) -> Call:
    """Return a plan and the CPU time of making it."""
    begun = time.process_time()
    found = plan(rat, seed, **settings)
    return Call(found, time.process_time() - begun)


def figure(rat: st.Model, name: str, value: str, target: str, about: str = "") -> dict:
    """Return a row."""
    name = f"{label(rat.segments, rat.links)}, {name}"
    return {"figure": name, "value": value, "target": target, "about": about}


def iteration(rat: st.Model, intervals: int, least: float) -> dict:
    """Time an iteration from passive flight, torques and states on one mesh."""
    each = dict.fromkeys(SOLVERS, np.inf)
    for _ in range(3):
        for name, way in SOLVERS.items():
            most = {"options": {f"{way['solver']}.max_iter": 30}}
            report = plan(
                rat, intervals=intervals, controls=intervals, **PLAIN, **way, **most
            ).report
            each[name] = min(each[name], report["solve_cpu_s"] / report["iterations"])
    about = ", ".join(f"{name} {1e3 * s:.2f} ms" for name, s in each.items())
    ratio = f"{each['IPOPT'] / each['FATROP']:.1f}x"
    return figure(rat, f"{intervals} intervals, an iteration", ratio, f">= {least:g}x", about)


def random_starts(rat: st.Model, count: int) -> list[dict]:
    """Plan from random starts by both solvers."""
    rows, targets = [], rat.segments == 1
    for name, way in SOLVERS.items():
        calls = [timed(rat, seed, **way) for seed in range(1, count + 1)]
        times = np.array([one.cpu_s if one.true else np.inf for one in calls])
        about = f"{100 * np.isfinite(times).mean():.1f} % true at all"
        median = f"{np.median([one.cpu_s for one in calls]):.3f} s"
        share = f"{100 * (times <= WITHIN).mean():.1f} %"
        head = f"{count} starts, at rest, {name}"
        target = f"<= {MEDIAN} s" if targets else ""
        rows.append(figure(rat, f"{head}, median", median, target, about))
        target = f">= {SHARE} %" if targets else ""
        rows.append(figure(rat, f"{head}, true within {WITHIN} s", share, target))
    return rows


def from_the_kick(rat: st.Model, most: float) -> dict:
    """Plan from the kick's state, the torso at rest at the end."""
    start = righting.kicked(rat)
    calls = {name: timed(rat, start=start, time_limit=LIMIT, **w) for name, w in SOLVERS.items()}
    error = {k: righting.row(one.plan)["open_loop_attitude_error_deg"] for k, one in calls.items()}
    ours, other = calls["FATROP"], calls["IPOPT"]
    about = f"{error['FATROP']:.4f} deg; IPOPT {other.cpu_s:.2f} s, {error['IPOPT']:.4f} deg"
    value = f"{ours.cpu_s:.2f} s{'' if ours.true else ', not true'}"
    return figure(rat, "from the kick", value, f"<= {most:g} s", about)


def objective(rat: st.Model, name: str) -> dict:
    """Plan for another objective from random starts."""
    given, found = {"objective": name, "time_limit": LIMIT}, {}
    for solver, way in SOLVERS.items():
        seeds = range(1, (OBJECTIVES if solver == "FATROP" else BESIDE) + 1)
        found[solver] = [timed(rat, seed, **given, **way) for seed in seeds]
    median = {solver: np.median([one.cpu_s for one in calls]) for solver, calls in found.items()}
    true = {solver: sum(one.true for one in calls) for solver, calls in found.items()}
    about = f"median {median['FATROP']:.2f} s; IPOPT, the first {BESIDE}: {true['IPOPT']} true, "
    about += f"{median['IPOPT']:.2f} s"
    share = f"{100 * true['FATROP'] / OBJECTIVES:.0f} %"
    return figure(rat, f"{name}, {OBJECTIVES} starts, true", share, f">= {SHARE} %", about)


def one_problem(rat: st.Model) -> list[dict]:
    """Return the rows of one problem, solved in several ways, alternately."""
    reports: dict[str, list[dict]] = {way: [] for way in (*WAYS, PAPER)}
    task = righting.tumbling(rat, EXAMPLE), (0.3, righting.FLIGHT), righting.bounds(rat)
    for _ in range(5):
        for way, settings in WAYS.items():
            reports[way].append(plan(rat, **settings).report)
        reports[PAPER].append(planned(rat, *task, time_limit=LIMIT).stats)
    least = {way: min(r["solve_cpu_s"] for r in found) for way, found in reports.items()}
    rows, best = [], least[EXACT]
    for way, (first, *_) in reports.items():
        about = f"{first['iterations']} iterations, {least[way] / best:.1f}x, {first['status']}"
        target = "<= 0.15 s" if way == EXACT else ""
        rows.append(figure(rat, way, f"{least[way]:.3f} s", target, about))
    return rows


def again(rat: st.Model) -> dict:
    """Plan again from near states, with the previous plan as the guess: the whole call, including
    the true flight.
    """
    q, v = righting.tumbling(rat, EXAMPLE)
    first, random, calls = plan(rat), np.random.default_rng(0), []
    for _ in range(20):
        near = q, v * (1 + random.uniform(-0.01, 0.01, v.size))
        calls.append(timed(rat, start=near, guess=first, tolerance=None))
    spent = np.array([call.cpu_s for call in calls[1:]])
    solver = np.median([call.plan.report["solve_cpu_s"] for call in calls[1:]])
    good = sum(call.plan.report["converged"] for call in calls[1:])
    about = (
        f"least {1e3 * spent.min():.1f} ms; solver {1e3 * solver:.1f} ms; {good} of {spent.size}"
    )
    return figure(rat, "planning again", f"{1e3 * np.median(spent):.1f} ms", "<= 30 ms", about)


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
        name = f"predictive control, {what}"
        rows.append(figure(rat, name, f"{1e3 * least:.2f} ms", f"<= {most:g} ms", about))
    return rows
