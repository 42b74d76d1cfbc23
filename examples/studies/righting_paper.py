"""The paper's program (`examples.paper`) in the righting study: its plans, and their numbers."""

import numpy as np

import serpentail as st
from examples.paper.collocation import PaperPlan, paper_plan, states_of
from serpentail.basics.attitude import angle_deg, from_angles

ITERATIONS = 300  # of IPOPT, as many as `st.plan` has
TRUE = ("open_loop_attitude_error_deg", "energy_J", "peak_power_W")
TRACKED = ("tracked_attitude_error_deg", "tracked_tail_error_rad", "dyn_err")
SAMPLES = 1000  # of a flight


def planned(rat: st.Model, *task, time_limit: float, **settings) -> PaperPlan:
    """Plan (start, duration, bounds) within a time (s)."""
    limit = {"max_iter": ITERATIONS, "max_wall_time": time_limit}
    return paper_plan(rat, *task, **limit, **settings)


def row(rat: st.Model, plan: PaperPlan) -> dict:
    """Return the numbers of a plan under the names of `righting.row`.

    Those of the true flight, in which its torques act open loop, are nan if it diverges.
    """
    duration = plan.times[-1]
    found = plan.stats | {"duration_s": float(duration), "objective": plan.stats["effort"]}
    how = {"t_span": duration, "output_step": duration / SAMPLES, "rtol": 1e-10}
    try:
        flight = st.simulate(rat, *plan.start, controller=plan.law, **how)
    except st.SimulationError:
        return found | dict.fromkeys(TRUE, np.nan)
    power = np.abs(flight.tau * flight.v[:, rat.layout.tail_v]).sum(axis=1)
    error = angle_deg(attitude_at_end(plan), flight.attitude[-1])
    numbers = error, np.trapezoid(power, flight.t), power.max()
    return found | dict(zip(TRUE, map(float, numbers), strict=True))


def tracked(rat: st.Model, plan: PaperPlan) -> dict:
    """Return the errors of the flight whose tail tracks a spline through the nodes by PFL (Eq. 46).

    "dyn_err" is the distance over time of the state from the plan's (Eq. 50).
    """
    tail = plan.states[:, plan.places["tail"]]
    law = st.Pfl(rat, (plan.times, tail), torque=plan.most)
    end = np.nextafter(plan.times[-1], 0)  # there PFL wants the tail at rest
    how = {"t_span": end, "output_step": end / SAMPLES}
    try:
        flight = st.simulate(rat, *plan.start, controller=law, **how)
    except st.SimulationError:  # a plan that did not converge may ask for anything
        return dict.fromkeys(TRACKED, np.nan)
    there = states_of(flight, plan.places)
    there = np.column_stack([np.interp(plan.times, flight.t, x) for x in there.T])
    off = there - plan.states
    off[:, plan.places["angles"]] -= off[0, plan.places["angles"]]  # whole turns
    errors = (
        angle_deg(attitude_at_end(plan), flight.attitude[-1]),
        np.abs(off[:, plan.places["tail"]]).max(),
        np.sqrt(np.trapezoid(np.sum(off**2, axis=1), plan.times)),
    )
    return dict(zip(TRACKED, map(float, errors), strict=True))


def attitude_at_end(plan: PaperPlan) -> np.ndarray:
    """Return the planned quaternion (4,) at the end."""
    return from_angles(plan.states[-1, plan.places["angles"]])
