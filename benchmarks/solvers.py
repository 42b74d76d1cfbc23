"""Measures planning by FATROP beside IPOPT on the same problems, against the targets."""

if __name__ == "__main__":
    from benchmarks import alone

    alone.main("solvers", __doc__)

import time
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np

import serpentail as st
from benchmarks.fixtures import label
from benchmarks.planning import EXAMPLE, figure, plan
from examples import righting
from examples.studies.righting_kinds import is_true

SOLVERS = {"FATROP": {"solver": "fatrop"}, "IPOPT": {"solver": "ipopt"}}
REPEATS, ITERATIONS = 3, 30
MESHES = {(1, 3): (40, 4), (6, 2): (83, 5)}  # intervals, times as fast as IPOPT
RANDOM, MEDIAN, WITHIN = 200, 0.05, 0.2  # starts of (1, 3), s, s
KICKED = {(3, 2): 0.5, (4, 2): 2.0, (6, 2): 30.0}  # s
LIMIT = 300.0  # s of wall clock that a plan may take
OBJECTIVES, BESIDE = 50, 10  # starts, and those of them from which IPOPT plans, too
SHARE = 95  # % of plans that should be true
TICKS, TICK, AGAIN = 60, 2.0, 3.0  # calls, ms, ms


class Made(NamedTuple):
    """A plan, and the CPU time of the call that made it (s)."""

    plan: st.Plan
    cpu_s: float

    @property
    def true(self) -> bool:
        """Its torques bring the torso to the goal."""
        return is_true(self.plan.report)


def solver_times(folder: Path) -> list[dict]:
    """Planning by FATROP and by IPOPT with MUMPS from the same starts, in CPU time of the whole
    call: an iteration on the same mesh, random starts, the kick's state, other objectives; and
    `st.Mpc`, which plans again in flight. True: within 0.01 deg when the torques are applied.
    """
    models = {size: righting.model(*size, righting.STAGED) for size in ((1, 3), *KICKED)}
    rat = models[1, 3]
    rows = [iteration(models[size], *MESHES[size]) for size in MESHES]
    rows += random_starts(rat)
    rows += [kicked(models[size], most) for size, most in KICKED.items()]
    rows += [objective(rat, name) for name in ("energy", "time")]
    return rows + ticks(rat)


def made(call: Callable[[], st.Plan]) -> Made:
    """Return a plan, and the CPU time of making it."""
    begun = time.process_time()
    found = call()
    return Made(found, time.process_time() - begun)


def iteration(rat: st.Model, intervals: int, least: float) -> dict:
    """Time an iteration from passive flight, torques and states on one mesh."""
    given = {"intervals": intervals, "controls": intervals, "tolerance": None, "retries": 0}
    each = dict.fromkeys(SOLVERS, np.inf)
    for _ in range(REPEATS):
        for name, way in SOLVERS.items():
            most = {"options": {f"{way['solver']}.max_iter": ITERATIONS}}
            told = plan(rat, track=False, **given, **way, **most).report
            each[name] = min(each[name], told["solve_cpu_s"] / told["iterations"])
    ratio = each["IPOPT"] / each["FATROP"]
    about = ", ".join(f"{name} {1e3 * s:.2f} ms" for name, s in each.items())
    name = f"{label(rat.segments, rat.links)}, {intervals} intervals, an iteration"
    return figure(name, f"{ratio:.1f}x", f">= {least:g}x", about)


def random_starts(rat: st.Model) -> list[dict]:
    """Plan from random starts, the torso at rest at the end."""
    found: dict[str, list[Made]] = {name: [] for name in SOLVERS}
    for seed in range(1, RANDOM + 1):
        for name, way in SOLVERS.items():
            found[name].append(made(lambda seed=seed, way=way: plan(rat, seed, track=False, **way)))
    rows, head = [], f"{label(rat.segments, rat.links)}, {RANDOM} starts, at rest, "
    for name, plans in found.items():
        times = np.array([one.cpu_s if one.true else np.inf for one in plans])
        true = f"{100 * np.isfinite(times).mean():.1f} % true at all"
        middle = f"{np.median([one.cpu_s for one in plans]):.3f} s"
        rows.append(figure(f"{head}{name}, median", middle, f"<= {MEDIAN} s", true))
        share = f"{100 * (times <= WITHIN).mean():.1f} %"
        rows.append(figure(f"{head}{name}, true within {WITHIN} s", share, f">= {SHARE} %"))
    return rows


def kicked(rat: st.Model, most: float) -> dict:
    """Plan from the kick's state, the torso at rest at the end."""
    told, start = {}, righting.kicked(rat)
    for name, way in SOLVERS.items():
        told[name] = made(
            lambda way=way: plan(rat, start=start, time_limit=LIMIT, track=False, **way)
        )
    error = {k: righting.row(one.plan)["open_loop_attitude_error_deg"] for k, one in told.items()}
    about = (
        f"{error['FATROP']:.4f} deg; IPOPT {told['IPOPT'].cpu_s:.2f} s, {error['IPOPT']:.4f} deg"
    )
    value = f"{told['FATROP'].cpu_s:.2f} s{'' if told['FATROP'].true else ', not true'}"
    return figure(f"{label(rat.segments, rat.links)} from the kick", value, f"<= {most:g} s", about)


def objective(rat: st.Model, name: str) -> dict:
    """Plan for another objective from random starts."""
    given = {"objective": name, "time_limit": LIMIT, "track": False}
    found: dict[str, list[Made]] = {solver: [] for solver in SOLVERS}
    for seed in range(1, OBJECTIVES + 1):
        for solver, way in SOLVERS.items():
            if solver == "FATROP" or seed <= BESIDE:
                call = made(lambda seed=seed, way=way: plan(rat, seed, **given, **way))
                found[solver].append(call)
    medians = {solver: np.median([one.cpu_s for one in some]) for solver, some in found.items()}
    beside = sum(one.true for one in found["IPOPT"])
    about = (
        f"median {medians['FATROP']:.2f} s; IPOPT, the first {BESIDE}: {beside} true, "
        f"{medians['IPOPT']:.2f} s"
    )
    share = f"{100 * np.mean([one.true for one in found['FATROP']]):.0f} %"
    return figure(
        f"{label(rat.segments, rat.links)}, {name}, {OBJECTIVES} starts, true",
        share,
        f">= {SHARE} %",
        about,
    )


def ticks(rat: st.Model) -> list[dict]:
    """Time `st.Mpc` from states up to 1 % away: one step, and the two that plan again."""
    q, v = righting.tumbling(rat, EXAMPLE)
    first, random = plan(rat, goal=st.Goal(torso_rate=None), track=False), np.random.default_rng(0)
    rows = []
    for steps, what, most in ((1, "a tick", TICK), (2, "planning again by two steps", AGAIN)):
        mpc, least = st.Mpc(rat, first, iterations=steps), np.inf
        for _ in range(TICKS):
            near = v * (1 + random.uniform(-0.01, 0.01, v.size))
            mpc.begin()
            begun = time.process_time()
            mpc.tick(0.0, q, near)
            least = min(least, time.process_time() - begun)
        about = f"{mpc.settings.intervals} intervals, {first.duration:.2f} s ahead"
        name = f"{label(rat.segments, rat.links)}, predictive control, {what}"
        rows.append(figure(name, f"{1e3 * least:.2f} ms", f"<= {most:g} ms", about))
    return rows
