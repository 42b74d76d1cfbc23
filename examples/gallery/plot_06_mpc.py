"""
Replanning in flight, with a wrong model of the body
====================================================

A plan is only as good as the model behind it. Here the real tail is 15 % shorter
and the inertia of the torso is 15 % larger than the controller believes. We fly
the same plan in three ways:

- open loop: apply the planned torques;
- PFL (partial feedback linearisation): follow the planned motion of the tail;
- MPC (model predictive control): replan the rest of the flight 100 times a second.

This example needs CasADi: ``pip install "serpentail[plan]"``.
"""

import matplotlib.pyplot as plt
import numpy as np

import serpentail as st

believed = st.build("righting_m1_n3")
body = believed.with_parameters(
    tail_length=0.85 * believed.parameters["tail_length"],
    torso_inertia=[1.15 * each for each in believed.parameters["torso_inertia"]],
)
q0 = np.array([0, 0, 0.34, np.cos(1.9), np.sin(1.9), 0, 0, -0.558, 0])  # pitch 3.8 rad
v0 = np.array([0, -0.3, 2.39, 26.2, 0, 0, 4.7, 0])
plan = st.plan(
    believed,
    start=(q0, v0),
    goal=st.Goal(torso_rate=None),  # upright, any rate of the torso
    duration=0.5,
    bounds=st.Bounds(angle=np.pi / 3, torque=0.02),
)

# %%
# The controllers get the believed model. The simulation gets the real body.

laws = {
    "open loop": plan.controller,
    "PFL": st.Pfl(believed, plan),
    "MPC": st.Mpc(believed, plan, rate=100),
}
flights = {
    name: st.simulate(body, q0, v0, controller=law, t_span=plan.duration, output_step=1e-3)
    for name, law in laws.items()
}

# %%
# The tilt is the angle between the back and the vertical. All three flights tumble
# alike, but only replanning ends upright.

plt.style.use("seaborn-v0_8-colorblind")
figure, (left, right) = plt.subplots(1, 2, figsize=(7, 3.8), layout="constrained")
for (name, flight), line in zip(flights.items(), ["-.", "--", "-"], strict=True):
    tilt = np.degrees(np.arccos(np.clip(st.rotation_matrix(flight.q[:, 3:7])[:, 2, 2], -1, 1)))
    print(f"{name}: tilted by {tilt[-1]:.1f} deg at the end")
    left.plot(flight.t, tilt, line)
    right.plot(1e3 * flight.t[-40:], tilt[-40:], line, label=name)
left.set(title="The same tumble ...", xlabel="time (s)", ylabel="tilt of the back (deg)")
right.set(xlabel="time (ms)", title="... but only MPC ends upright")
right.legend()
plt.show()

# %%
# The three flights over each other. PFL can be computed again with other gains:

names = ["PFL", "MPC", "open loop"]
st.view([flights[name] for name in names], None, names=names, live=True)
