"""What the plans of the paper's program (`collocation`) are worth: flights by their torques, and by
their tail's path.
"""

from itertools import product

import numpy as np

import serpentail as st
from examples.paper.collocation import PaperPlan, paper_plan, states_of
from serpentail.basics.attitude import angle_deg, from_angles

# iterations of IPOPT in three rounds of tries; `st.plan` has 300, too. Which plan comes after many
# depends on how a processor rounds, so those that need few come first.
SHORT, ITERATIONS, MOST = 80, 300, 1500
TRUE = ("open_loop_attitude_error_deg", "energy_J", "peak_power_W")
TRACKED = ("tracked_attitude_error_deg", "tracked_tail_error_rad", "dyn_err")
SAMPLES = 1000  # of a flight
PUSHES = 3  # random guesses after passive flight


def planned(rat: st.Model, *task, time_limit: float, **settings) -> PaperPlan:
    """Plan (start, duration, bounds) within a time (s)."""
    limit = {"max_iter": ITERATIONS, "max_wall_time": time_limit}
    return paper_plan(rat, *task, **limit | settings)


def searched(rat: st.Model, *task, time_limit: float) -> PaperPlan:
    """Return the first plan for (start, duration, bounds) whose program converges, else the last.

    The first guess is passive flight (Sect. 3.2); the others begin with random pushes of 1 rad/s,
    as Sect. 4.5 advises. If none converges in few iterations, all are tried again with more.
    """
    (q, v), *_ = task
    for most, seed in product((SHORT, ITERATIONS, MOST), range(1 + PUSHES)):
        push = np.random.default_rng(seed).normal(size=rat.nv) * (np.arange(rat.nv) >= 3)
        guess = q, v + push * (seed > 0)
        plan = planned(rat, *task, guess=guess, time_limit=time_limit, max_iter=most)
        if plan.stats["converged"]:
            break
    return plan


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
    error = angle_deg(attitude_at_end(plan), flight.attitude[-1])
    numbers = error, *work(flight)
    return found | dict(zip(TRUE, map(float, numbers), strict=True))


def work(motion: st.Trajectory) -> tuple[float, float]:
    """Return energy (J) and peak power (W) of a motion's torques; braking costs, too."""
    power = np.abs(motion.tau * motion.tail_rate).sum(axis=1)
    return float(np.trapezoid(power, motion.t)), float(power.max())


def law(rat: st.Model, plan: PaperPlan) -> st.Pfl:
    """Return PFL along a spline through the nodes, without q_t_ddot_r, as the paper had it."""
    return st.Pfl(rat, (plan.times, plan.states[:, plan.places["tail"]]), feedforward=False)


def followed(rat: st.Model, plan: PaperPlan) -> st.Trajectory:
    """Return the flight whose tail follows a plan by PFL (Eq. 46)."""
    end = np.nextafter(plan.times[-1], 0)  # there PFL wants the tail at rest
    how = {"t_span": end, "output_step": end / SAMPLES}
    return st.simulate(rat, *plan.start, controller=law(rat, plan), **how)


def as_motion(rat: st.Model, plan: PaperPlan) -> st.Trajectory:
    """Return a plan's nodes as a motion."""
    of = {name: plan.states[:, at] for name, at in plan.places.items()}
    q = np.column_stack([of["position"], from_angles(of["angles"]), of["tail"]])
    v = np.column_stack([of["velocity"], of["torso_rate"], of["tail_rate"]])
    told = (*rat.energy(q, v), *rat.momentum(q, v))
    return st.Trajectory(plan.times, q, v, plan.torques, *told, model=rat)


def tracked(rat: st.Model, plan: PaperPlan) -> dict[str, float]:
    """Return the errors of the flight whose tail follows a plan; nan if it diverges.

    "dyn_err" is the distance over time of the state from the plan's (Eq. 50).
    """
    try:
        flight = followed(rat, plan)
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
