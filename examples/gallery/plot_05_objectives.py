"""
Least effort, least energy, least time
======================================

Three plans turn the same tumbling animal upright. They differ only in what they
minimise: the integral of the squared torques (effort), the work of the torques
(energy), or the duration.

This example needs CasADi: ``pip install "serpentail[plan]"``.
"""

import matplotlib.pyplot as plt
import numpy as np

import serpentail as st

model = st.build("righting_m1_n3")
q0 = np.array([0, 0, 0.4, np.cos(0.5), np.sin(0.5), 0, 0, 0, 0])  # pitch 1 rad
v0 = np.array([0, 0, 2.0, 14, 1, 0, 0, 0])
plans = {
    objective: st.plan(
        model,
        start=(q0, v0),
        goal=st.Goal(torso_rate=None),  # upright, any rate of the torso
        duration=(0.15, 0.58),  # s
        bounds=st.Bounds(angle=np.pi / 3, torque=0.02),
        objective=objective,
    )
    for objective in ("effort", "energy", "time")
}
for name, plan in plans.items():
    print(f"{name}: found {plan.success}, {plan.duration:.3f} s, {plan.report['energy_J']:.2g} J")

# %%
# The plan of least time begins at the torque limit of 20 mN m. Its tail turns fast,
# and it needs eighty times the energy of the cheapest plan.

plt.style.use("seaborn-v0_8-colorblind")
figure, (top, bottom) = plt.subplots(2, 1, figsize=(7, 4.6), sharex=True, layout="constrained")
for (name, plan), line in zip(plans.items(), ["-", "--", "-."], strict=True):
    motion = plan.trajectory
    told = f"least {name}: {plan.duration:.2f} s, {1e3 * plan.report['energy_J']:.1f} mJ"
    top.plot(motion.t, 1e3 * motion.tau[:, 0], line, label=told)
    bottom.plot(motion.t, np.degrees(motion.tail[:, 0]), line)
top.set(title="Three plans, the same goal: speed is expensive", ylabel="pitch torque (mN m)")
bottom.set(xlabel="time (s)", ylabel="pitch of each joint (deg)")
top.legend(loc="lower right", fontsize="small")
plt.show()

# %%
# All three motions over each other. Each ends upright.

st.view([plan.trajectory for plan in plans.values()], None, names=list(plans))
