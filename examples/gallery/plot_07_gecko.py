"""
A gecko turns over without any angular momentum
===============================================

A gecko that falls on its back rights itself in the air by a swing of its tail
(Jusufi et al., PNAS 105, 2008). It starts at rest, so its total angular momentum
is zero, and it stays zero: the tail and the torso turn in opposite directions.

The example scene ``gecko`` has a body of 61 mm and a tail of 66 mm. We plan the
swing, with at most 2 mN m at each joint coordinate. This example needs CasADi:
``pip install "serpentail[plan]"``.
"""

import matplotlib.pyplot as plt
import numpy as np

import serpentail as st

gecko = st.build("gecko")
q0 = np.array([0, 0, 1.0, 0, 0, 1, 0, 0.1, 0.1])  # upside down
plan = st.plan(
    gecko,
    start=(q0, np.zeros(8)),
    goal=st.Goal(torso_rate=None),  # upright, any rate of the torso
    duration=0.3,
    bounds=st.Bounds(angle=np.radians(40), torque=2e-3),
)
print(plan)

# %%
# The angular momentum of the torso about its own centre of mass follows from its
# angular velocity and its inertia. The rest is mostly that of the tail.

motion = plan.trajectory
R = st.rotation_matrix(motion.q[:, 3:7])
inertia = np.array(gecko.parameters["torso_inertia"])
torso = np.einsum("kij,kj->ki", R, inertia * motion.v[:, 3:6])  # world axes
rest = motion.angular_momentum - torso

plt.style.use("seaborn-v0_8-colorblind")
figure, (left, right) = plt.subplots(1, 2, figsize=(7, 3.4), layout="constrained")
left.plot(motion.t, np.degrees(np.arccos(np.clip(R[:, 2, 2], -1, 1))))
left.set(title="From the back to the feet", xlabel="time (s)", ylabel="tilt of the back (deg)")
left.set_yticks(range(0, 181, 45))
for part, name, line in [(torso, "torso", "-"), (rest, "rest", "--"), (torso + rest, "sum", ":")]:
    right.plot(motion.t, 1e6 * part[:, 1], line, label=name)
right.set(title="The sum stays zero", xlabel="time (s)")
right.set_ylabel("forward angular momentum ($10^{-6}$ kg m$^2$/s)")
right.legend(loc="center right")
plt.show()

# %%
# The page simulates the torques of the plan, and computes that again for other geckos: the
# plan knows one body only.

table = st.TorqueTable(motion.t, motion.tau)
flight = st.simulate(gecko, motion.q[0], motion.v[0], controller=table, t_span=motion.t[-1])
st.view([flight, motion], None, names=["by the torques", "as planned"], live=True)
