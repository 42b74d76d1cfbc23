"""The random starts of the righting study: which animal starts, how, and to what end; each is
planned as we do, by default and by IPOPT alone, and as the paper does.
"""

import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from functools import partial

import numpy as np

import serpentail as st
from examples import righting
from examples.paper import truth
from examples.paper.plans import RAT
from examples.studies.parts import Part

BLOCK = 10  # random starts that are kept together
PAPER = "paper"
WAYS: dict[str, dict] = {
    "auto": {"track": False},
    "IPOPT": {"name": "ipopt", "track": False},
    PAPER: {},
}
LIMIT = 120.0  # s a plan
SLENDER = (1.5, 0.25, 1.5)  # factors of the torso's inertia; the second axis is the long one
TRUE = 0.01  # deg


@dataclass(frozen=True)
class Kind:
    """A kind of start.

    size: of the tail. fewer: how many times fewer starts it has than the first kind. body: factors
    of parameters. still: all rates are zero. any_rate: the torso may turn at the end. settings: of
    the planner.
    """

    size: tuple
    fewer: int = 1
    body: dict = field(default_factory=dict)
    still: bool = False
    any_rate: bool = False
    settings: dict = field(default_factory=dict)

    def ways(self) -> list[str]:
        """Return the ways that take its task: the paper minimises the effort alone."""
        return [way for way in WAYS if way != PAPER or "objective" not in self.settings]


KINDS = {
    "(1, 3)": Kind(RAT),
    "(1, 3), any rate": Kind(RAT, any_rate=True),
    "(2, 3)": Kind((2, 3), 4),
    "(3, 2)": Kind((3, 2), 4),
    "(4, 2)": Kind((4, 2), 10),
    "(5, 2)": Kind((5, 2), 10),
    "(6, 2)": Kind((6, 2), 10),
    "continuum 1": Kind((1, None), 10),
    "continuum 2": Kind((2, None), 10),
    "continuum 3": Kind((3, None), 10),
    "continuum 4": Kind((4, None), 10),
    "half the tail": Kind(RAT, 10, {"tail_length": 0.5}),
    "twice the tail": Kind(RAT, 10, {"tail_length": 2.0}),
    "10 x torso's inertia": Kind(RAT, 10, {"torso_inertia": 10.0}),
    "slender torso": Kind(RAT, 10, {"torso_inertia": SLENDER}),
    "least energy": Kind(RAT, 10, settings={"objective": "energy"}),
    "least time": Kind(RAT, 10, settings={"objective": "time"}),
    "no smoothing": Kind(RAT, 10, settings={"smoothing": 0.0}),
    "falling cat, 1 s": Kind(RAT, 10, still=True, settings={"duration": (0.3, 1.0)}),
}


def titles(count: int) -> dict[tuple[str, str], dict[str, Callable]]:
    """Return what makes the blocks of plans, by their titles, for each kind and way."""
    found = {}
    for name, kind in KINDS.items():
        starts = list(range(1, max(1, count // kind.fewer) + 1))
        blocks = [starts[first : first + BLOCK] for first in range(0, len(starts), BLOCK)]
        for way in kind.ways():
            found[name, way] = {
                f"{name}, {way}, starts {some[0]} to {some[-1]}": partial(block, kind, way, some)
                for some in blocks
            }
    return found


def parts(count: int, of: Callable[[tuple], dict]) -> dict[str, Part]:
    """Return all blocks as parts; of: what the plans of a tail depend on, besides their kind."""
    return {
        title: Part(make, of(KINDS[name].size) | {"kind": asdict(KINDS[name]), "way": WAYS[way]})
        for (name, way), makes in titles(count).items()
        for title, make in makes.items()
    }


def block(kind: Kind, way: str, starts: list[int]) -> list[dict]:
    """Plan from random starts.

    The whole tail of one segment bends by 180 degrees as in Sect. 4.2, others by 360 as in 4.3.
    """
    model, rows = animal(kind), []
    limits = righting.bounds(model, np.pi if kind.size == RAT else 2 * np.pi)
    for k in starts:
        q, v = righting.tumbling(model, k)
        begun = time.process_time()
        row = row_of(kind, way, model, (q, v * (not kind.still)), limits)
        rows.append(row | {"start": k, "cpu_s": time.process_time() - begun})
    return rows


def row_of(kind: Kind, way: str, model: st.Model, start: tuple, limits: st.Bounds) -> dict:
    """Return the numbers of a plan from a start."""
    settings = {"duration": (0.3, righting.FLIGHT)} | kind.settings
    if way == PAPER:
        task = start, settings["duration"], limits
        rest = not kind.any_rate
        plan = truth.planned(model, *task, at_rest=rest, time_limit=LIMIT)
        return truth.row(model, plan)
    goal = {"goal": st.Goal(torso_rate=None)} if kind.any_rate else {}
    given = {"start": start, "bounds": limits} | goal | settings
    solver = st.Solver(**WAYS[way], time_limit=LIMIT)
    return righting.row(st.plan(model, solver=solver, **given))


def animal(kind: Kind) -> st.Model:
    """Return the model of a kind."""
    model = righting.model(*kind.size)
    changes = {
        name: (np.asarray(model.parameters[name]) * factor).tolist()
        for name, factor in kind.body.items()
    }
    return model.with_parameters(**changes)


def rows_of(count: int, found: dict[str, list[dict]]) -> dict[str, dict[str, list[dict]]]:
    """Return the plans by kind and way."""
    rates: dict[str, dict[str, list[dict]]] = {name: {} for name in KINDS}
    for (name, way), makes in titles(count).items():
        rates[name][way] = [row for title in makes for row in found[title]]
    return rates


def is_true(row: dict) -> bool:
    """Tell if a plan solves its program, and its torques lead where they should."""
    return row["converged"] and row["open_loop_attitude_error_deg"] <= TRUE


def table(rates: dict[str, dict[str, list[dict]]]) -> list[str]:
    """Return the rates as the lines of a table in Markdown: for each way how many plans are true,
    the median of the CPU time and the time within which 95 % were made, and the median error;
    plans without a flight rank last, and the median is nan where half the plans have none.
    """
    heads = (f"{way}: true | CPU, s: median, 95 % | error, deg" for way in WAYS)
    lines = [f"| starts | of | {' | '.join(heads)} |", "|---" * (2 + 3 * len(WAYS)) + "|"]
    for name, ways in rates.items():
        cells = [name, str(len(ways["IPOPT"]))]
        for way in WAYS:
            if way not in ways:
                cells += ["", "", ""]
                continue
            rows = ways[way]
            middle, most = np.percentile([row["cpu_s"] for row in rows], (50, 95))
            errors = [row["open_loop_attitude_error_deg"] for row in rows]
            error = np.median(np.nan_to_num(errors, nan=np.inf))  # nan: it has no flight
            told = f"{error:.2g}" if np.isfinite(error) else "nan"
            cells += [str(sum(map(is_true, rows))), f"{middle:.2g}, {most:.2g}", told]
        lines.append(f"| {' | '.join(cells)} |")
    return lines
