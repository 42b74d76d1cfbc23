"""The plans of the righting study, each a part of it, by tail: plain data in, plain data out."""

from functools import cache

import numpy as np

import serpentail as st
from examples import righting
from examples.studies import righting_paper
from examples.studies.parts import as_lists

EXAMPLE = 4  # the random start of Fig. 11: both ways of planning converge on it
RAT = (1, 3)
LIMIT = 300.0  # s a plan


@cache
def rat(segments: int, links: int | None) -> st.Model:
    """Return a tail with the functions of plans."""
    return righting.model(segments, links)


def content(size: tuple) -> dict:
    """Build a tail's model, and return its content hash."""
    return {"content_hash": rat(*size).manifest["content_hash"]}


def section_4_2() -> dict:
    """Plan from the kick's state within 0.58 s; add flights that follow the plan, by its torques
    and by feedback, and one whose tail only damps.
    """
    model = rat(*RAT)
    start, limits = righting.kicked(model), righting.bounds(model)
    given = {"start": start, "bounds": limits, "duration": (0.3, righting.FLIGHT)}
    plan = st.plan(model, solver=st.Solver(retries=8, time_limit=LIMIT), **given)
    flights = {"planned": plan.trajectory, "tracked": righting.tracked(model, plan)}
    flights["passive"] = righting.passive(model, start, plan.duration)
    at = np.clip(plan.trajectory.t, 0, flights["tracked"].t[-1])
    deviation = flights["tracked"].resample(at).tail - plan.trajectory.tail
    row = righting.row(plan) | {
        "mean_rad": deviation.mean(axis=0).tolist(),
        "std_rad": deviation.std(axis=0).tolist(),
    }
    return {"row": row, "flights": {kind: as_lists(flight) for kind, flight in flights.items()}}


def example(intervals: int) -> dict:
    """Fig. 11: plan from one random start."""
    model = rat(*RAT)
    plan = st.plan(
        model,
        start=righting.tumbling(model, EXAMPLE),
        bounds=righting.bounds(model),
        duration=righting.FLIGHT,
        mesh=st.Mesh(intervals=intervals),
        tolerances=st.Tolerances(attitude=None),
        solver=st.Solver(retries=0, time_limit=LIMIT),
    )
    return righting.row(plan)


def paper_example(nodes: int) -> dict:
    """Fig. 11: plan from this start as the paper does."""
    model = rat(*RAT)
    task = righting.tumbling(model, EXAMPLE), righting.FLIGHT, righting.bounds(model)
    plan = righting_paper.planned(model, *task, nodes=nodes, time_limit=LIMIT)
    return righting_paper.row(model, plan) | righting_paper.tracked(model, plan)


def true(size: tuple) -> dict:
    """Sect. 4.3: plan from the kick's state until the plan is true."""
    model = rat(*size)
    start, limits = righting.kicked(model), righting.bounds(model, 2 * np.pi)
    given = {"start": start, "bounds": limits, "duration": (0.3, righting.FLIGHT)}
    plan = st.plan(model, solver=st.Solver(retries=8, time_limit=LIMIT), **given)
    return {"row": righting.row(plan), "flight": as_lists(plan.trajectory)}


def paper(size: tuple) -> dict:
    """Sect. 4.3: plan from the kick's state as the paper does, at 100 Hz."""
    model = rat(*size)
    start, limits = righting.kicked(model), righting.bounds(model, 2 * np.pi)
    plan = righting_paper.planned(model, start, righting.FLIGHT, limits, time_limit=LIMIT)
    return righting_paper.row(model, plan) | righting_paper.tracked(model, plan)
