"""Figs. 6, 9 and 10: the kick, and the flights after it."""

from pathlib import Path

import numpy as np

import serpentail as st
from examples import righting
from examples.paper import truth
from examples.paper.figures import draw_figure_10
from examples.paper.plans import FREE, LIMIT, RAT, RETRIES
from serpentail.basics.attitude import angle_deg, tilt_deg

BEGIN = 0.5  # s, t_1
UPRIGHT = 30.0  # deg of tilt
PAPER, OURS = "paper", "st.plan"


def jump(folder: Path) -> dict:
    """Figs. 6, 9, 10: the kick of Eq. 48, then a tail that damps, or follows a plan of either."""
    kick, model = st.scenario("kick"), righting.model(*RAT)
    passive = kick.simulate()
    at = np.abs(passive.t - BEGIN).argmin()
    start, limits = (passive.q[at], passive.v[at]), righting.bounds(model)
    task = {"start": start, "duration": FREE, "bounds": limits}
    paper = truth.searched(model, *task.values(), time_limit=LIMIT)
    ours = st.plan(model, **task, solver=st.Solver(retries=RETRIES, time_limit=LIMIT))
    jumps, damping = {"passive": passive}, st.Damping(righting.K_DMP)
    laws = {PAPER: (truth.law(kick.model, paper), paper.times[-1])}
    laws[OURS] = st.Pfl(kick.model, ours), ours.duration
    for name, (law, lasts) in laws.items():
        phases = [(0.0, damping), (BEGIN, law), (BEGIN + lasts, damping)]
        jumps[name] = kick.simulate(controller=st.Phases(phases))
    st.view(list(jumps.values()), folder / "fig9.html", names=list(jumps))
    for name, motion in jumps.items():
        motion.filmstrip(folder / f"fig9_{name}.png")

    flights = {"planned": truth.as_motion(model, paper), "tracked": truth.followed(model, paper)}
    flights["passive"] = righting.passive(model, start, righting.FLIGHT)
    draw_figure_10(flights, RAT[1], folder / "fig10.png")
    told = {name: kick.summary(motion) for name, motion in jumps.items()}
    acts = np.abs(jumps[PAPER].tau + righting.K_DMP * jumps[PAPER].tail_rate).max(axis=1) > 1e-9
    times = jumps[PAPER].t
    ends = {"passive": righting.FLIGHT} | {name: lasts for name, (_, lasts) in laws.items()}
    tilts = {name: tilt_at(BEGIN + ends[name], motion) for name, motion in jumps.items()}
    return {
        "fig6": {
            "begin": float(times[acts.argmax() - 1]),  # the last sample before it acts
            "passive_before": not acts[times < BEGIN].any(),
            "end": [told[name]["recontact_s"] for name in (PAPER, OURS)],
        },
        "fig9": {
            "height": told["passive"]["apex_m"],
            "landing": told["passive"]["recontact_s"],
            "passive": tilts["passive"] > UPRIGHT,
            "tracked": [tilts[name] < UPRIGHT for name in (PAPER, OURS)],
        },
        "fig10": of_figure_10(paper, ours, flights, righting.tracked(model, ours)),
    }


def tilt_at(t: float, motion: st.Trajectory) -> float:
    """Return the torso's tilt (deg) at a time (s)."""
    return float(np.interp(t, motion.t, tilt_deg(motion.attitude)))


def of_figure_10(paper, ours: st.Plan, flights: dict, tracked: st.Trajectory) -> dict:
    """Return the values of Fig. 10; tracked: the flight that follows the plan `ours`."""
    planned, followed, passive = flights.values()
    off = errors_of_tail(followed, truth.law(followed.model, paper))
    better = errors_of_tail(tracked, st.Pfl(tracked.model, ours))
    found = {"energy": [truth.work(planned)[0], ours.report["energy_J"]]}
    found["power"] = [truth.work(planned)[1], ours.report["peak_power_W"]]
    for k, name in enumerate(("alpha", "beta")):
        found[f"mean_{name}"] = [float(x[:, k].mean()) for x in (off, better)]
        found[f"std_{name}"] = [float(x[:, k].std()) for x in (off, better)]
    apart = followed.q[:, :3] - passive.resample(followed.t).q[:, :3]
    missed = angle_deg(planned.attitude[-1], followed.attitude[-1])
    effort = [np.trapezoid(np.sum(x.tau**2, axis=1), x.t) for x in (followed, planned)]
    return found | {
        "path": bool(np.linalg.norm(apart, axis=1).max() < 0.03),
        "mismatch": [bool(missed > 0.1), ours.report["tracked_attitude_error_deg"] > 0.1],
        "torques": bool(0.8 < effort[0] / effort[1] < 1.2),
    }


def errors_of_tail(flight: st.Trajectory, law: st.Pfl) -> np.ndarray:
    """Return how far a tail is from its reference, (K, 2m), rad."""
    return flight.tail - law.curve.at(flight.t)[0]
