"""
A plan with your own objective and constraint
=============================================

``st.plan`` finds torques of the tail that turn a tumbling animal upright. Here
the objective and one constraint are our own: the tail should stay as straight as
possible, and the motors of the tail can give at most 30 mW together.

This example needs CasADi: ``pip install "serpentail[plan]"``.
"""

import casadi
import matplotlib.pyplot as plt
import numpy as np

import serpentail as st

model = st.build("righting_m1_n3")
q0 = np.array([0, 0, 0.34, np.cos(1.9), np.sin(1.9), 0, 0, -0.558, 0])  # pitch 3.8 rad
v0 = np.array([0, -0.3, 2.39, 26.2, 0, 0, 4.7, 0])
task = {
    "start": (q0, v0),
    "goal": st.Goal(attitude="upright", torso_rate=None),  # any yaw, any rate
    "duration": 0.5,
    "bounds": st.Bounds(angle=np.pi / 3, torque=0.02),
}
plain = st.plan(model, **task)  # least effort, any power

# %%
# An objective is a function of a *point* of the motion. A point has CasADi
# expressions such as ``torque``, ``tail``, ``tail_rate`` and ``tip``. A path
# constraint is a function of a point with its least and largest value. Solvers work
# best with numbers near 1, so both functions are scaled.


def straight(point):
    """Small torques, a straight tail."""
    return casadi.sumsqr(point.torque / 0.02) + casadi.sumsqr(point.tail)


def power(point):
    """All motors together, as a part of 30 mW."""
    return casadi.dot(point.torque, point.tail_rate) / 0.03


mesh = st.Mesh(intervals=24)
own = st.plan(model, **task, objective=straight, path=[(power, -1, 1)], mesh=mesh)
print(own)

# %%
# The limited plan keeps within the 30 mW, and the plan without the limit does not.

plt.style.use("seaborn-v0_8-colorblind")
figure, (left, right) = plt.subplots(1, 2, figsize=(7, 3.4), layout="constrained")
for name, plan in {"least effort": plain, "straight tail, 30 mW": own}.items():
    motion = plan.trajectory
    watts = (motion.tau * motion.tail_rate).sum(axis=1)
    left.plot(motion.t, 1e3 * watts, label=name)
    right.plot(motion.t, np.degrees(motion.tail[:, 0]))
left.axhspan(-30, 30, color="0.92")
left.set(title="Own plan: at most 30 mW", xlabel="time (s)", ylabel="power (mW)")
right.set(title="Both swing the tail twice", xlabel="time (s)", ylabel="pitch of each joint (deg)")
left.legend(fontsize="small")
plt.show()

# %%
# The page shows what the planned torques do in a simulation, which it computes again for
# other bodies and starts, and the motion as planned.

table = st.TorqueTable(motion.t, motion.tau)
flight = st.simulate(model, motion.q[0], motion.v[0], controller=table, t_span=motion.t[-1])
st.view([flight, motion], None, names=["by the torques", "as planned"], live=True)
