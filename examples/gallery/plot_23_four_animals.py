"""
Legs, a second tail, a wheel
============================

A model may have legs with mass, a second tail or a wheel. Each is a table
``[chain.NAME]`` of its scene. The example scene ``runner_tail`` is a runner like a
cheetah, in the air between two strides. Torques swing its tail to one side, so its
torso turns and rolls to the other. Springs hold its legs.
"""

import matplotlib.pyplot as plt
import numpy as np

import serpentail as st

runner = st.scenario("runner_tail").simulate()

plt.style.use("seaborn-v0_8-colorblind")
figure, (left, right) = plt.subplots(1, 2, figsize=(7, 3.4), layout="constrained")
for segment, half in enumerate(["half at the root", "half at the tip"], 1):
    left.plot(1e3 * runner.t, 3 * np.degrees(runner[f"beta_{segment}"]), label=half)
left.set(title="The tail swings", xlabel="time (ms)", ylabel="bend to the side (deg)")
for angle, name in zip(st.pitch_roll_yaw(runner.q).T, ["pitch", "roll", "yaw"], strict=True):
    right.plot(1e3 * runner.t, np.degrees(angle), label=name)
right.set(title="The torso answers", xlabel="time (ms)", ylabel="angle of the torso (deg)")
left.legend()
right.legend()
plt.show()

# %%
# The page computes the flight again with a heavier tail or other springs:

runner.view(None, live=True)

# %%
# A gecko falls on its back, at rest. Its tail goes around in a cone, and its torso rolls
# the other way. A robot swings two tails and spins a wheel. A rat jumps by its legs.

gecko, robot = st.build("gecko_legs", functions=["+pfl"]), st.build("robot_two_tails")
t = np.linspace(0, 0.3, 61)
cone = np.zeros((61, gecko.nu))
cone[:, :2] = np.radians(20) * np.column_stack([np.sin(50 * t), np.cos(50 * t)])
start = np.r_[0, 0, 0.5, 0, 0, 1, 0, cone[0]], np.zeros(gecko.nv)
roll = st.simulate(gecko, start, t[-1], controller=st.Pfl(gecko, st.Reference(t, cone)))
swing = np.array([0.3, 0, 0.08, 0, -0.3, 0, -0.08, 0, 0.05])  # N m
law = st.TorqueTable([0, 0.3], [swing, -swing])
turn = st.simulate(robot, robot.state(height=0.6), 0.3, controller=law)
jump = st.scenario("rat_kick").simulate()
motions = {"rat": jump, "gecko": roll, "runner": runner, "robot": turn}

# %%
# All four after 0.15 s, each at its own size:

u, w = np.meshgrid(np.linspace(0, 2 * np.pi, 40), np.linspace(0, np.pi, 20))
ball = np.stack([np.cos(u) * np.sin(w), np.sin(u) * np.sin(w), np.cos(w)])
view = {"projection": "3d", "elev": 20, "azim": -35}
figure, places = plt.subplots(2, 2, figsize=(7, 6), layout="constrained", subplot_kw=view)
for place, (name, motion) in zip(places.flat, motions.items(), strict=True):
    model, q = motion.model, motion.at(0.15).q
    inertia = np.array(model.parameters["torso_inertia"])
    sizes = np.sqrt(2.5 * (inertia.sum() - 2 * inertia) / model.parameters["torso_mass"])
    torso = np.einsum("ij,j,jkl->ikl", st.rotation_matrix(q[3:7]), sizes, ball)
    place.plot_surface(*torso, color="0.75", alpha=0.5)
    points = model.tail_points(q) - q[:3]
    for chain in model.layout.chains:
        place.plot(*points[chain.points].T, "o-", markersize=4, linewidth=3, label=chain.name)
    place.set(title=name, aspect="equal")
    place.set_axis_off()
    place.legend(fontsize="x-small", loc="lower center", ncols=3)
plt.show()
