"""
How long should the tail be?
============================

A rat that was thrown up pitched has 0.4 s to turn upright. ``st.plan`` chooses the
length of its tail together with the motion, so that the effort is least. Ordinary
plans, each with a tail of known length, confirm the choice.

This example needs CasADi: ``pip install "serpentail[plan]"``.
"""

import matplotlib.pyplot as plt
import numpy as np

import serpentail as st

rat = st.build("righting_m1_n3")
q0 = np.array([0, 0, 0.34, np.cos(0.75), np.sin(0.75), 0, 0, 0.1, 0.1])  # pitched by 1.5 rad
v0 = np.array([0, -0.3, 2.4, -4, 0, 0.5, 0, 0])
task = {"start": (q0, v0), "duration": 0.4, "bounds": st.Bounds(angle=np.pi / 3)}
task["solver"] = st.Solver(track=False)
free = {"tail": (-0.5, 0.5)}  # rad
length = {"tail_length": (0.08, 0.3)}  # m
best = st.plan(rat, **task, design=length)
both = st.plan(rat, **task, design=length, free_start=free, guess=best)
for plan in (best, both):
    print(f"found {plan.success}: {1e3 * plan.design['tail_length']:.0f} mm")

# %%
# Ordinary plans for lengths around the best one. The first guess of each is the plan before it.

found, efforts = best.design["tail_length"], {}
for lengths in (np.linspace(found, 0.12, 5), np.linspace(found, 0.24, 7)):
    plan = best
    for each in lengths:
        body = rat.with_parameters(tail_length=each)
        plan = st.plan(body, **task, guess=plan, tolerances=st.Tolerances(attitude=None))
        efforts[1e3 * each] = 1e6 * plan.report["objective"]

plt.style.use("seaborn-v0_8-colorblind")
figure, ax = plt.subplots(figsize=(7, 3.6), layout="constrained")
ax.plot(*zip(*sorted(efforts.items()), strict=True), "o-", label="plans of known lengths")
for plan, words in ((best, "length chosen"), (both, "length and start of the tail chosen")):
    x, y = 1e3 * plan.design["tail_length"], 1e6 * plan.report["objective"]
    ax.plot(x, y, "*", markersize=14, label=words)
ax.axvline(1e3 * rat.parameters["tail_length"], ls=":", color="gray", label="the rat's own tail")
ax.set(title="A tail that may choose its start needs half the effort", ylim=(0, None))
ax.set(xlabel="length of the tail (mm)", ylabel="objective (1e-6 N² m² s)")
ax.legend(fontsize="small")
plt.show()

# %%
# The torques of the best plan in a simulation, and what was planned, over each other.

motion, body = best.trajectory, rat.with_parameters(**best.design)
table = st.TorqueTable(motion.t, motion.tau)
flight = st.simulate(body, q0, v0, controller=table, t_span=motion.t[-1])
st.view([flight, motion], None, names=["by the torques", "as planned"], live=True)
